"""The slider page of a run: what is proved beside what `plots.slider` shows."""

from __future__ import annotations

from typing import Any

from convexrough.contact import Contact
from convexrough.plots.slider import Slides, slider_data, slider_html
from convexrough.progress import Announce
from convexrough.run.report import describe
from convexrough.run.summary import Summary
from convexrough.tabular.units import UnitNames


def slider_page(
    contact: Contact, summary: Summary, units: UnitNames, announce: Announce | None = None
) -> str:
    """The page as HTML. Raises InputError if the scene has no friction, or another base."""
    return slider_html(Slides.of(contact, announce), _proved(summary, units), units)


def page_data(
    contact: Contact, summary: Summary, units: UnitNames, announce: Announce | None = None
) -> dict[str, Any]:
    """What the page shows."""
    return slider_data(Slides.of(contact, announce), _proved(summary, units), units)


def _proved(summary: Summary, units: UnitNames) -> list[str]:
    part = {"normal": summary["normal"]}
    return describe(part, length_unit=units.length, force_unit=units.force)
