"""Light matrices of one's own."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from .base import ShadowMapMethod

CURVED = frozenset({"paraboloid", "log_perspective"})
"""Kinds of maps that no matrix takes points to."""


@dataclass(frozen=True, kw_only=True)
class LightMatrix(ShadowMapMethod):
    """A map, or several, by light matrices of one's own.

    A matrix ``M`` takes a point of the world to its place in the map, from the left and from the
    top, in sides of the map:

    .. math:: (x, y, z, w) = M (p, 1), \\quad u = x / w, \\quad v = y / w

    Each ray of the light must have one place, so the rows of ``x``, ``y`` and ``w`` vanish at the
    light: its position, or its direction. ``w`` is positive before the map's horizon. Depths are
    distances along the light, whatever ``z`` is; they must only grow the same way, away from the
    light. A matrix into clip space, with ``x / w`` and ``y / w`` from -1 to 1 and ``y`` up, becomes
    one by ``np.array([[.5, 0, 0, .5], [0, -.5, 0, .5], [0, 0, 1, 0], [0, 0, 0, 1]]) @ clip``.

    It also serves as the `fit` of a warp: ``RectilinearWarp(fit=LightMatrix(matrix))``, whose
    resolution, lookup and so on are the warp's.

    Limits: what is beside all maps is lit. Texels behind the horizon are wasted.

    Parameters
    ----------
    matrix : (4, 4) or (layers, 4, 4) array
        One for each layer. `LightMatrix.of` takes those of a frame.
    regions : sequence, optional
        For each layer up to 5 planes (a, b, c, d): it is for the receivers with a x + b y + c z + d
        >= 0. Where regions overlap, either layer may answer. None: what lies in the layer's map,
        and everything where there is but one layer.

    The others are those of `ShadowMapMethod`. The comparison of two methods ignores their arrays.

    Raises
    ------
    ValueError
        An array of another shape, or numbers that are not finite. From `render`: a matrix that has
        no inverse, or none of the light's, or all of the scene behind its horizon.

    Examples
    --------
    >>> LightMatrix([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]]).matrix.shape
    (1, 4, 4)
    """

    name: ClassVar[str] = "light_matrix"

    matrix: npt.ArrayLike = field(kw_only=False, compare=False, repr=False)
    regions: Any = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.matrix is None:
            raise ValueError("matrix must be given, got None")
        super().__post_init__()

    @classmethod
    def of(cls, frame: Any, **parameters: Any) -> LightMatrix:
        """The matrices and regions of a frame.

        Parameters
        ----------
        frame : Frame
        **parameters
            The others, as of the class; the resolution is not the frame's unless it is given.

        Raises
        ------
        ValueError
            A frame of paraboloids or logarithms, which have no matrix.
        """
        kinds = [projection["kind"] for projection in frame.projections]
        if CURVED & set(kinds):
            raise ValueError(f"frame must have light matrices, got {', '.join(kinds)}")
        width, height = frame.method.map_size or (1, 1)
        matrices = frame.light_matrix / np.array([width, height, 1.0, 1.0])[:, None]
        regions = [projection["region"] for projection in frame.projections]
        return cls(matrices, **{"regions": regions, **parameters})
