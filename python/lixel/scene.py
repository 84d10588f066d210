"""The scene: triangles in world space, and the cameras and lights that came with them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import INTEGER, array_of, reals
from .camera import Camera
from .light import Light
from .masks import AlphaMask, Masks, PartMask, masks_of_arrays, masks_of_parts
from .trimesh_masks import TrimeshMasks

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
    uv : (n, 2) or (m, 3, 2) float, optional
        Texture coordinates of each vertex, or of each corner of each face, where faces have holes:
        (0, 0) is the first corner of row 0 of an image, as in glTF.
    alpha : AlphaMask or sequence of AlphaMask, optional
        The images that say where the holes are.
    face_alpha : (m,) int, optional
        Which of them a face has, -1 where it is opaque; without it all faces have the only one.
    object_id : (m,) int, optional
        Which object each triangle is of, counted from 0. None: all are of one.
    objects : sequence of str, optional
        Names of the objects. None: ``"object 0"`` and so on.

    Attributes
    ----------
    cameras : dict of str to Camera
        Cameras that came with the scene, by name; yours to change.
    lights : dict of str to Light
        Lights that came with the scene, by name; yours to change.
    objects : tuple of str
        Names of objects: of glTF's and trimesh's nodes, and of an OBJ file's groups. What has the
        same name is one object.
    object_id : (m,) int32
        Which of them each triangle is of.
    materials, material_id
        The same of materials, by their names or numbers in the file.
    name : str
        Of the file or of the generator, empty for other scenes; files that lixel writes tell it.
    unsupported : tuple of str
        What the file holds and lixel does not render yet, for example ``"point light 'Lamp'"``.

    Raises
    ------
    TypeError
        An array that does not hold real numbers (`vertices`) or integers (`faces`).
    ValueError
        A wrong shape, no triangle, a vertex that is not finite, an index out of range, alpha images
        of more than 2**27 texels together; the message names the argument, the rule and the row.

    Examples
    --------
    >>> scene = Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> scene.triangle_count
    1
    """

    cameras: dict[str, Camera]
    lights: dict[str, Light]
    name: str
    unsupported: tuple[str, ...]
    objects: tuple[str, ...]
    object_id: npt.NDArray[np.int32]
    materials: tuple[str, ...]
    material_id: npt.NDArray[np.int32]

    def __init__(
        self,
        vertices: npt.ArrayLike,
        faces: npt.ArrayLike,
        *,
        uv: npt.ArrayLike | None = None,
        alpha: AlphaMask | Sequence[AlphaMask] | None = None,
        face_alpha: npt.ArrayLike | None = None,
        object_id: npt.ArrayLike | None = None,
        objects: Sequence[str] | None = None,
    ) -> None:
        positions = reals("vertices", vertices, "n", 3)
        triangles = _indices(faces, len(positions))
        masks = masks_of_arrays(triangles, len(positions), uv, alpha, face_alpha)
        self._set(positions, triangles, masks)
        self.objects, self.object_id = _labels(object_id, objects, self.triangle_count)

    def _set(
        self,
        vertices: npt.NDArray[np.float64],
        faces: npt.NDArray[np.int64],
        masks: Masks | None,
    ) -> None:
        self._core = _core.Scene(vertices, faces, masks.of_core() if masks else None)
        self._masks = masks if self._core.masked_count else None
        self.objects, self.object_id = _labels(None, None, self.triangle_count)
        self.materials, self.material_id = ("",), np.zeros(self.triangle_count, np.int32)
        self._generation = 0
        self.cameras = {}
        self.lights = {}
        self.name = ""
        self.unsupported = ()

    @classmethod
    def _of(
        cls,
        vertices: npt.NDArray[np.float64],
        faces: npt.NDArray[np.int64],
        masks: Masks,
    ) -> Scene:
        scene = cls.__new__(cls)
        scene._set(np.ascontiguousarray(vertices), np.ascontiguousarray(faces), masks)
        return scene

    @classmethod
    def from_trimesh(cls, mesh: trimesh.Trimesh | trimesh.Scene) -> Scene:
        """The triangles of a trimesh mesh, or of every mesh in a trimesh scene.

        Node transforms are applied in float64. A camera that was set in the trimesh scene is
        `cameras[name]`; trimesh keeps no lights worth having. Point clouds and paths are left out.

        Triangles have holes where their material has a texture with alpha: a `PBRMaterial` whose
        `alphaMode` is "MASK" ("BLEND" is taken for it, with a cutoff of 0.5), a `SimpleMaterial`
        whose image has alpha. Textures repeat.

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

        masks_of = TrimeshMasks().of_mesh
        if isinstance(mesh, trimesh.Trimesh):
            return joined([(mesh.vertices, mesh.faces)], [masks_of(mesh)])
        if not isinstance(mesh, trimesh.Scene):
            raise TypeError(
                f"mesh must be a trimesh.Trimesh or a trimesh.Scene, got {type(mesh).__name__}"
            )
        parts: list[Mesh] = []
        masks: list[PartMask | None] = []
        nodes: list[str] = []
        for node, part, world_from_part in meshes_of(mesh):
            positions = moved(world_from_part, np.asarray(part.vertices, np.float64))
            parts.append((positions, part.faces))
            masks.append(masks_of(part))
            nodes.append(node)
        if not parts:
            raise ValueError("mesh must hold at least one triangle, got a scene with none")
        scene = joined(parts, masks)
        counts = [len(np.asarray(faces)) for _, faces in parts]
        scene.objects, scene.object_id = labels_of_parts(nodes, counts)
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
    def masked_count(self) -> int:
        """How many triangles have holes, where an alpha image is below its cutoff."""
        return self._core.masked_count

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
        if self.masked_count:
            parts.append(f"{self.masked_count:,} with holes")
        parts.append(f"bounds {_point(low)} to {_point(high)}")
        parts += [f"{len(d)} {n}" for n, d in (("cameras", self.cameras), ("lights", self.lights))]
        return f"<lixel.Scene: {', '.join(parts)}>"

    def _bytes(self) -> Iterator[bytes]:
        """All that makes its shadows."""
        yield self.vertices.tobytes()
        yield self.faces.tobytes()
        if self._masks is not None:
            yield from self._masks.bytes()

    def __getstate__(self) -> dict[str, Any]:
        return self.__dict__ | {"_core": (self.vertices, self.faces)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        vertices, faces = state["_core"]
        masks = state["_masks"].of_core() if state.get("_masks") else None
        self.__dict__.update(
            state | {"_core": _core.Scene(vertices, faces.astype(np.int64), masks)}
        )

    def __copy__(self) -> Scene:
        # A shallow copy that shared the geometry would move with the original.
        return self.__deepcopy__({})

    def __deepcopy__(self, memo: dict[int, Any]) -> Scene:
        twin = Scene.__new__(Scene)
        twin.__setstate__(self.__getstate__())
        # Cameras and lights are immutable; the dictionaries that hold them and arrays are not.
        twin.cameras, twin.lights = dict(self.cameras), dict(self.lights)
        twin.object_id, twin.material_id = self.object_id.copy(), self.material_id.copy()
        return twin


def meshes_of(
    scene: trimesh.Scene,
) -> Iterator[tuple[str, trimesh.Trimesh, npt.NDArray[np.float64]]]:
    """The nodes of a trimesh scene that hold triangles: name, mesh, and world from mesh."""
    import trimesh

    for node in scene.graph.nodes_geometry:
        world_from_mesh, name = scene.graph[node]
        mesh = scene.geometry[name]
        if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
            yield str(node), mesh, world_from_mesh


def moved(
    world_from_part: npt.NDArray[np.float64], positions: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Positions, (n, 3), through a transform, (4, 4); themselves where it moves nothing."""
    if np.array_equal(world_from_part, np.eye(4)):
        return positions
    return np.asarray(positions @ world_from_part[:3, :3].T + world_from_part[:3, 3])


