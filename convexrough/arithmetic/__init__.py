"""Numbers with more digits than float64 (pairs), and with proved error bounds (balls)."""
