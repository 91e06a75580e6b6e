"""Scenes that are run."""

from pathlib import Path
from typing import Any

import pytest


@pytest.fixture
def run(command: Any) -> Any:
    """Write a scene to a.toml, and run it without figures."""

    def call(text: str, *options: str) -> Any:
        Path("a.toml").write_text(text, encoding="utf-8")
        return command("run", "a.toml", "--no-figures", *options)

    return call
