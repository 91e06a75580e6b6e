"""Contact problems as convex programs in standard form, for other solvers.

`cr.program(scene, approach=...)` returns one, its method `save` writes it to a file, and
`convexrough export SCENE` writes all programs of a scene.
"""

from convexrough.programs.program import FORMS, Program, program

__all__ = ["FORMS", "Program", "program"]
