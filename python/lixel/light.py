"""The lights. They look along their own -Z, as glTF's do."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import reals, unit_vector


@dataclass(frozen=True, init=False, repr=False, eq=False)
class DirectionalLight:
    """Parallel rays, as from the sun; immutable.

    Parameters
    ----------
    direction : (3,) float
        From the light towards the scene, in world space, any length but zero.

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

    direction: npt.NDArray[np.float64]

    def __init__(self, direction: npt.ArrayLike) -> None:
        unit = unit_vector("direction", direction)
        unit += 0.0  # turns -0.0, which reads badly, into 0.0
        unit.flags.writeable = False
        object.__setattr__(self, "direction", unit)
        object.__setattr__(self, "_compiled", _core.Light.directional(unit))

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

    def _core_light(self) -> _core.Light:
        compiled: _core.Light = self.__dict__["_compiled"]
        return compiled

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, DirectionalLight):
            return NotImplemented
        return bool(np.array_equal(self.direction, other.direction))

    def __hash__(self) -> int:
        return hash((DirectionalLight, *self.direction.tolist()))

    def __repr__(self) -> str:
        return f"DirectionalLight({tuple(self.direction.tolist())})"

    def __reduce__(self) -> tuple[Any, ...]:
        return DirectionalLight, (self.direction,)


# The closed set of lights; a new one joins with `|`.
Light: TypeAlias = DirectionalLight
LIGHTS: tuple[type[Light], ...] = (DirectionalLight,)
