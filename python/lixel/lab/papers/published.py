"""The papers' methods with the papers' own parameters."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

from ...methods import Method, NonOrthogonalWarp, method_from

SUFFIX = "@published"

# A depth test with a constant bias, and triangles with straight edges between projected corners.
PLAIN: Mapping[str, Any] = {"lookup": "depth", "bias": "constant", "rasterization": "linear"}

OWN: Mapping[str, Mapping[str, Any]] = {
    # One function per row, counts as they are (Milet et al., 3.1).
    "notw": {"exponent": 1.0, "even_share": 0.0, "smoothing": 16.0},
    # Six whole faces (thesis, 3.3.1); the cut around the frustum's corners (Vanek et al., 3.2).
    "cube": {"cut": "face"},
    "improved_paraboloid": {"cut": "frustum"},
    "scene_optimized": {"samples": "boundary"},
    "focused": {"fit": "frustum"},
    "lispsm": {"fit": "frustum"},
    "plane_optimal": {"fit": "frustum"},
}


def method_of(spelling: str, **changes: Any) -> Method:
    """The method of a name such as ``"rtw"`` or ``"cube+notw@published"``, with some changes."""
    name, is_published, _ = spelling.partition(SUFFIX)
    method = method_from(name)
    if is_published and hasattr(method, "resolution"):
        own = {**PLAIN, **OWN.get(method.name, {}), **changes}
        if isinstance(method, NonOrthogonalWarp):
            # The importance map has the resolution of the shadow map.
            own.setdefault("importance_resolution", own.get("resolution", method.resolution))
            own.setdefault("function_count", own["importance_resolution"])
        return dataclasses.replace(method, **own)
    return dataclasses.replace(method, **changes)
