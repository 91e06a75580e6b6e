"""Constants of float64 rounding that error bounds use."""

#: Unit roundoff of float64.
ROUNDOFF = 2.0**-53

#: A bound is enlarged by this fraction, far more than the rounding errors of a few operations.
SAFETY = 1e-12

#: Bound, in roundoffs, on the rounding error of k P^(2/3) in float64 and of its sum with A P and D.
SUM_ROUNDOFFS = 16

#: A shear force that differs from f P by at most this number of roundoffs counts as gross sliding.
AT_THE_END = 16
