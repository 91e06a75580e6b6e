"""Hard scenes by name, each with an answer to 50 digits, to test any solver.

`convexrough gallery --export DIR` writes them as files for qpsolvers, Clarabel and CBF readers.
"""

from convexrough.gallery.cases import Checked, HardCase, Manufactured, case, manufactured, names

__all__ = ["Checked", "HardCase", "Manufactured", "case", "manufactured", "names"]
