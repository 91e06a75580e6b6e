"""Speed against error: every solver, at many sizes, with the true error of each answer."""
