"""The shape of tips: paraboloids fitted to the pixels about maxima."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from convexrough.arrays import Array, Indices


class Tips(NamedTuple):
    """Paraboloids fitted about maxima. Only entries with `whole` True have a meaning.

    offsets    : (n, 2) [length] x and y of the top, relative to the pixel of the maximum
    heights    : (n,) [length] heights of the tops
    curvatures : (n, 2) [1/length] principal curvatures, the larger first
    deviations : (n,) [length] root-mean-square distance of the pixels from the sphere of the tip
    whole      : (n,) True if the paraboloid curves downwards in every direction and its top is
        within the fitted pixels
    """

    offsets: Array
    heights: Array
    curvatures: Array
    deviations: Array
    whole: NDArray[np.bool_]


def fit_tips(heights: Array, pixels: Indices, pixel: tuple[float, float], across: int) -> Tips:
    """Least-squares paraboloids over `across` by `across` pixels about each maximum.

    pixels : (n, 2) row and column of the maxima, at least across // 2 from the edges of the map
    pixel  : [length] sizes along x and y
    """
    reach = across // 2
    down, right = (each.ravel() for each in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    u, v = right.astype(np.float64), down.astype(np.float64)  # in pixels, so that all are about 1
    terms = np.column_stack((np.ones(len(u)), u, v, u * u / 2, u * v, v * v / 2))
    around = heights[pixels[:, :1] + down, pixels[:, 1:] + right]
    z0, gu, gv, huu, huv, hvv = np.linalg.pinv(terms) @ around.T
    determinant = huu * hvv - huv**2
    whole = (determinant > 0) & (huu < 0)
    solid = np.where(whole, determinant, 1.0)
    top = np.stack(((huv * gv - hvv * gu) / solid, (huv * gu - huu * gv) / solid))
    whole &= (np.abs(top) <= reach).all(axis=0)

    dx, dy = pixel
    hxx, hxy, hyy = huu / dx**2, huv / (dx * dy), hvv / dy**2
    middle, half = -(hxx + hyy) / 2, np.hypot((hxx - hyy) / 2, hxy)
    product = np.where(whole, determinant, 1.0) / (dx * dy) ** 2
    larger = np.where(whole, middle + half, 1.0)
    curvatures = np.stack((larger, product / larger), axis=1)  # avoids cancellation
    summits = z0 + (gu * top[0] + gv * top[1]) / 2
    x, y = (right - top[0][:, None]) * dx, (down - top[1][:, None]) * dy
    sphere = summits[:, None] - np.sqrt(product)[:, None] * (x * x + y * y) / 2
    deviations = np.sqrt(np.mean((around - sphere) ** 2, axis=1))
    return Tips(
        np.stack((top[0] * dx, top[1] * dy), axis=1), summits, curvatures, deviations, whole
    )
