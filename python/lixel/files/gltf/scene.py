"""From a glTF document to triangles, cameras and lights."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...masks import PartMask
from ...scene import moved
from ..contents import Contents, FileError, Part, Room, unused, words_of
from .accessors import accessor
from .compression import DRACO, MESHOPT
from .document import Document, Object, entry_of, extension_of
from .masks import MaskedMaterials
from .nodes import Matrix, Node, composed, nodes_of
from .primitives import MODES_WITHOUT_TRIANGLES, Primitive
from .skins import JointsInWorld, skinned
from .views import LIGHTS, camera_of, light_of

_INSTANCING = "EXT_mesh_gpu_instancing"

_READ = (
    DRACO,
    *MESHOPT,
    _INSTANCING,
    LIGHTS,
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    # What has nothing to do with where triangles are.
    "KHR_materials_",
    "KHR_texture_",
    "KHR_animation_",
    "KHR_xmp",
    "EXT_texture_",
    "MSFT_texture_",
)

# Of a primitive: its mesh, its place there, and the weights of its targets.
_Key: TypeAlias = tuple[int, int, tuple[float, ...]]


def read_scene(document: Document, height: int, world_from_file: Matrix) -> Contents:
    """Everything that the file's scene shows. What cannot be read costs itself, and is named."""
    reader = _Reader(document, height, world_from_file)
    for extension in document.items("extensionsRequired"):
        if not str(extension).startswith(_READ):
            reader.contents.leave_out(f"the extension {extension}, which the file requires")
    for node in nodes_of(document, world_from_file):
        reader.read(node)
    return reader.contents


class _Reader:
    def __init__(self, document: Document, height: int, world_from_file: Matrix) -> None:
        self.contents = Contents()
        self._document = document
        self._height = height
        self._joints = JointsInWorld(document, world_from_file)
        self._lights = document.extension(LIGHTS).get("lights", [])
        self._primitives: dict[_Key, tuple[Primitive, PartMask | None]] = {}
        self._room = Room(document.size)
        self._names: dict[str, dict[str, object]] = {"camera": {}, "light": {}}
        self._materials = MaskedMaterials(document, self.contents.leave_out)

    def read(self, node: Node) -> None:
        """The mesh, the camera and the light of a node."""
        if "mesh" in node.entry and node.visible:
            self._attempt(f"mesh of {node.name!r}", self._mesh, node)
        if "camera" in node.entry:
            self._attempt(f"camera of {node.name!r}", self._camera, node)
        if isinstance(node.entry.get("extensions"), dict) and LIGHTS in node.entry["extensions"]:
            self._attempt(f"light of {node.name!r}", self._light, node)

    def _attempt(self, what: str, part: Any, *arguments: Any) -> None:
        """Read a part of the file; where it is broken, name it and go on."""
        try:
            part(*arguments)
        except (FileError, MemoryError):
            raise
        except Exception as error:
            self.contents.leave_out(f"{what}: {words_of(error)}")

    # --- Meshes ---

    def _mesh(self, node: Node) -> None:
        mesh = self._document.item("meshes", node.entry["mesh"])
        name = str(node.entry.get("name") or mesh.get("name") or f"node {node.number}")
        weights = tuple(map(float, node.entry.get("weights") or mesh.get("weights") or ()))
        for i in range(len(mesh["primitives"])):
            what = f"primitive {i} of mesh {name!r}"
            self._attempt(what, self._primitive, node, name, (node.entry["mesh"], i, weights))

    def _primitive(self, node: Node, name: str, key: _Key) -> None:
        entry = self._document.item("meshes", key[0])["primitives"][key[1]]
        if entry.get("mode", 4) in MODES_WITHOUT_TRIANGLES:
            self.contents.leave_out("points and lines, which cast no shadow")
            return
        if key not in self._primitives:
            made = Primitive(self._document, entry, list(key[2]))
            self._primitives[key] = made, self._materials.of_primitive(made)
        primitive, mask = self._primitives[key]
        for positions in self._placed(node, primitive):
            part = Part(positions, primitive.faces, name, entry.get("material"), mask=mask)
            self.contents.parts.append(part)

    def _placed(self, node: Node, primitive: Primitive) -> Iterator[npt.NDArray[np.float64]]:
        """The vertices in world space, once for each instance."""
        instances = _instances(self._document, node.entry)
        copies = 1 if instances is None else len(instances)
        self._room.take(primitive.faces, primitive.positions, copies)
        if "skin" in node.entry:
            yield skinned(self._document, node.entry["skin"], primitive, self._joints)
        elif instances is None:
            yield moved(node.world_from_node, primitive.positions)
        else:
            for node_from_instance in instances:
                yield moved(node.world_from_node @ node_from_instance, primitive.positions)

    # --- Cameras and lights ---

    def _named(self, node: Node, entry: Object, kind: str) -> str:
        """Its name; what cannot be read keeps its own, so that no other answers to it."""
        taken = self._names[kind]
        name = unused(str(node.entry.get("name") or entry.get("name") or kind), taken)
        taken[name] = None
        return name

    def _camera(self, node: Node) -> None:
        camera = self._document.item("cameras", node.entry["camera"])
        cameras = self.contents.cameras
        name = self._named(node, camera, "camera")
        kind = camera.get("type")
        if kind not in ("perspective", "orthographic"):
            self.contents.leave_out(f"{kind} camera {name!r}")
            return
        self._attempt(
            f"camera {name!r}",
            lambda: cameras.update({name: camera_of(camera, node.world_from_node, self._height)}),
        )

    def _light(self, node: Node) -> None:
        held = extension_of(node.entry, LIGHTS) or {}
        light = entry_of(self._lights, held["light"], "lights")
        lights = self.contents.lights
        name = self._named(node, light, "light")
        kind = light.get("type")
        if kind not in ("directional", "point", "spot"):
            self.contents.leave_out(f"{kind} light {name!r}")
        elif not node.visible:
            self.contents.leave_out(f"{kind} light {name!r}: its node is hidden")
        else:
            self._attempt(
                f"{kind} light {name!r}",
                lambda: lights.update({name: light_of(light, node.world_from_node)}),
            )


def _instances(document: Document, node: Object) -> npt.NDArray[np.float64] | None:
    """Node from instance, (n, 4, 4), None where the node has no instances but itself."""
    extension = extension_of(node, _INSTANCING)
    if extension is None:
        return None
    found = {
        name: accessor(document, index).astype(np.float64)
        for name, index in extension["attributes"].items()
        if name in ("TRANSLATION", "ROTATION", "SCALE")
    }
    counts = {len(values) for values in found.values()}
    if len(counts) != 1:
        raise ValueError(f"its instances must be as many in each attribute, got {sorted(counts)}")
    (count,) = counts
    parts = [
        found.get("TRANSLATION", np.zeros((count, 3))),
        found.get("ROTATION", np.tile((0.0, 0.0, 0.0, 1.0), (count, 1))),
        found.get("SCALE", np.ones((count, 3))),
    ]
    return np.array([composed(*rows) for rows in zip(*parts, strict=True)]).reshape(-1, 4, 4)
