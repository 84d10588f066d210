"""Shadow methods of one's own: a function in Python that says where the light's rays go."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import field, fields, make_dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias, get_args, overload

import numpy as np

from .. import _core
from ..light import LIGHTS, Light
from .auto import Auto
from .base import ShadowMapMethod
from .given import LightMatrix
from .warps import Fit, GivenWarp, RectilinearWarp

if TYPE_CHECKING:
    from ..receivers import SeenSurface
    from ..scene import Scene

Function: TypeAlias = Callable[..., Any]

_OWN: dict[str, type[OwnMethod]] = {}

OWN_METHODS: Mapping[str, type[OwnMethod]] = MappingProxyType(_OWN)
"""Every method that `shadow_method` made, by name."""

_TAKEN = frozenset(
    {
        *(entry["name"] for entry in _core.methods()),
        *get_args(Fit),
        *(method.name for method in (Auto, LightMatrix, GivenWarp)),
    }
)

_MAP_PARAMETERS = {known.name: known.default for known in fields(ShadowMapMethod)}


class OwnMethod(ShadowMapMethod):
    """The base class of the methods that `shadow_method` makes of functions.

    The parameters are those of `ShadowMapMethod`, and the function's own.
    """

    function: ClassVar[Function]

    def __post_init__(self) -> None:
        plain = LightMatrix(np.eye(4), **{name: getattr(self, name) for name in _MAP_PARAMETERS})
        for name in _MAP_PARAMETERS:
            object.__setattr__(self, name, getattr(plain, name))

    def made(self, receivers: SeenSurface, light: Light, scene: Scene) -> ShadowMapMethod:
        """What the function answers, with the map's parameters of this method."""
        keywords = _keywords(self.function)
        found = self.function(receivers, light, scene, **{n: getattr(self, n) for n in keywords})
        maps = {name: getattr(self, name) for name in _MAP_PARAMETERS}
        if isinstance(found, OwnMethod):
            raise TypeError(f"{self.name} must not return another method of one's own, {found}")
        if not isinstance(found, ShadowMapMethod):
            shape = np.shape(found)
            if shape != receivers.triangle_id.shape:
                raise TypeError(
                    f"{self.name} must return a lixel.LightMatrix, a lixel.GivenWarp, another "
                    "method with a map, or an array of importance with the shape of the image, "
                    f"{receivers.triangle_id.shape}, got {type(found).__name__}"
                    + (f" of shape {shape}" if shape else "")
                )
            return RectilinearWarp(importance="desired_view", pixel_weights=found, **maps)
        changes = {name: own for name, own in maps.items() if getattr(found, name) != own}
        for name, own in changes.items():
            given = getattr(found, name)
            if given != _MAP_PARAMETERS[name]:
                raise ValueError(
                    f"{name} must be a parameter of the method {self.name!r} itself, as in "
                    f"def {self.name}(receivers, light, scene, *, {name}={given!r}); "
                    f"it is {own!r}, and its answer has {given!r}"
                )
        return replace(found, **changes) if changes else found


def _keywords(function: Function) -> dict[str, Any]:
    """A function's parameters after the three that it is called with, and their defaults."""
    every = list(inspect.signature(function).parameters.values())
    rest = every[3:]
    is_called = all(p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD) for p in every[:3])
    is_named = all(p.kind is p.KEYWORD_ONLY and p.default is not p.empty for p in rest)
    if len(every) < 3 or not is_called or not is_named:
        raise TypeError(
            "a shadow method must be a function (receivers, light, scene, *, name=default, ...), "
            f"got {function.__qualname__}{inspect.signature(function)}"
        )
    return {parameter.name: parameter.default for parameter in rest}


@overload
def shadow_method(function: Function, /) -> Callable[..., OwnMethod]: ...


@overload
def shadow_method(
    *, name: str | None = None, lights: tuple[type[Light], ...] = LIGHTS
) -> Callable[[Function], Callable[..., OwnMethod]]: ...


def shadow_method(
    function: Function | None = None,
    /,
    *,
    name: str | None = None,
    lights: tuple[type[Light], ...] = LIGHTS,
) -> Any:
    """Make a function in Python a shadow method, for use by name beside the built-in ones.

    ::

        @lx.shadow_method
        def bright(receivers, light, scene, *, power=1.0):
            return np.nan_to_num(receivers.depth) ** -power

        lx.render_shadows(scene, camera, light, "bright", power=2.0, resolution=512)
        lx.study(scene, methods=["rtw", bright(power=2.0)])

    In each frame the function is called with what the camera sees (`SeenSurface`), the light and
    the scene. It answers with one of

    - a `LightMatrix`;
    - a `GivenWarp`;
    - any other method with a map, such as ``NonOrthogonalWarp(pixel_weights=...)``;
    - an array (H, W): what each pixel is worth to a `RectilinearWarp`, whatever its distance.

    What it raises reaches the caller as it is. Its time is ``timings["python"]``, in which the
    positions that it asks for are computed.

    Parameters
    ----------
    function : callable
        ``(receivers, light, scene, *, ...)``. Parameters after the star are the method's own, and
        must have defaults. Those of the map (``resolution``, ``lookup`` and the others of
        `ShadowMapMethod`) are the method's anyway; one that is among the function's has its default
        from there, and is handed to it.
    name : str, optional
        None: the function's.
    lights : tuple of types
        The kinds of light that it is made for.

    Returns
    -------
    type
        The class of the method's objects, ``bright(power=2.0)``, in the function's place. The
        function itself is its ``function``.

    Raises
    ------
    ValueError
        A name that another method has.
    TypeError
        A function with other parameters.
    """

    def made_of(function: Function) -> type[OwnMethod]:
        return _made_of(function, name, lights)

    return made_of if function is None else made_of(function)


def _made_of(
    function: Function, name: str | None, lights: tuple[type[Light], ...]
) -> type[OwnMethod]:
    if not callable(function) or isinstance(function, type):
        raise TypeError(f"a shadow method must be a function, got {function!r}")
    name = function.__name__ if name is None else name
    if not isinstance(name, str) or not name.isidentifier():
        raise ValueError(f"name must be an identifier, got {name!r}")
    other = _OWN.get(name)
    # A cell of a notebook may run again.
    place = (function.__module__, function.__qualname__)
    if name in _TAKEN or (other is not None and (other.__module__, other.__qualname__) != place):
        raise ValueError(f"name must not be another method's, got {name!r}")
    # As the function has it, a list or an array, too.
    own = [
        (keyword, Any, field(default_factory=partial(_itself, value)))
        for keyword, value in _keywords(function).items()
    ]
    about = {
        "name": name,
        "lights": lights,
        "function": staticmethod(function),
        "__doc__": function.__doc__,
        "__module__": function.__module__,
        "__qualname__": function.__qualname__,
    }
    made = make_dataclass(
        function.__name__, own, bases=(OwnMethod,), namespace=about, frozen=True, kw_only=True
    )
    _OWN[name] = made
    return made


def _itself(value: Any) -> Any:
    return value
