"""Scenes that are run."""

from pathlib import Path
from typing import Any

import pytest
from scene_files import scene_text

import convexrough as cr


@pytest.fixture
def run(command: Any) -> Any:
    """Write a scene to a.toml, and run it without figures."""

    def call(text: str, *options: str) -> Any:
        Path("a.toml").write_text(text, encoding="utf-8")
        return command("run", "a.toml", "--no-figures", *options)

    return call


@pytest.fixture
def read(tmp_path: Path) -> Any:
    """Write a scene, given as for `scene_text`, and read it."""

    def call(*parts: str, **tables: str) -> cr.SceneFile:
        path = tmp_path / "scene.toml"
        path.write_text(scene_text(*parts, **tables), encoding="utf-8")
        return cr.read_scene(path)

    return call
