"""Contact problems as convex programs in standard form, for other solvers.

`cr.program(scene, approach=...)` returns a `Program`, and its method `save` writes it to a file.
The command `convexrough export SCENE` writes all programs of a scene.
"""

from convexrough.programs.program import FORMS, Program, program

__all__ = ["FORMS", "Program", "program"]
