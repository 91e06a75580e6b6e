"""One sphere on a half-space, in closed form: Hertz, Cattaneo and Mindlin."""