def joined(parts: Iterable[Mesh], masks: Sequence[PartMask | None] = ()) -> Scene:
    """A scene of parts, each corner positions (n, 3) and triangles (m, 3), and what masks each."""
    meshes = [(np.asarray(v, np.float64), np.asarray(f, np.int64)) for v, f in parts]
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes[:-1])])
    faces = [faces + start for (_, faces), start in zip(meshes, starts, strict=True)]
    positions, triangles = np.concatenate([v for v, _ in meshes]), np.concatenate(faces)
    counted = [(len(f), mask) for f, mask in zip(faces, masks, strict=bool(masks))]
    found = masks_of_parts(counted)
    return Scene(positions, triangles) if found is None else Scene._of(positions, triangles, found)


def labels_of_parts(
    names: Sequence[str], counts: Sequence[int]
) -> tuple[tuple[str, ...], npt.NDArray[np.int32]]:
    """The names of parts, each once, and the number of its own for each triangle."""
    known = {name: number for number, name in enumerate(dict.fromkeys(names))}
    return tuple(known), np.repeat(np.array([known[name] for name in names], np.int32), counts)


def _labels(
    ids: npt.ArrayLike | None, names: Sequence[str] | None, triangle_count: int
) -> tuple[tuple[str, ...], npt.NDArray[np.int32]]:
    if ids is None:
        if names is not None and len(names) != 1:
            raise ValueError(f"objects without object_id must be one name, got {len(names)}")
        return tuple(names or ("object 0",)), np.zeros(triangle_count, np.int32)
    numbers = array_of(INTEGER, "object_id", ids, ("m",))
    if len(numbers) != triangle_count:
        raise ValueError(
            f"object_id must be one for each of {triangle_count} faces, got {len(numbers)}"
        )
    end = 2**31 if names is None else len(names)
    bad = (numbers < 0) | (numbers >= end)
    if bad.any():
        row = int(bad.argmax())
        raise ValueError(f"object_id must be from 0 to {end - 1}: row {row} is {numbers[row]}")
    if names is None:
        names = [f"object {i}" for i in range(int(numbers.max()) + 1)]
    return tuple(map(str, names)), numbers.astype(np.int32)


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
