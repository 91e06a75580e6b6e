"""What the reference makes of a docstring: its words, with nothing marked up by accident."""

import importlib.util
from pathlib import Path

SPEC = importlib.util.spec_from_file_location(
    "docstrings", Path(__file__).parent.parent / "docs" / "docstrings.py"
)
assert SPEC is not None
assert SPEC.loader is not None
docstrings = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(docstrings)


def shown(text: str) -> list[str]:
    return [line for line in docstrings.restructured(text.split("\n")) if line]


def test_bars_stars_and_underscores_are_mathematics() -> None:
    assert shown("Bounds on |load - solution| of *args and P_ref_.") == [
        r"Bounds on \|load - solution\| of \*args and P\_ref\_."
    ]


def test_backquotes_are_code() -> None:
    assert shown("The largest of `load_errors`, with |P|.") == [
        r"The largest of \ ``load_errors``\ , with \|P\|."
    ]


def test_aligned_names_become_items() -> None:
    text = "approach : D0 [length];  load : total [force]\nerror    : of the\n    |loads|: a bound"
    assert shown(text) == [
        ":approach: D0 [length]",
        ":load: total [force]",
        r":error: of the",
        r"   \|loads\|: a bound",
    ]


def test_examples_stay_as_they_are() -> None:
    text = "It counts.\n\n>>> print(f'{x_ : .3g}', *y)\n0.1 |2|"
    assert shown(text) == ["It counts.", ">>> print(f'{x_ : .3g}', *y)", "0.1 |2|"]


def test_formulas_of_their_own_stay_as_they_are() -> None:
    text = "It stops where\n\n    max |g_i| <= 1e-13 * (|D0|)\n\nand not before."
    assert shown(text) == [
        "It stops where",
        "::",
        "        max |g_i| <= 1e-13 * (|D0|)",
        "and not before.",
    ]
