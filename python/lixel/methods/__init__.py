"""The shadow methods: a name, or an object that holds a method's parameters.

The set is closed. It is listed once, in the core (`lixel._core.methods()`), with each parameter's
default and rule; the classes here give it types and documentation, and tests hold them to it.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TypeAlias, cast, get_args

from .auto import Auto
from .base import BoxMethod, Pcf, ShadowMapMethod, ShadowMethod
from .light_matrices import (
    Focused,
    LightMatrixMethod,
    LightSpacePerspective,
    PerspectiveShadowMap,
    PlaneOptimal,
    SceneOptimized,
)
from .maps import Cascades, DesiredView, MinimalShadowMap, Uniform
from .omnidirectional import Cube, DualParaboloid, ImprovedParaboloid, Spot
from .warps import Fit, NonOrthogonalWarp, RectilinearWarp, WarpMethod
from .without_maps import Exact, RayTraced, ShadowVolumes

__all__ = [
    "MAP_METHODS",
    "METHODS",
    "OMNIDIRECTIONAL_METHODS",
    "WARPS",
    "Auto",
    "BoxMethod",
    "Cascades",
    "Cube",
    "DesiredView",
    "DualParaboloid",
    "Exact",
    "Fit",
    "Focused",
    "ImprovedParaboloid",
    "LightMatrixMethod",
    "LightSpacePerspective",
    "MapMethod",
    "Method",
    "MinimalShadowMap",
    "NonOrthogonalWarp",
    "OmnidirectionalMethod",
    "Pcf",
    "PerspectiveShadowMap",
    "PlaneOptimal",
    "RayTraced",
    "RectilinearWarp",
    "SceneOptimized",
    "ShadowMapMethod",
    "ShadowMethod",
    "ShadowVolumes",
    "Spot",
    "Uniform",
    "WarpMethod",
    "method_from",
]

MapMethod: TypeAlias = (
    Uniform
    | DesiredView
    | MinimalShadowMap
    | Focused
    | LightSpacePerspective
    | PerspectiveShadowMap
    | PlaneOptimal
    | SceneOptimized
    | Cascades
    | RectilinearWarp
    | NonOrthogonalWarp
    | ImprovedParaboloid
)
OmnidirectionalMethod: TypeAlias = Cube | DualParaboloid | Spot
Method: TypeAlias = MapMethod | OmnidirectionalMethod | RayTraced | Exact | ShadowVolumes | Auto

METHODS: Mapping[str, type[Method]] = MappingProxyType(
    {method.name: method for method in get_args(Method) if method is not Auto}
)
"""Every method by name, but `Auto`, which chooses one of them."""

MAP_METHODS: Mapping[str, type[MapMethod]] = MappingProxyType(
    {method.name: method for method in get_args(MapMethod)}
)
"""Those that look up a shadow map of any light, by name."""

OMNIDIRECTIONAL_METHODS: Mapping[str, type[OmnidirectionalMethod]] = MappingProxyType(
    {method.name: method for method in get_args(OmnidirectionalMethod)}
)
"""Those that look up a shadow map of a light with a position, by name."""

WARPS: Mapping[str, type[RectilinearWarp | NonOrthogonalWarp]] = MappingProxyType(
    {method.name: method for method in (RectilinearWarp, NonOrthogonalWarp)}
)
"""Those that warp a fitted map."""


def method_from(method: str | Method) -> Method:
    """The method of a name, with its default parameters; a method object as it is.

    Parameters
    ----------
    method : str or method object
        A name, ``"auto"``, or a composition of names joined by ``+``: ``"min_sm+notw"`` is
        ``NonOrthogonalWarp(fit="min_sm")``.

    Raises
    ------
    ValueError
        An unknown name or composition; the message lists the known ones.
    TypeError
        Neither a name nor a method object.
    """
    if isinstance(method, Method):
        return method
    known = ", ".join(repr(name) for name in (*METHODS, Auto.name))
    if isinstance(method, type) and issubclass(method, ShadowMethod):
        raise TypeError(f"method must be an object, {method.__name__}(), got the class itself")
    if not isinstance(method, str):
        raise TypeError(
            f"method must be a name ({known}) or a method object, got {type(method).__name__}"
        )
    if method == Auto.name:
        return Auto()
    if method in METHODS:
        return METHODS[method]()
    parts = [part.strip() for part in method.split("+")]
    if len(parts) == 2 and parts[0] in get_args(Fit) and parts[1] in WARPS:
        return WARPS[parts[1]](fit=cast(Fit, parts[0]))
    unknown = [part for part in parts if part not in (*METHODS, *get_args(Fit))]
    if len(parts) > 1 and not unknown:
        raise ValueError(f"method {method!r} joins what cannot be joined; known: {known}")
    raise ValueError(
        f"method must be one of {known}, got {method!r}"
        + (f", where {unknown[0]!r} is unknown" if len(parts) > 1 else "")
    )
