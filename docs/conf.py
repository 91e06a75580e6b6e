"""The site: `python -m sphinx -W docs DIR`. Pages are Markdown; the course is run as it is built.

Opened pages ask the network for nothing: formulas are MathML in the page (formulas.py).
"""

import logging
import re
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from docstrings import literal_docstring
from sphinx.application import Sphinx
from sphinx.util.inspect import TypeAliasForwardRef

from convexrough import __version__

# A library of the theme prints what every logger says; runs of the course say much at INFO.
logging.getLogger("convexrough").setLevel(logging.WARNING)

project = "convexrough"
author = "the authors of convexrough"
copyright = author
release = version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx_gallery.gen_gallery", "formulas"]
exclude_patterns = ["_build"]
html_theme = "furo"
html_title = "convexrough"
html_show_copyright = False
html_copy_source = False
html_static_path = ["_static"]
html_css_files = ["site.css"]

# Pages

myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
myst_dmath_double_inline = True

# Reference

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_preserve_defaults = True
autodoc_type_aliases = {"Array": "Array", "ArrayLike": "ArrayLike", "Kind": "Kind"}
TypeAliasForwardRef.__repr__ = lambda alias: alias.name
python_maximum_signature_line_length = 80

# Course

sphinx_gallery_conf = {
    "examples_dirs": "../examples/course",
    "gallery_dirs": "course",
    "filename_pattern": r"\.py$",
    "ignore_pattern": r"__init__\.py$",
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "only_warn_on_example_error": False,
    "matplotlib_animations": False,
    "remove_config_comments": True,
    "show_memory": False,
    "write_computation_times": False,
    "min_reported_time": 1e9,
}


def without_checks(app: Sphinx, page: str, source: list[str]) -> None:
    """Pages of the course show no `assert`: the scripts check what the text says."""
    if page.startswith("course/"):
        source[0] = re.sub(r"\n+ +assert .*", "", source[0])


def to_the_course(app: Sphinx, page: str, source: list[str]) -> None:
    """Links to a script of the course lead to its page; in the repository, to the script."""
    source[0] = re.sub(
        r"\]\(((?:\.\./)*)\.\./examples/course/(\w+)\.(?:py|rst)\)",
        lambda link: f"]({link[1]}course/{link[2].replace('README', 'index')}.rst)",
        source[0],
    )


def setup(app: Sphinx) -> None:
    app.connect("autodoc-process-docstring", literal_docstring)
    app.connect("source-read", to_the_course)
    app.connect("source-read", without_checks)
