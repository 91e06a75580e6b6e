"""What mutated files brought to light: each was a traceback, a hang, or a page of messages."""

from pathlib import Path
from typing import Any

import pytest
from scene_files import scene_text

import convexrough as cr
from convexrough.run import scene_file


def refused(folder: Path, text: str) -> str:
    path = folder / "a.toml"
    path.write_bytes(text.encode())
    with pytest.raises(cr.ConvexroughError) as caught:
        cr.read_scene(path)
    return str(caught.value)


@pytest.mark.parametrize("text", ["{key} = 1", "[{key}]\na = 1", "a = {{ {key} = 1 }}"])
def test_a_key_of_many_parts(tmp_path: Path, text: str) -> None:
    """tomllib takes the square of their number, in time and memory."""
    said = refused(tmp_path, scene_text() + text.format(key="a." * 100_000 + "b"))
    assert "a key of more than 100 parts" in said
    assert ": line 1" in said


def test_a_scene_file_of_many_megabytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(scene_file, "MOST_BYTES", 2**20)
    assert refused(tmp_path, scene_text() + "#" * 2**20).endswith("a.toml: more than 1 MiB")


def test_a_thousand_mistakes_are_counted(tmp_path: Path) -> None:
    said = refused(tmp_path, scene_text() + "".join(f"[t{i}]\na = 1\n" for i in range(1000)))
    assert len(said.splitlines()) == 51
    assert said.endswith("and 950 more mistakes")


STEADY = "[friction]\ncoefficient = 0.5\n[steady]\nreference = 1e60\n"
STEADY += "ellipse = {load = 1.0, force_amplitude = 0.1, chords = 6}\n"
SHAKEDOWN = '[friction]\ncoefficient = 0.5\n[shakedown]\nloads = 1e-8\nkind = "elastic"\n'


def test_a_steady_state_of_which_nothing_is_proved(tmp_path: Path, command: Any) -> None:
    """Nothing times an infinite error is nothing: a warning of numpy's, and no number, was it."""
    layout = 'pattern = "hexagonal"\nspacing = 0.0025\ntip_radius = 0.02\nwithin = 0.006'
    (tmp_path / "a.toml").write_text(scene_text(layout, more=STEADY))
    outcome = command("run", "a.toml", "--no-figures")
    assert outcome.status == 3
    assert "nan" not in outcome.out


@pytest.mark.parametrize("kind", ["elastic", "exact"])
def test_a_shakedown_of_no_amplitudes(tmp_path: Path, command: Any, kind: str) -> None:
    text = SHAKEDOWN.replace("elastic", kind) + "force_amplitudes = []\n"
    (tmp_path / "a.toml").write_text(scene_text(more=text))
    outcome = command("run", "a.toml", "--no-figures")
    assert outcome.status == 2
    assert "force_amplitudes: found none, expected a path that moves" in outcome.err
