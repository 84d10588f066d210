"""The shadow methods: a name, or an object that holds a method's parameters.

The built-in ones are listed once, in the core (`lixel._core.methods()`), with each parameter's
default and rule; the classes here give them types and documentation, and tests hold them to it.
`LightMatrix`, `GivenWarp` and `shadow_method` take what a user has in their place.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import Any, TypeAlias, cast, get_args

from ..arguments import did_you_mean
from .auto import Auto as Auto
from .base import (
    BoxMethod as BoxMethod,
    Resolution as Resolution,
    RotatedMethod as RotatedMethod,
    ShadowMapMethod as ShadowMapMethod,
    ShadowMethod as ShadowMethod,
    resolution_text as resolution_text,
)
from .checked import Checked as Checked
from .filters import (
    ExponentialVariance as ExponentialVariance,
    Filter as Filter,
    FilteredMap as FilteredMap,
    Moments as Moments,
    Pcf as Pcf,
    Variance as Variance,
)
from .given import LightMatrix as LightMatrix
from .light_matrices import (
    Focused as Focused,
    LightMatrixMethod as LightMatrixMethod,
    LightSpacePerspective as LightSpacePerspective,
    LogPerspective as LogPerspective,
    PerspectiveShadowMap as PerspectiveShadowMap,
    PlaneOptimal as PlaneOptimal,
    SceneOptimized as SceneOptimized,
    Trapezoidal as Trapezoidal,
)
from .maps import (
    Cascades as Cascades,
    DesiredView as DesiredView,
    MinimalShadowMap as MinimalShadowMap,
    Uniform as Uniform,
)
from .omnidirectional import (
    Cube as Cube,
    DualParaboloid as DualParaboloid,
    ImprovedParaboloid as ImprovedParaboloid,
    Spot as Spot,
)
from .own import (
    OWN_METHODS as OWN_METHODS,
    OwnMethod as OwnMethod,
    shadow_method as shadow_method,
)
from .pages import PagesOver as PagesOver, VirtualShadowMap as VirtualShadowMap
from .published import (
    PAPERS as PAPERS,
    PUBLISHED as PUBLISHED,
    PublishedValue as PublishedValue,
    published_values as published_values,
)
from .warps import (
    Fit as Fit,
    FittedWarp as FittedWarp,
    GivenWarp as GivenWarp,
    NonOrthogonalWarp as NonOrthogonalWarp,
    RectilinearWarp as RectilinearWarp,
    WarpMethod as WarpMethod,
)
from .without_maps import Exact as Exact, RayTraced as RayTraced, ShadowVolumes as ShadowVolumes

MapMethod: TypeAlias = (
    Uniform
    | DesiredView
    | MinimalShadowMap
    | Focused
    | LightSpacePerspective
    | LogPerspective
    | Trapezoidal
    | PerspectiveShadowMap
    | PlaneOptimal
    | SceneOptimized
    | Cascades
    | RectilinearWarp
    | NonOrthogonalWarp
    | ImprovedParaboloid
)
OmnidirectionalMethod: TypeAlias = Cube | DualParaboloid | Spot
PagedMethod: TypeAlias = VirtualShadowMap
NamedMethod: TypeAlias = (
    MapMethod | OmnidirectionalMethod | PagedMethod | RayTraced | Exact | ShadowVolumes
)
Method: TypeAlias = NamedMethod | Auto | LightMatrix | GivenWarp | OwnMethod

METHODS: Mapping[str, type[NamedMethod]] = MappingProxyType(
    {method.name: method for method in get_args(NamedMethod)}
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

PAGED_METHODS: Mapping[str, type[PagedMethod]] = MappingProxyType(
    {method.name: method for method in (VirtualShadowMap,)}
)
"""Those that look up pages of a map of any light, by name."""

WARPS: Mapping[str, type[RectilinearWarp | NonOrthogonalWarp]] = MappingProxyType(
    {method.name: method for method in (RectilinearWarp, NonOrthogonalWarp)}
)
"""Those that warp a fitted map."""


def method_from(method: str | Method, /, **parameters: Any) -> Method:
    """The method of a name, or a method object, with parameters by their names.

    Parameters
    ----------
    method : str or method object
        A name, ``"auto"``, or a composition of names joined by ``+``: ``"min_sm+notw"`` is
        ``NonOrthogonalWarp(fit="min_sm")``. Followed by ``@published``, or by ``@`` and a key of
        `PAPERS`, it is the method as a paper has it, see `ShadowMethod.published`:
        ``"rtw@published"``, ``"rtw@milet-2015"``, ``"cube+notw@published"``.
    **parameters
        They take the place of the method's own; the others stay as they are.

    Raises
    ------
    ValueError
        An unknown name or composition; the message lists the known ones. A value out of range.
    TypeError
        Neither a name nor a method object, or a parameter that the method does not have; the
        message lists those that it has.

    Examples
    --------
    >>> method_from("cube+notw", resolution=512, lookup="triangle").lookup
    'triangle'
    """
    found = _named(method)
    return replace(found, **parameters) if parameters else found


@cache
def _default(name: str) -> Method:
    """A built-in method with its defaults: nothing changes it, so that all renders share one."""
    return METHODS[name]()


def _named(method: str | Method) -> Method:
    if isinstance(method, Method):
        return method
    if isinstance(method, str) and method in METHODS:
        return _default(method)
    known = ", ".join(repr(name) for name in (*METHODS, *OWN_METHODS, Auto.name))
    if isinstance(method, type) and issubclass(method, ShadowMethod):
        raise TypeError(f"method must be an object, {method.__name__}(), got the class itself")
    if not isinstance(method, str):
        raise TypeError(
            f"method must be a name ({known}) or a method object, got {type(method).__name__}"
        )
    if method == Auto.name:
        return Auto()
    if method in OWN_METHODS:
        return OWN_METHODS[method]()
    plain, separator, paper = (part.strip() for part in method.partition("@"))
    if separator:
        return _published(plain, paper)
    parts = [part.strip() for part in method.split("+")]
    if len(parts) == 2 and parts[0] in get_args(Fit) and parts[1] in WARPS:
        return WARPS[parts[1]](fit=cast(Fit, parts[0]))
    unknown = [part for part in parts if part not in (*METHODS, *get_args(Fit))]
    if len(parts) > 1 and not unknown:
        raise ValueError(f"method {method!r} joins what cannot be joined; known: {known}")
    where = f", where {unknown[0]!r} is unknown" if len(parts) > 1 else ""
    names = (*METHODS, *OWN_METHODS, *get_args(Fit), Auto.name)
    nearest = did_you_mean((unknown or parts)[0], names)
    raise ValueError(f"method must be one of {known}, got {method!r}{where}{nearest}")


def _published(name: str, paper: str) -> Method:
    """The method or composition of that name as a paper has it."""
    default = method_from(name)
    values = published_values("+".join(part.strip() for part in name.split("+")), paper)
    return replace(default, **{key: given.value for key, given in values.items()})
