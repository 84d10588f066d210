"""The scene: triangles in world space, and the cameras and lights that came with them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import INTEGER, array_of, reals
from .camera import Camera
from .light import Light

if TYPE_CHECKING:
    import trimesh

Mesh: TypeAlias = tuple[npt.ArrayLike, npt.ArrayLike]


class Scene:
    """Triangles in world space. Every triangle casts and receives shadows, from both sides.

    Parameters
    ----------
    vertices : (n, 3) float
        Corner positions in world units, right-handed. float64 keeps its precision.
    faces : (m, 3) int
        Rows index `vertices`. Triangles of zero area are allowed, counted and ignored.

    Attributes
    ----------
    cameras : dict of str to Camera
        Cameras that came with the scene, by name; yours to change.
    lights : dict of str to Light
        Lights that came with the scene, by name; yours to change.
    unsupported : tuple of str
        What the file holds and lixel does not render yet, for example ``"point light 'Lamp'"``.

    Raises
    ------
    TypeError
        An array that does not hold real numbers (`vertices`) or integers (`faces`).
    ValueError
        A wrong shape, no triangle, a vertex that is not finite, an index out of range; the message
        names the argument, the rule and the row.

    Examples
    --------
    >>> scene = Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> scene.triangle_count
    1
    """

    cameras: dict[str, Camera]
    lights: dict[str, Light]
    unsupported: tuple[str, ...]

    def __init__(self, vertices: npt.ArrayLike, faces: npt.ArrayLike) -> None:
        positions = reals("vertices", vertices, "n", 3)
        self._core = _core.Scene(positions, _indices(faces, len(positions)))
        self._generation = 0
        self.cameras = {}
        self.lights = {}
        self.unsupported = ()

    @classmethod
    def from_trimesh(cls, mesh: trimesh.Trimesh | trimesh.Scene) -> Scene:
        """The triangles of a trimesh mesh, or of every mesh in a trimesh scene.

        Node transforms are applied in float64. A camera that was set in the trimesh scene is
        `cameras[name]`; trimesh keeps no lights worth having. Point clouds and paths are left out.

        Parameters
        ----------
        mesh : trimesh.Trimesh or trimesh.Scene

        Raises
        ------
        TypeError
            `mesh` is neither.
        ValueError
            It holds no triangle.
        """
        import trimesh

        if isinstance(mesh, trimesh.Trimesh):
            return cls(mesh.vertices, mesh.faces)
        if not isinstance(mesh, trimesh.Scene):
            raise TypeError(
                f"mesh must be a trimesh.Trimesh or a trimesh.Scene, got {type(mesh).__name__}"
            )
        parts: list[Mesh] = []
        for node in mesh.graph.nodes_geometry:
            world_from_node, name = mesh.graph[node]
            part = mesh.geometry[name]
            if not isinstance(part, trimesh.Trimesh) or len(part.faces) == 0:
                continue
            positions = np.asarray(part.vertices, dtype=np.float64)
            if not np.array_equal(world_from_node, np.eye(4)):
                positions = positions @ world_from_node[:3, :3].T + world_from_node[:3, 3]
            parts.append((positions, part.faces))
        if not parts:
            raise ValueError("mesh must hold at least one triangle, got a scene with none")
        scene = joined(parts)
        if mesh.has_camera:
            scene.cameras[str(mesh.camera.name)] = Camera.from_trimesh(mesh)
        return scene

    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """(n, 3) float64: a copy of the corner positions, in world units."""
        return self._core.vertices

    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """(m, 3) uint32: a copy of the triangles; rows index `vertices`."""
        return self._core.faces

    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """(2, 3) float64: least and greatest corner of the box around all triangles."""
        return self._core.bounds

    @property
    def triangle_count(self) -> int:
        """How many triangles there are, those of zero area included."""
        return self._core.triangle_count

    @property
    def degenerate_count(self) -> int:
        """How many triangles have zero area; they neither cast nor receive."""
        return self._core.degenerate_count

    def update_vertices(self, vertices: npt.ArrayLike) -> None:
        """Move the vertices; the triangles stay, and what does not depend on positions is kept.

        Parameters
        ----------
        vertices : (n, 3) float
            New positions in the old order, in world units.

        Raises
        ------
        TypeError, ValueError
            As for a new scene, and ValueError where the number of vertices changes. The scene is
            then as it was.
        """
        self._core.update_vertices(reals("vertices", vertices, "n", 3))
        self._generation += 1

    def __repr__(self) -> str:
        low, high = self.bounds
        parts = [f"{self.triangle_count:,} triangles"]
        if self.degenerate_count:
            parts.append(f"{self.degenerate_count:,} of zero area")
        parts.append(f"bounds {_point(low)} to {_point(high)}")
        parts += [f"{len(d)} {n}" for n, d in (("cameras", self.cameras), ("lights", self.lights))]
        return f"<lixel.Scene: {', '.join(parts)}>"

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_core": (self.vertices, self.faces)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vertices, faces = state["_core"]
        self.__dict__.update(state | {"_core": _core.Scene(vertices, faces.astype(np.int64))})

    def __copy__(self) -> Scene:
        # A shallow copy that shared the geometry would move with the original.
        return self.__deepcopy__({})

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        twin = Scene.__new__(Scene)
        twin.__setstate__(self.__getstate__())
        # Cameras and lights are immutable; the dictionaries that hold them are not.
        twin.cameras, twin.lights = dict(self.cameras), dict(self.lights)
        return twin


def joined(parts: Iterable[Mesh]) -> Scene:
    """A scene of parts, each corner positions (n, 3) and triangles (m, 3)."""
    meshes = [(np.asarray(v, np.float64), np.asarray(f, np.int64)) for v, f in parts]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes[:-1])])
    faces = [faces + start for (_, faces), start in zip(meshes, starts, strict=True)]
    return Scene(np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces))


def _point(p: npt.NDArray[np.float64]) -> str:
    return "(" + ", ".join(f"{c:.6g}" for c in p) + ")"


def _indices(value: npt.ArrayLike, vertex_count: int) -> npt.NDArray[np.int64]:
    array = array_of(INTEGER, "faces", value, ("m", 3))
    # Here, not in the core: an unsigned index beyond 63 bits would wrap on its way there.
    if array.size and (array.min() < 0 or array.max() >= vertex_count):
        row = int(np.flatnonzero(((array < 0) | (array >= vertex_count)).any(axis=1))[0])
        raise ValueError(
            f"faces must index vertices: row {row} is {array[row].tolist()} "
            f"but there are {vertex_count} vertices, counted from 0"
        )
    return np.ascontiguousarray(array, dtype=np.int64)
