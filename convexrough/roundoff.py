"""What float64 loses, for the bounds that count it."""

#: Unit roundoff of float64.
ROUNDOFF = 2.0**-53

#: Relative error allowed for a short chain of float64 operations wherever a bound is computed:
#: far above what any such chain here can lose, far below what it could matter.
SAFETY = 1e-12
