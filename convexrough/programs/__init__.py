"""A contact as a program in standard form, for anybody's solver: in memory and as files.

`cr.program(scene, approach=...)` makes one, its `save` writes it for other libraries, and
`convexrough export SCENE` writes all that a scene has.
"""

from convexrough.programs.program import FORMS, Program, program

__all__ = ["FORMS", "Program", "program"]
