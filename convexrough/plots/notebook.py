"""Figures that show themselves in a notebook, without pyplot and its global state."""

from __future__ import annotations

from base64 import b64encode
from io import BytesIO

from matplotlib.figure import Figure as MatplotlibFigure


class Figure(MatplotlibFigure):
    """A figure of matplotlib that shows itself in a notebook, without pyplot."""

    def _repr_png_(self) -> bytes:
        file = BytesIO()
        self.savefig(file, format="png", dpi=100)
        return file.getvalue()


class Figures(dict[str, MatplotlibFigure]):
    """Figures by the stem of the file each belongs in; a notebook shows them all."""

    def _repr_html_(self) -> str:
        parts = []
        for stem, figure in self.items():
            figure.savefig(file := BytesIO(), format="png", dpi=100)
            picture = b64encode(file.getvalue()).decode()
            parts.append(f'<img alt="{stem}" src="data:image/png;base64,{picture}">')
        return "<br>".join(parts)
