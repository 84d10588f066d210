"""The smoothing of non-orthogonal warps that suits a view, as a number."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from .camera import Camera
from .frame import frame_parts
from .light import Light
from .methods import Method, NonOrthogonalWarp, method_from
from .scene import Scene


def automatic_smoothing(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method = "notw@published",
    *,
    device: str | None = None,
    **parameters: Any,
) -> float:
    """What ``smoothing="automatic"`` of a `NonOrthogonalWarp` stands for in a view.

    The papers set it by hand for each scene, and leave open how to find it (J. Navrátil's thesis,
    5.4.1): with little smoothing, straight edges between warped corners miss their places; with
    much, the texels are not where the receivers are. Of a few values, from a 64th of the cells to
    a quarter of them, the one is taken that makes the estimate least of how many pixels are wrong,

    .. math:: \\sum_r \\sqrt{c_r} \\, (1 + m_r) \\, / \\sqrt{X'_r Y'_r}

    over some receivers in all layers: how wide a texel is for them, in pixels, where ``c`` of them
    share a cell and the functions have the slopes ``X'`` and ``Y'``; and how many texels from its
    place the middle is taken of a straight line as long as a cell, ``m``, the more so of one along
    the rows and one along the columns.

    Parameters
    ----------
    scene, camera, light, device
        As for `render_shadows`.
    method : str or NonOrthogonalWarp
        Whose other parameters are taken; with ``rasterization="linear"``.
    **parameters
        Parameters of the method that is named.

    Returns
    -------
    float
        In cells, for the parameter `smoothing`.

    Raises
    ------
    ValueError
        A method with exact rasterization, which needs no smoothing.
    TypeError
        A method of another kind.

    Examples
    --------
    >>> from lixel import scenes
    >>> scene = scenes.plane_and_box()
    >>> camera, light = scene.cameras["default"].resized(64, 36), scene.lights["default"]
    >>> automatic_smoothing(scene, camera, light, resolution=64)
    8.0
    """
    chosen = method_from(method, **parameters)
    if not isinstance(chosen, NonOrthogonalWarp):
        raise TypeError(f"method must be a lixel.NonOrthogonalWarp, got {chosen.spelling}")
    automatic = replace(chosen, smoothing="automatic")
    found = frame_parts(scene, camera, light, automatic, device=device)
    return float(found.stats["smoothing"])
