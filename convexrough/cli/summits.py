"""`summits`: find the summits of a measured surface, and press them at several prunings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import click

from convexrough.cli import common
from convexrough.errors import FileError, InputError, blamed_on

if TYPE_CHECKING:
    from convexrough.contact import Contact
    from convexrough.scene.asperities import Asperities
    from convexrough.surface import Surface


class Pressing(NamedTuple):
    """The options that state how to press; if all are None, nothing is pressed."""

    scene: Path | None
    radius: float | None
    approach: float | None
    load: float | None
    modulus: float | None

    def check(self) -> None:
        """Raise UsageError if options exclude each other, or if a required one is missing."""
        scene, radius, approach, load, modulus = (each is not None for each in self)
        wrong = {
            "--scene excludes --radius, --approach, --load and --modulus.": scene,
            "--approach, --load and --modulus need --radius.": not radius,
            "--radius needs exactly one of --approach and --load.": approach == load,
            "--load needs --modulus, and --modulus needs --load.": load != modulus,
        }
        if radius or approach or load or modulus:
            for said in (said for said, is_so in wrong.items() if is_so):
                raise click.UsageError(said)

    def of(
        self, surface: Surface, prune: float, fit: int
    ) -> tuple[Surface, Callable[[Asperities], Contact] | None]:
        """The surface in the scene's unit, and the function that presses its summits, or None."""
        if self.scene is not None:
            from convexrough.run.scene_file import read_scene, read_study

            unit = read_study(self.scene)[0].units.names.length
            if unit and surface.unit:
                surface = surface.to_unit(unit)
            file = read_scene(self.scene, asperities=surface.summits(prune, fit))
            on = partial(replace, file.scene)
            return surface, lambda it: replace(file, scene=on(asperities=it)).press()
        if self.radius is None:
            return surface, None
        from convexrough.contact import press
        from convexrough.scene.material import Material
        from convexrough.scene.scene import Scene

        # At a given approach only the loads depend on the modulus. Poisson's ratio is not used.
        stuff = Material(1.0 if self.modulus is None else self.modulus, 0.3)
        base = partial(Scene, self.radius, material=stuff, geometry="closest")
        pressed = partial(press, approach=self.approach, load=self.load)
        return surface, lambda it: pressed(base(asperities=it))


def _pixel(context: Any, option: Any, given: str | None) -> float | tuple[float, ...] | None:
    if given is None:
        return None
    try:
        sides = tuple(float(each) for each in given.split(","))
    except ValueError as error:
        expected = "a number, or two with a comma"
        raise InputError("--pixel", found=repr(given), expected=expected) from error
    return sides[0] if len(sides) == 1 else sides


@click.command()
@click.argument("surface", type=common.PATH)
@common.option("--scene SCENE", "Press as in this scene file.", common.PATH)
@common.option("--radius R", "Radius of the sphere, in the unit of the map; not with --scene.",
               float)  # fmt: skip
@common.option("--approach D", "Prescribed approach, in the unit of the map.", float)
@common.option("--load P", "Prescribed load; needs --modulus.", float)
@common.option("--modulus E", "Contact modulus E*, in the unit of load per unit of the map "
               "squared.", float)  # fmt: skip
@common.option("--pixel X[,Y]", "Size of a pixel in --unit, if the file states none.",
               callback=_pixel)  # fmt: skip
@common.option("--unit UNIT", "Unit of pixel and heights: µm, mm, ...")
@common.option("--height-unit UNIT", "Unit of the heights, if not --unit.")
@common.option("--detrend", "Form to remove before finding summits.",
               click.Choice(("plane", "sphere", "paraboloid", "none")), default="plane",
               show_default=True)  # fmt: skip
@common.option("--fill", "Fill holes in the map and report them.")
@common.option("--fit N", "Fit a paraboloid to N by N pixels about each maximum; N is odd.",
               int, default=3, show_default=True)  # fmt: skip
@common.option("--prune PART", "Merge hills whose prominence is below the fraction PART of the "
               "height range Sz.", float, default=0.05, show_default=True)  # fmt: skip
@common.option("--whole", "Also press the whole map by boundary elements.")
@common.output_options("formats", "dpi", "out", "no_figures", "force", "as_json")
def summits(
    output: common.Output,
    surface: Path,
    prune: float,
    fit: int,
    detrend: Any,
    whole: bool,
    **options: Any,
) -> int:
    """Find the summits of a measured surface.

    SURFACE is a .npy, .npz or .mat file, an instrument's file, or a text or .xlsx file with a
    matrix of heights or with columns x, y and height. The command can also press a sphere on the
    middle of the map: give --scene; or --radius and --approach; or --radius, --load and --modulus.
    It then reports contacts, certificate and model error for several values of --prune, and from
    which value on the assumptions of the asperity model are met. With --whole it compares them with
    the contact of the whole map at the same approach, with one boundary element per pixel. Results
    of a.npz go to the folder a-summits unless --out names another.

    The exit status is 3 if the contact at the given --prune is not certified.
    """
    from convexrough.run.results import versions
    from convexrough.run.scene_file import digest
    from convexrough.surface import read, report

    how = Pressing(**{name: options.pop(name) for name in Pressing._fields})
    how.check()
    if whole and how.scene is None and how.radius is None:
        raise click.UsageError("--whole needs --scene or --radius.")
    folder = output.out or Path(f"{surface.stem}-summits")
    if folder.suffix.lower() in (".csv", ".npz"):
        raise FileError(f"{folder}: expected the name of a folder, not of a table")
    reads = [surface, *([how.scene] if how.scene else [])]
    inputs = {str(each): digest(each) for each in reads}
    with output.folder(folder, reads=reads, inputs=inputs, versions=versions()) as new:
        with common.progress(f"reading {surface}"):
            scan = read(surface, detrend=None if detrend == "none" else detrend, **options)
            with blamed_on(surface):
                scan, press = how.of(scan, prune, fit)
                scanned = report.Scanned.of(scan, prune, fit, press, whole=whole)
        summary = report.surface_summary(scanned)
        with common.progress("writing"):
            new.tables({"summits": report.summit_columns(scanned.summits)})
            if scanned.curve is not None:
                new.tables({"provability": scanned.curve.columns()})
            new.summary("summary.json", summary)
            if not output.no_figures:
                from convexrough.plots.surface import surface_figures  # imports matplotlib

                contact = scanned.contact
                new.figures(
                    surface_figures(scan, scanned.maxima, scanned.summits, scanned.curve, contact)
                )
    lines = [*report.describe_surface(scanned), *common.written(new)]
    output.say(summary, lines, report.warnings_about(scanned))
    if scanned.curve is None:
        common.say_aside(
            "hint", "use --scene or --radius to press on the summits and choose --prune"
        )
    return common.DONE if scanned.certified else common.NOT_CERTIFIED
