"""How wide arrays are by default, and results on disk."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scene_files import HEXAGONAL

import convexrough as cr
from convexrough.atomic import replacing
from convexrough.run.results import MANIFEST, results_folder


@pytest.mark.sample(2)
@pytest.mark.parametrize("geometry", ["summit", "closest"])
@pytest.mark.parametrize("pattern", ["hexagonal", "square"])
@pytest.mark.parametrize("normal", ["approach = 2e-5", "load = 2e-7", "load = 1e-9"])
@pytest.mark.parametrize("rough", ["", "height_std = 4e-6\ntip_radius_cv = 0.3\nseed = 5"])
def test_the_default_within_loses_no_asperity(
    read: Any, geometry: str, pattern: str, normal: str, rough: str
) -> None:
    text = HEXAGONAL.replace("hexagonal", pattern).replace("summit", geometry) + f"{rough}\n"
    file = read(text, normal)
    generous = read(text + "within = 0.05", normal)
    n = len(file.scene)
    assert n < len(generous.scene) / 4
    same = cr.press(file.scene, approach=file.approach, load=file.load)
    far = cr.press(generous.scene, approach=file.approach, load=file.load)
    assert same.certificate.holds
    assert far.certificate.holds
    assert np.allclose(far.loads[:n], same.loads, rtol=1e-12, atol=0)
    assert not far.loads[n:].any()


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    path = tmp_path / "result.csv"
    path.write_text("old")

    def write(error: Exception | None) -> None:
        with replacing(path) as temporary:
            temporary.write_text("new")
            if error:
                raise error

    with pytest.raises(RuntimeError):
        write(RuntimeError())
    with pytest.raises(cr.FileError, match=r"result\.csv: cannot be written: No space left"):
        write(OSError(28, "No space left on device"))
    assert path.read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["result.csv"]
    write(None)
    assert path.read_text() == "new"
    assert [each.name for each in tmp_path.iterdir()] == ["result.csv"]


def test_a_folder_comes_whole_or_not_at_all(tmp_path: Path) -> None:
    folder = tmp_path / "a" / "b"

    def write(error: BaseException | None, text: str, *, force: bool = False) -> None:
        with results_folder(folder, force=force) as new:
            new.text("one.csv", text)
            assert not folder.exists() or (folder / "one.csv").read_text() == "1"
            if error is not None:
                raise error

    with pytest.raises(cr.FileError, match="b: cannot hold results: No space"):
        write(OSError(28, "No space left on device"), "half")
    assert not list(tmp_path.iterdir())  # the parent folder is removed, too
    write(None, "1")
    assert json.loads((folder / MANIFEST).read_text())["files"] == ["one.csv"]
    with pytest.raises(KeyboardInterrupt):
        write(KeyboardInterrupt(), "2", force=True)
    assert sorted(each.name for each in folder.iterdir()) == [MANIFEST, "one.csv"]
    assert (folder / "one.csv").read_text() == "1"
