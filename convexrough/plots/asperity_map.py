"""The map of asperities that all figures use: discs in true size, or one image for many."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import matplotlib
import numpy as np
import scipy  # its parts are imported when they are used
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import EllipseCollection
from matplotlib.colors import Normalize, to_rgba, to_rgba_array
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse
from numpy.typing import ArrayLike, NDArray

from convexrough.arrays import Array, Number
from convexrough.plots import style
from convexrough.plots.notebook import Figure, panels
from convexrough.plots.style import COLOURS, DASHED, DOUBLE, FAINT, SINGLE, SMOOTH, Scale, ink

#: DENSE or more discs are stored as pixels in vector files. CROWDED or more discs are replaced by a
#: mosaic, an image in which each pixel has the colour of the nearest asperity, or a mean.
DENSE, CROWDED = 200, 3000

#: Width of a mosaic in pixels.
PIXELS = 400

#: Colour and label of each status: more slip is darker, also in grey.
STICK, SLIP, SLIDING, UNKNOWN = "#b9d0e5", "#e0842a", "#701c05", "0.85"
Looks = Mapping[str, tuple[str, str]]
LOOKS: Looks = {
    "stuck": (STICK, "sticks"),
    "partial": (SLIP, "slips in part"),
    "sliding": (SLIDING, "slides"),
    "intermittent": ("#5b5b9a", "loses contact"),
    "undecided": (UNKNOWN, "undecided"),
}


class Layer(NamedTuple):
    """Discs of one status; later layers cover earlier ones.

    radii : (n,) [length], 0 for no disc;  shades : (n, 4), or one colour;  rim : of the outlines
    """

    status: str
    radii: Array
    shades: Any
    rim: str | None = SMOOTH


def draw_map(
    axes: Axes,
    points: Array,
    length: style.Measure,
    layers: Sequence[Layer],
    *,
    outline: Sequence[float] = (),
    room: Array | None = None,
) -> None:
    """Draw discs, and faint dots at points without a disc, in a square with a margin.

    points  : (n, 2) [length];  outline : semi-axes [length] of an ellipse to outline
    room    : (n,) [length] radii of discs that must fit into the square; default: of those drawn

    If there are `CROWDED` or more discs, a mosaic replaces discs and dots.
    """
    points, outline = length.of(points), [length.of(axis) for axis in outline]
    layers = [each._replace(radii=length.of(each.radii)) for each in layers]
    whole = np.max([np.zeros(len(points)), *(each.radii for each in layers)], axis=0)
    shown, fits = whole > 0, whole if room is None else length.of(room)
    there = fits > 0 if fits.any() else fits == 0  # without discs, all points fit
    rims, reach = np.reshape(outline, (-1, 2)), fits[there, None]
    ends = np.concatenate((points[there] - reach, points[there] + reach, -rims, rims))
    low, high = ends.min(axis=0), ends.max(axis=0)
    middle, half = (low + high) / 2, 0.53 * (float((high - low).max()) or 1.0)
    low, high = middle - half, middle + half
    if np.count_nonzero(shown) >= CROWDED:
        shades = np.tile(to_rgba("white"), (len(points), 1))
        for each in layers:
            part = np.divide(each.radii, whole, out=np.zeros(len(whole)), where=shown) ** 2
            shades += part[:, None] * (to_rgba_array(each.shades) - shades)
        shades[~shown, 3] = 0.0
        _draw_mosaic(axes, points, shades, low, high)
    else:
        bare = points[~shown & ((points > low) & (points < high)).all(axis=1)]
        size = float(np.clip(25.0 / np.sqrt(len(bare) + 1), 0.4, 1.5))
        axes.plot(*bare.T, "o", ms=size, mew=0, color=FAINT, rasterized=len(bare) >= CROWDED,
                  label="open")  # fmt: skip
        for each in layers:
            draw_discs(axes, points, each)
    draw_outline(axes, outline)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), aspect="equal")
    style.few_ticks(axes)
    style.label(axes, length.label("x"), length.short("y"))


def tiles(count: int, lines: int) -> tuple[Figure, list[Axes]]:
    """A new figure of so many maps that share their axes, below titles of so many lines."""
    columns = min(count, 4)
    rows, width = -(-count // columns), SINGLE if columns == 1 else DOUBLE
    height = rows * ((width - 0.5) / columns + 0.17 * lines) + (0.95 if columns == 1 else 0.75)
    figure, places = panels(width, height, rows, columns, sharex=True, sharey=True)
    for axes in places[count:]:
        axes.remove()
    for axes in places[count - columns : count]:
        axes.tick_params(labelbottom=True)
    return figure, places[:count]


def label_tiles(figure: Figure, places: Sequence[Axes], x: str, y: str) -> None:
    """Label the axes of the maps of `tiles` once."""
    for axes in places:
        axes.set(xlabel="", ylabel="")
        axes.xaxis.set_major_locator(style.round_ticks(4))
        axes.ticklabel_format(axis="x", scilimits=(-1, 4))  # -0.005 and 0.000 would touch
    figure.supxlabel(x, fontsize=style.LABEL)
    figure.supylabel(y, fontsize=style.LABEL)


def draw_statuses(
    axes: Axes,
    points: Array,
    length: style.Measure,
    status: NDArray[np.str_],
    radii: Number,
    *,
    stick: Array | None = None,
    looks: Looks = LOOKS,
    **how: Any,
) -> None:
    """Draw a disc for each status of `looks`, and the stick discs of "partial" asperities.

    radii, stick : (n,) [length];  how : the options of `draw_map`
    """
    layers = [Layer(it, np.where(status == it, radii, 0.0), looks[it][0]) for it in looks]
    if stick is not None:
        there = (status == "partial") & (np.asarray(radii) > 0)
        layers.append(Layer("stick", np.where(there, stick, 0.0), STICK))
    draw_map(axes, points, length, layers, **how)


def draw_values(
    axes: Axes,
    scale: Scale,
    values: Array,
    name: str,
    *,
    radii: Array | None = None,
    most: float | None = None,
    signed: bool = False,
) -> ScalarMappable:
    """Draw discs coloured by `values`, and a named colour bar; return the map of colours.

    values : (n,), one for each contact disc; or (k, n), of discs with `radii` (k, n) [length], the
        largest first;  most : the end of the colour scale; default: the largest absolute value
    signed : the colours run from dark for negative values to light for positive ones

    Discs without a finite value are grey, as a legend says; if all are, a text replaces the bar.
    """
    values = np.where(np.isfinite(values), values, np.nan)  # an infinite one would take a colour
    most = float(np.nanmax(np.abs(values), initial=0.0)) or 1.0 if most is None else most
    spread = Normalize(-most if signed else 0.0, most)
    shades = matplotlib.colormaps["viridis" if signed else COLOURS].with_extremes(bad=UNKNOWN)
    colours = ScalarMappable(spread, shades)
    rim = SMOOTH if radii is None else None
    sizes = np.atleast_2d(scale.contact.contact_radii if radii is None else radii)
    layers = [
        Layer("_inner discs" if k else "contact discs", radius, colours.to_rgba(each), rim)
        for k, (radius, each) in enumerate(zip(sizes, np.atleast_2d(values), strict=True))
    ]
    draw_map(axes, scale.points, scale.length, layers, outline=scale.axes)
    drawn, known = sizes > 0, np.isfinite(values)
    if drawn.any() and not (known & drawn).any():
        style.say_nothing(axes, "not known")
        return colours
    style.bar(axes, colours, name, above=not signed)
    if (drawn & ~known).any():
        style.legend(axes, "corner", handles=[style.disc_handle(UNKNOWN, "not known")])
    return colours


def draw_discs(axes: Axes, points: Array, layer: Layer) -> None:
    """Draw the discs of a layer in true size."""
    there = layer.radii > 0
    if not (count := np.count_nonzero(there)):
        return
    shades = to_rgba_array(layer.shades)
    few = count < DENSE or layer.status == "undecided"
    axes.add_collection(
        EllipseCollection(
            *(2.0 * layer.radii[there],) * 2,
            np.zeros(count),
            units="xy",
            offsets=points[there],
            offset_transform=axes.transData,
            facecolors=shades[there] if len(shades) == len(there) > 1 else shades,
            edgecolors=layer.rim or "none",
            linewidths=0.4 if few and layer.rim else 0.0,
            rasterized=count >= DENSE,
            label=layer.status,
        ),
        autolim=False,
    )


def draw_outline(
    axes: Axes, semi_axes: Sequence[float], dashes: Any = DASHED, colour: str = ""
) -> None:
    """Draw an ellipse about the origin; nothing without semi-axes."""
    if semi_axes:
        sides = [2.0 * axis for axis in semi_axes]
        look: Any = {"fill": False, "ls": dashes, "lw": 0.9, "ec": colour or ink()}
        axes.add_patch(Ellipse((0, 0), *sides, **look))


def status_handles(statuses: ArrayLike, looks: Looks = LOOKS) -> list[Line2D]:
    """Legend entries for each status that occurs."""
    occur = set(np.unique(statuses).tolist())
    return [style.disc_handle(*look) for status, look in looks.items() if status in occur]


def even_radius(points: Array) -> float:
    """The radius of equal discs at points: about 0.38 of their spacing if they fill a circle."""
    size = float(np.ptp(points, axis=0).max()) or 1.0
    return float(size * min(0.36 / np.sqrt(len(points)), 0.05))


def _draw_mosaic(axes: Axes, points: Array, shades: Array, low: Array, high: Array) -> None:
    """Draw a mosaic, as at `CROWDED`, in the square with the corners `low`, `high`."""
    width = high[0] - low[0]
    steps = width * (np.arange(PIXELS) + 0.5) / PIXELS
    places = np.stack(np.meshgrid(low[0] + steps, low[1] + steps), axis=-1)
    # Pixels farther than this from every point stay empty.
    cell = width / np.sqrt(np.count_nonzero(shades[:, 3]))
    _, nearest = scipy.spatial.cKDTree(points).query(places, distance_upper_bound=cell)
    image = np.vstack((shades, np.zeros(4)))[nearest]
    inside = ((points > low) & (points < high)).all(axis=1)
    column, row = ((points[inside] - low) / width * PIXELS).astype(int).T
    sums = np.zeros((PIXELS, PIXELS, 5))
    np.add.at(sums, (row, column), np.pad(shades[inside], ((0, 0), (0, 1)), constant_values=1.0))
    crowded = sums[..., 4] > 1
    image[crowded] = sums[crowded, :4] / sums[crowded, 4:]
    extent = (low[0], high[0], low[1], high[1])
    axes.imshow(image, origin="lower", extent=extent, interpolation="nearest")
