"""The map of a gradient."""

from dataclasses import replace

import pytest
from friction_scenes import with_friction
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from scenes import NAMED

import convexrough as cr
from convexrough import plots


@pytest.mark.parametrize("factor", [1.0, 5.0])
def test_the_name_of_the_bar_is_not_cut(factor: float) -> None:
    """Whether its numbers are long or short."""
    contact = cr.press(with_friction(NAMED["rough"][0]), load=3.6e-7)
    gradient = cr.cycle(contact, maximum=0.25 * contact.load).gradient()
    larger = replace(gradient, heights=factor * gradient.heights)
    figure = plots.gradient_figures(larger, of="D_0")["gradient"]
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    texts = [each for each in figure.findobj(Text) if isinstance(each, Text)]
    (name,) = [each for each in texts if "partial D_0" in each.get_text()]
    box = name.get_window_extent(canvas.get_renderer())
    assert 0 <= box.x0 < box.x1 <= figure.bbox.width
    assert 0 <= box.y0 < box.y1 <= figure.bbox.height
