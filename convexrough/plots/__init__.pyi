"""The public names and their modules; `__init__.py` imports each when it is first used."""

from .cycle import cycle_figures as cycle_figures
from .cycle import fretting_figures as fretting_figures
from .gradient import gradient_figures as gradient_figures
from .notebook import plot as plot
from .notebook import save as save
from .notebook import thumbnail as thumbnail
from .path import path_figures as path_figures
from .press import press_figures as press_figures
from .shakedown import shakedown_figures as shakedown_figures
from .shear import shear_figures as shear_figures
from .steady import phase_figures as phase_figures
from .steady import steady_figures as steady_figures
from .surface import surface_figures as surface_figures
from .verdict import verdict_figures as verdict_figures
