"""Formulas as MathML, made by KaTeX when the site is built; where there is no node, their TeX."""

from __future__ import annotations

import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

from docutils.nodes import SkipNode
from sphinx.application import Sphinx
from sphinxcontrib import katex

#: Seconds that node has to start.
PATIENCE = 20.0


def setup(app: Sphinx) -> None:
    if shutil.which("node") is None:
        print("node is not installed: formulas are shown as TeX", file=sys.stderr)
        app.add_html_math_renderer("tex", (_in("code"), None), (_in("pre"), None))
        app.config.html_math_renderer = "tex"  # type: ignore[attr-defined]
        return
    app.setup_extension("sphinxcontrib.katex")
    app.config.katex_prerender = True  # type: ignore[attr-defined]
    # The extension's own; its default is on a server.
    app.config.katex_css_path = "katex-math.css"  # type: ignore[attr-defined]
    # What is rendered beforehand takes no heed of its setting `katex_options`.
    katex.KATEX_DEFAULT_OPTIONS.update(output="mathml", throwOnError=True, strict="error")
    if hasattr(socket, "AF_UNIX"):
        katex.KaTeXServer.start_server_process = staticmethod(_start_node)


def _start_node(folder: Path, timeout: float) -> tuple[subprocess.Popen[bytes], socket.socket]:
    """As the extension's own, which may connect before node listens, and then fails."""
    path = folder / "katex.sock"
    command = katex.KaTeXServer.build_command(socket=path)
    node = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=folder)
    connection = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    began = time.monotonic()
    while time.monotonic() < began + PATIENCE:
        try:
            connection.connect(str(path))
        except (FileNotFoundError, ConnectionRefusedError):
            time.sleep(0.01)
        else:
            return node, connection
    node.kill()
    raise TimeoutError(f"node does not answer within {PATIENCE:g} s")


def _in(tag: str) -> Any:
    def visit(translator: Any, node: Any) -> None:
        translator.body.append(f"<{tag}>{translator.encode(node.astext())}</{tag}>")
        raise SkipNode

    return visit
