"""What trimesh leaves aside in a glTF file: its cameras, its lights, and what it would misread."""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .camera import Camera, pose_of
from .light import DirectionalLight, Light, PointLight, SpotLight

_GLB_MAGIC = 0x46546C67
_JSON_CHUNK = 0x4E4F534A

# Extensions that change where triangles are, and which trimesh skips with no more than a log line.
_UNREAD = (
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "KHR_draco_mesh_compression",
    "EXT_mesh_gpu_instancing",
)
_TRIANGLE_FAN = 6


@dataclass(frozen=True)
class Document:
    """The JSON of a glTF file, and the bytes of a .glb file that follow it."""

    tree: dict[str, Any]
    binary: bytes | None

    @classmethod
    def read(cls, path: Path) -> Document:
        """From a .glb or a .gltf file; ValueError where it is neither."""
        content = path.read_bytes()
        if path.suffix.lower() == ".glb":
            if len(content) < 20:
                raise ValueError(f"a .glb file has a header of 20 bytes, got {len(content)} bytes")
            magic, version, length, json_length, chunk = struct.unpack_from("<5I", content)
            if magic != _GLB_MAGIC or chunk != _JSON_CHUNK:
                raise ValueError("it does not start as a .glb file does")
            if version != 2:
                raise ValueError(f"only glTF 2 is read, got version {version}")
            if length > len(content):
                raise ValueError(f"it is cut off: {len(content)} of {length} bytes")
            tree = json.loads(content[20 : 20 + json_length])
            binary = content[20 + json_length :]
        else:
            tree, binary = json.loads(content), None
        if not isinstance(tree, dict) or "asset" not in tree:
            raise ValueError("its JSON is no glTF asset")
        return cls(tree, binary)

    def without_cameras(self) -> bytes:
        """The file with no camera in it, for trimesh: it drops the mesh of the first node that
        holds a camera, and the pose of that node's children."""
        nodes = [
            {key: value for key, value in node.items() if key != "camera"}
            for node in self.tree.get("nodes", [])
        ]
        tree = {key: value for key, value in self.tree.items() if key != "cameras"}
        text = json.dumps(tree | {"nodes": nodes}).encode()
        if self.binary is None:
            return text
        text += b" " * (-len(text) % 4)
        length = 20 + len(text) + len(self.binary)
        return (
            struct.pack("<5I", _GLB_MAGIC, 2, length, len(text), _JSON_CHUNK) + text + self.binary
        )

    def refuse_unread_geometry(self) -> None:
        """ValueError where trimesh would return triangles that are not those of the file."""
        tree = self.tree
        used = {*tree.get("extensionsUsed", []), *tree.get("extensionsRequired", [])}
        for extension in _UNREAD:
            if extension in used:
                raise ValueError(f"it uses {extension}, which is not read; export it without")
        for mesh in tree.get("meshes", []):
            for primitive in mesh["primitives"]:
                if primitive.get("mode") == _TRIANGLE_FAN:
                    raise ValueError("it has a triangle fan, which is not read; export triangles")
                indices = [primitive["attributes"].get("POSITION"), primitive.get("indices")]
                for accessor in (tree["accessors"][i] for i in indices if i is not None):
                    for feature in ("sparse", "normalized"):
                        if accessor.get(feature):
                            raise ValueError(
                                f"its geometry is in a {feature} accessor, which is not read; "
                                "export plain arrays"
                            )

    def nodes(self) -> Iterator[tuple[int, dict[str, Any], npt.NDArray[np.float64]]]:
        """Every node of the file's scene, parents first: its index, itself, world from node."""
        nodes = self.tree.get("nodes", [])
        scenes = self.tree.get("scenes")
        roots = scenes[self.tree.get("scene", 0)].get("nodes", []) if scenes else []
        pending = [(root, np.eye(4)) for root in reversed(roots)]
        seen: set[int] = set()
        while pending:
            index, world_from_parent = pending.pop()
            if index in seen:
                raise ValueError(f"node {index} has two parents or is its own ancestor")
            seen.add(index)
            world_from_node = world_from_parent @ _parent_from_node(nodes[index])
            yield index, nodes[index], world_from_node
            children = nodes[index].get("children", [])
            pending += [(child, world_from_node) for child in reversed(children)]

    def cameras_and_lights(
        self, height: int
    ) -> tuple[dict[str, Camera], dict[str, Light], tuple[str, ...]]:
        """Those that lixel has, by name, and a word on each of the others."""
        cameras: dict[str, Camera] = {}
        lights: dict[str, Light] = {}
        unsupported: list[str] = []
        punctual = self.tree.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
        for _, node, world_from_node in self.nodes():
            if "camera" in node:
                camera = self.tree["cameras"][node["camera"]]
                name = _unused(node.get("name") or camera.get("name") or "camera", cameras)
                if camera["type"] == "perspective":
                    cameras[name] = _camera(camera["perspective"], world_from_node, height)
                else:
                    unsupported.append(f"{camera['type']} camera {name!r}")
            held = node.get("extensions", {}).get("KHR_lights_punctual")
            if held is not None:
                light = punctual[held["light"]]
                name = _unused(node.get("name") or light.get("name") or "light", lights)
                match light["type"]:
                    case "directional":
                        lights[name] = DirectionalLight.from_pose(world_from_node)
                    case "point":
                        lights[name] = PointLight.from_pose(world_from_node)
                    case "spot":
                        cone = light.get("spot", {})
                        outer = cone.get("outerConeAngle", math.pi / 4)
                        inner = cone.get("innerConeAngle", 0.0)
                        lights[name] = SpotLight.from_pose(world_from_node, outer, inner)
                    case other:
                        unsupported.append(f"{other} light {name!r}")
        return cameras, lights, tuple(unsupported)


def _parent_from_node(node: dict[str, Any]) -> npt.NDArray[np.float64]:
    if "matrix" in node:  # columns after one another
        return np.asarray(np.reshape(node["matrix"], (4, 4)).T, dtype=np.float64)
    matrix = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", (0, 0, 0, 1)), dtype=np.float64)
    # Divided by the square of the norm: a quaternion that went through float32 is not a unit one.
    s = 2.0 / (x * x + y * y + z * z + w * w)
    matrix[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.array(node.get("scale", (1, 1, 1)), dtype=np.float64)
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def _camera(
    perspective: dict[str, Any], world_from_node: npt.NDArray[np.float64], height: int
) -> Camera:
    # A camera has no scale or mirror, whatever the nodes above it have: keep view and up.
    view, up = -world_from_node[:3, 2], world_from_node[:3, 1]
    forward = view / np.linalg.norm(view)
    side = np.cross(forward, up)
    right = side / np.linalg.norm(side)
    pose = pose_of(world_from_node[:3, 3], forward, right)
    aspect = perspective.get("aspectRatio", 16 / 9)
    return Camera(
        pose,
        yfov=perspective["yfov"],
        width=max(1, round(aspect * height)),
        height=height,
        znear=perspective["znear"],
        zfar=perspective.get("zfar", math.inf),
    )


def _unused(name: str, taken: dict[str, Any]) -> str:
    if name not in taken:
        return name
    number = 1
    while f"{name}_{number}" in taken:
        number += 1
    return f"{name}_{number}"
