"""Constants of float64 rounding that error bounds use."""

#: Unit roundoff of float64.
ROUNDOFF = 2.0**-53

#: Allowance in a bound for the relative rounding error of a few float64 operations. It is far
#: larger than this error.
SAFETY = 1e-12

#: Number of roundoffs allowed for computing k P^(2/3) in float64 and adding it to A P and D.
SUM_ROUNDOFFS = 16

#: A shear force within this number of roundoffs of f P counts as f P: gross sliding.
AT_THE_END = 16
