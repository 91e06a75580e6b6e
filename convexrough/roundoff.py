"""Roundoff of float64, for the bounds that include it."""

#: Unit roundoff of float64.
ROUNDOFF = 2.0**-53

#: Relative error allowed for a short chain of float64 operations wherever a bound is computed: far
#: more than any such chain in the package can lose, and too little to matter.
SAFETY = 1e-12

#: Number of roundoffs allowed for k P^(2/3) in float64 and its addition to A P and D.
SUM_ROUNDOFFS = 16
