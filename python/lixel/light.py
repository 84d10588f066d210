"""The lights. They look along their own -Z, as glTF's do."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import finite, instance, real, reals, unit_vector

CoreLight: TypeAlias = _core.Light


class _Light:
    """What the lights share: immutable values, compared by their fields.

    `intensity` and `range` do not change a shadow. They are kept for whoever shades the picture,
    and for `reaches`.
    """

    _fields: tuple[str, ...]
    _core: CoreLight
    intensity: float = 1.0
    range: float = math.inf

    def _set(self, compiled: CoreLight, **fields: npt.NDArray[np.float64] | float) -> None:
        fields |= _strength(
            fields.get("intensity", self.intensity), fields.get("range", self.range)
        )
        for name, value in fields.items():
            if isinstance(value, np.ndarray):
                value += 0.0  # turns -0.0, which reads badly, into 0.0
                value.flags.writeable = False
            object.__setattr__(self, name, value)
        object.__setattr__(self, "_core", compiled)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError(f"a {type(self).__name__} is immutable: cannot set {name}")

    def __delattr__(self, name: str) -> None:
        raise AttributeError(f"a {type(self).__name__} is immutable: cannot delete {name}")

    def _values(self) -> tuple[Any, ...]:
        values = (getattr(self, name) for name in self._fields)
        return tuple(tuple(v.tolist()) if isinstance(v, np.ndarray) else v for v in values)

    def _options(self) -> dict[str, float]:
        """What differs from its default."""
        values = {"intensity": self.intensity, "range": self.range}
        return {name: v for name, v in values.items() if v != getattr(_Light, name)}

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return (self._values(), self._options()) == (other._values(), other._options())

    def __hash__(self) -> int:
        return hash((type(self), *self._values(), *self._options().items()))

    def __repr__(self) -> str:
        words = [repr(value) for value in self._values()]
        words += [f"{name}={value!r}" for name, value in self._options().items()]
        return f"{type(self).__name__}({', '.join(words)})"

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (type(self), self._values(), self._options())

    def reaches(self, positions: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
        """Which points in world space, (..., 3), the light would reach in an empty world."""
        return np.ones(positions.shape[:-1], dtype=bool)


def _rebuilt(kind: type[_Light], values: tuple[Any, ...], options: dict[str, float]) -> _Light:
    return kind(*values, **options)


def _strength(intensity: Any, reach: Any) -> dict[str, float]:
    intensity, reach = real("intensity", intensity), real("range", reach)
    if not 0.0 <= intensity < math.inf:
        raise ValueError(f"intensity must be at least 0 and finite, got {intensity}")
    if not reach > 0.0:
        raise ValueError(f"range must be above 0, got {reach}")
    return {"intensity": intensity, "range": reach}


class _LightWithPosition(_Light):
    position: npt.NDArray[np.float64]

    def vectors_from(self, positions: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
        """Vectors from points in world space to the light, (..., 3) each."""
        return self.position - positions

    def reaches(self, positions: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
        """Which points in world space, (..., 3), the light would reach in an empty world: those
        within its `range`, and within its cone."""
        vectors = positions - self.position
        near = np.linalg.norm(vectors, axis=-1) <= self.range
        return np.asarray(near & self._looks_along(vectors))

    def _looks_along(self, vectors: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
        return np.ones(vectors.shape[:-1], dtype=bool)


def _position(position: npt.ArrayLike) -> npt.NDArray[np.float64]:
    return np.array(finite("position", position, 3))


class DirectionalLight(_Light):
    """Parallel rays, as from the sun; immutable.

    Parameters
    ----------
    direction : (3,) float
        From the light towards the scene, in world space, any length but zero.
    intensity : float
        In lux, as glTF has it; kept for whoever shades the picture.

    Attributes
    ----------
    direction : (3,) float64
        The unit vector, read-only.

    Raises
    ------
    TypeError, ValueError
        A direction that does not hold three finite real numbers, or of zero length.

    Examples
    --------
    >>> DirectionalLight((0, -2, 0))
    DirectionalLight((0.0, -1.0, 0.0))
    """

    _fields = ("direction",)
    direction: npt.NDArray[np.float64]

    def __init__(self, direction: npt.ArrayLike, *, intensity: float = 1.0) -> None:
        unit = unit_vector("direction", direction)
        self._set(_core.Light.directional(unit), direction=unit, intensity=intensity)

    @classmethod
    def from_pose(cls, pose: npt.ArrayLike) -> DirectionalLight:
        """A light that looks along the -Z of a pose, as a directional light of a
        ``KHR_lights_punctual`` node does.

        Parameters
        ----------
        pose : (4, 4) float
            Light-to-world; scale and translation do not matter.
        """
        return cls(-reals("pose", pose, 4, 4)[:3, 2])

    def vectors_from(self, positions: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
        """Vectors from points in world space towards the light, (..., 3) each."""
        return np.broadcast_to(-self.direction, positions.shape)


class PointLight(_LightWithPosition):
    """Rays from a point to all sides; immutable.

    It may be any distance away: maps of a light that is more than four sizes of the scene away from
    it are fitted as those of a directional light, to rays that converge a little.

    Parameters
    ----------
    position : (3,) float
        In world space.
    intensity : float
        In candela, as glTF has it; kept for whoever shades the picture.
    range : float
        How far the light reaches, in world units. Shadows do not end there; `reaches` and
        `Frame.visibility_in_range` do.

    Attributes
    ----------
    position : (3,) float64
        Read-only.

    Raises
    ------
    TypeError, ValueError
        A position that does not hold three finite real numbers.

    Examples
    --------
    >>> PointLight((0, 2, 0))
    PointLight((0.0, 2.0, 0.0))
    """

    _fields = ("position",)

    def __init__(
        self,
        position: npt.ArrayLike,
        *,
        intensity: float = 1.0,
        range: float = math.inf,  # noqa: A002, as glTF has it
    ) -> None:
        point = _position(position)
        self._set(_core.Light.point(point), position=point, intensity=intensity, range=range)

    @classmethod
    def from_pose(cls, pose: npt.ArrayLike) -> PointLight:
        """A light at the origin of a pose, (4, 4) light-to-world."""
        return cls(reals("pose", pose, 4, 4)[:3, 3])


class SpotLight(_LightWithPosition):
    """Rays from a point within a cone, as glTF's spot lights; immutable.

    Parameters
    ----------
    position : (3,) float
        In world space.
    direction : (3,) float
        Of the cone's axis, away from the light, any length but zero.
    outer : float
        Angle between the axis and the edge of the cone, in radians, above 0 and at most pi / 2.
        What lies outside is not lit.
    inner : float
        Angle at which the light begins to fade towards the edge, at least 0 and below `outer`. Hard
        shadows do not ask for it; it is kept for whoever shades the picture.
    intensity, range : float
        As for `PointLight`.

    Attributes
    ----------
    position, direction : (3,) float64
        Read-only; the direction has length 1.
    outer, inner : float

    Raises
    ------
    TypeError, ValueError
        Values of another kind or out of range; the message names the argument.

    Examples
    --------
    >>> SpotLight((0, 2, 0), (0, -1, 0), outer=0.5).inner
    0.0
    """

    _fields = ("position", "direction", "outer", "inner")
    direction: npt.NDArray[np.float64]
    outer: float
    inner: float

    def __init__(
        self,
        position: npt.ArrayLike,
        direction: npt.ArrayLike,
        outer: float = math.pi / 4,
        inner: float = 0.0,
        *,
        intensity: float = 1.0,
        range: float = math.inf,  # noqa: A002, as glTF has it
    ) -> None:
        point, unit = _position(position), unit_vector("direction", direction)
        outer, inner = real("outer", outer), real("inner", inner)
        if not 0.0 < outer <= math.pi / 2:
            raise ValueError(f"outer must be above 0 and at most pi / 2, got {outer}")
        if not 0.0 <= inner < outer:
            raise ValueError(f"inner must be at least 0 and below outer, {outer}, got {inner}")
        compiled = _core.Light.spot(point, unit, outer)
        strength = {"intensity": intensity, "range": range}
        self._set(compiled, position=point, direction=unit, outer=outer, inner=inner, **strength)

    @classmethod
    def from_pose(
        cls, pose: npt.ArrayLike, outer: float = math.pi / 4, inner: float = 0.0
    ) -> SpotLight:
        """A light at the origin of a pose, (4, 4) light-to-world, that looks along its -Z."""
        matrix = reals("pose", pose, 4, 4)
        return cls(matrix[:3, 3], -matrix[:3, 2], outer, inner)

    def _looks_along(self, vectors: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
        return _in_cone(vectors, self.direction, math.cos(self.outer))


class HemisphereLight(_LightWithPosition):
    """Rays from a point to one side of a plane through it, as a paraboloid map holds; immutable.

    Parameters
    ----------
    position : (3,) float
        In world space.
    axis : (3,) float
        The middle of the lit side, away from the light, any length but zero.

    Attributes
    ----------
    position, axis : (3,) float64
        Read-only; the axis has length 1.

    Raises
    ------
    TypeError, ValueError
        Values of another kind or out of range; the message names the argument.

    Examples
    --------
    >>> HemisphereLight((0, 2, 0), (0, -3, 0))
    HemisphereLight((0.0, 2.0, 0.0), (0.0, -1.0, 0.0))
    """

    _fields = ("position", "axis")
    axis: npt.NDArray[np.float64]

    def __init__(self, position: npt.ArrayLike, axis: npt.ArrayLike) -> None:
        point, unit = _position(position), unit_vector("axis", axis)
        self._set(_core.Light.hemisphere(point, unit), position=point, axis=unit)

    def _looks_along(self, vectors: npt.NDArray[np.floating]) -> npt.NDArray[np.bool_]:
        return _in_cone(vectors, self.axis, 0.0)


def _in_cone(
    vectors: npt.NDArray[np.floating], axis: npt.NDArray[np.float64], cosine: float
) -> npt.NDArray[np.bool_]:
    return np.asarray(vectors @ axis >= cosine * np.linalg.norm(vectors, axis=-1))


# The closed set of lights; a new one joins with `|`.
Light: TypeAlias = DirectionalLight | PointLight | SpotLight | HemisphereLight
WITH_POSITION: tuple[type[Light], ...] = (PointLight, SpotLight, HemisphereLight)
LIGHTS: tuple[type[Light], ...] = (DirectionalLight, *WITH_POSITION)


def one_or_several(light: Light | Sequence[Light]) -> tuple[list[Light], bool]:
    """The lights of an argument, and whether it is a list; TypeError where one is no light."""
    # A direction is a sequence too, and no light.
    is_list = isinstance(light, list | tuple) and (not light or isinstance(light[0], LIGHTS))
    lights = list(cast(Sequence[Light], light)) if is_list else [cast(Light, light)]
    for one in lights:
        instance("light", one, *LIGHTS)
    return lights, is_list
