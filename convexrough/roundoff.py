"""What float64 loses, for the bounds that count it."""

#: Unit roundoff of float64.
ROUNDOFF = 2.0**-53

#: Relative error allowed for a short chain of float64 operations wherever a bound is computed:
#: far above what any such chain here can lose, far below what it could matter.
SAFETY = 1e-12

#: Roundoffs lost in k P^(2/3), in float64, and in adding it to A P and D.
SUM_ROUNDOFFS = 16
