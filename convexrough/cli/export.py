"""`export`: optimisation problems of a scene for other solvers."""

from __future__ import annotations

from pathlib import Path

import click

from convexrough.cli.output import DONE, PATH, Output, output_options, progress, written
from convexrough.errors import blamed_on


@click.command()
@click.argument("scene", type=PATH)
@click.option("--format", "formats", type=click.Choice(["cbf", "json", "mps", "npz"]),
              multiple=True, help="Write only this format; may be repeated.")  # fmt: skip
@click.option("--bristles", metavar="M", type=click.IntRange(1), default=64, show_default=True,
              help="Bristles per asperity in the quadratic program (HiGHS is slow above 16).",
              )  # fmt: skip
@output_options("out", "force", "as_json")
def export(output: Output, scene: Path, formats: tuple[str, ...], bristles: int) -> int:
    """Write a scene as cone and quadratic programs for other solvers.

    The formats cbf, json (Clarabel) and npz contain the cone program, which is equivalent to the
    contact law, and its dual, which bounds the energy from below. The format mps and a second npz
    (qpsolvers) contain the quadratic program of bristles (springs that together follow Hertz's
    law). index.json gives the minimum of each program, and how to convert a solution to loads.

    Programs go to the folder SCENE-programs unless --out names another.
    """
    from convexrough.programs.folder import FORMATS, write_programs
    from convexrough.run.scene_file import read_scene

    file = read_scene(scene)
    stating = progress(f"stating {len(file.scene):,} asperities")
    folder = output.folder(Path(f"{scene.stem}-programs"), reads=file.inputs)
    with folder as new, blamed_on(scene), stating:
        new.files, index = write_programs(
            new.path,
            scene.stem,
            file.scene,
            approach=file.approach,
            load=file.load,
            formats=formats or tuple(FORMATS),
            bristles=bristles,
        )
    lines = [
        f"{name}: {about['form']}, {about['variables']:,} variables, least objective "
        f"{about['objective']:.12g}"
        for name, about in index["programs"].items()
    ]
    left_out = (f"{name}: left out: {reason}" for name, reason in index["left_out"].items())
    output.say(index, [*lines, *written(new)], left_out)
    return DONE
