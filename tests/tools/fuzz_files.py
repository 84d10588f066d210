"""Files that are broken in every way: each is refused in words, or read."""

from __future__ import annotations

import io
import json
import math
import random
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from PIL import Image

import lixel as lx

CAMERA = lx.Camera.look_at((4, 5, 8), (0, 0.5, 0), yfov=0.9, width=8, height=6)
FILES: dict[str, bytes] = {}
FOLDER = Path(tempfile.mkdtemp(prefix="lixel-fuzz-"))
CASES = Path(__file__).parents[1] / "cases"
JSON_VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1, 4, 10**9, 2**31, 2**53, 10**30, 0.5, -0.5, 1e39, 1e308, math.inf,
    math.nan, "", "x", "../x", "spot", "SCALAR", "MAT4", [], {}, [0], [0, 0, 0], [[]], {"a": 0},
)  # fmt: skip
WORDS = (
    b"0", b"-1", b"1", b"99999999999", b"1e400", b"nan", b"x", b"\\\n", b"#", b"\n", b"\r", b"/",
    b"f", b"v", b"vertex", b"endloop", b"solid", b"face", b"element", b"list", b"\0", b"<!ENTITY",
)  # fmt: skip


def files() -> dict[str, bytes]:
    """Small files of every format, by name."""
    if not FILES:
        for path in sorted(CASES.iterdir()):
            FILES[path.name] = path.read_bytes()
            (FOLDER / path.name).write_bytes(FILES[path.name])
        mesh = trimesh.creation.box()
        for ending in ("glb", "obj", "ply", "stl", "off", "3mf", "dae"):
            whole = mesh if ending in ("off", "dae") else mesh.scene()
            exported = whole.export(file_type=ending)
            FILES[f"box.{ending}"] = exported.encode() if isinstance(exported, str) else exported
        FILES.update(masked_files())
        for name in MASKED:
            (FOLDER / name).write_bytes(FILES[name])
    return FILES


REMEDIES = ("export", "copy", "mend that", "put that", "put it", "convert", "split", "make its")
MASKED = ("leaf.obj", "leaf.mtl", "leaf.png", "leaf.gltf")


def masked_files() -> dict[str, bytes]:
    """A triangle with holes, as OBJ and as glTF, with the files that both refer to."""
    image = np.full((4, 3, 4), 200, np.uint8)
    image[::2, :, 3] = 0
    encoded = io.BytesIO()
    Image.fromarray(image).save(encoded, "PNG")
    obj = b"mtllib leaf.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\nusemtl leaf\n"
    gltf = json.loads((CASES / "spot_inner_equals_outer.gltf").read_bytes())
    gltf["materials"] = [
        {
            "pbrMetallicRoughness": {
                "baseColorTexture": {"index": 0, "texCoord": 0},
                "baseColorFactor": [1, 1, 1, 0.9],
            },
            "alphaMode": "MASK",
            "alphaCutoff": 0.4,
        }
    ]
    gltf["textures"] = [{"source": 0, "sampler": 0}]
    gltf["samplers"] = [{"wrapS": 33071, "wrapT": 33648, "magFilter": 9728}]
    gltf["images"] = [{"uri": "leaf.png"}]
    for mesh in gltf["meshes"]:
        for primitive in mesh["primitives"]:
            primitive["material"] = 0
            primitive["attributes"]["TEXCOORD_0"] = primitive["attributes"]["POSITION"]
    return {
        "leaf.obj": obj + b"f 1/1 2/2 3/3\nf -1/-1 -2/-3 -3/-2\n",
        "leaf.mtl": b"newmtl leaf\nd 0.9\nmap_d -s 2 -1 1 -o 0.5 0 -clamp on -imfchan m leaf.png\n",
        "leaf.png": encoded.getvalue(),
        "leaf.gltf": json.dumps(gltf).encode(),
    }


def file(r: random.Random) -> None:
    """A file that is cut short, or has some bytes or some values of its JSON changed."""
    name = r.choice(list(files()))
    content = bytearray(FILES[name])
    if name.endswith(".gltf") and r.random() < 0.8:
        tree = json.loads(content)
        for _ in range(r.randint(1, 3)):
            change_json(r, tree)
        content = bytearray(json.dumps(tree, default=repr).encode())
    elif r.random() < 0.4:
        del content[r.randrange(len(content)) :]
    elif r.random() < 0.4:
        change_words(r, content)
    if r.random() < 0.5:
        for _ in range(r.randint(0, 3)):
            if content:
                content[r.randrange(len(content))] = r.randrange(256)
    ending = name.rpartition(".")[2]
    other = r.choice(list(FILES)).rpartition(".")[2]
    path = FOLDER / f"fuzzed.{ending if r.random() < 0.9 else other}"
    if ending in ("mtl", "png"):
        # What others refer to.
        (FOLDER / name).write_bytes(bytes(content))
        path = FOLDER / r.choice(["leaf.obj", "leaf.gltf"])
    else:
        path.write_bytes(bytes(content))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            made = lx.load(path, up=r.choice(["y", "z"]))
        except ValueError as error:
            if path.name not in str(error) or not any(word in str(error) for word in REMEDIES):
                raise AssertionError(f"neither file nor remedy: {error}") from error
            raise
        finally:
            for other in MASKED:
                (FOLDER / other).write_bytes(FILES[other])
            ours = {UserWarning, ResourceWarning}
            assert {w.category for w in caught} <= ours, [str(w.message) for w in caught]
    assert np.isfinite(made.vertices).all()
    assert bool(made.unsupported) == any(w.category is UserWarning for w in caught)
    if made.masked_count:
        lx.reference(made, CAMERA, lx.DirectionalLight((1.0, -1.5, -0.5)))


def change_json(r: random.Random, tree: Any) -> None:
    """Another value somewhere in a JSON tree, or one less."""
    places: list[tuple[Any, Any]] = []
    pending = [tree]
    while pending:
        holder = pending.pop()
        keys = list(holder) if isinstance(holder, dict) else range(len(holder))
        places += [(holder, key) for key in keys]
        pending += [holder[key] for key in keys if isinstance(holder[key], dict | list)]
    if not places:
        return
    holder, key = r.choice(places)
    kind = r.random()
    if kind < 0.2:
        del holder[key]
    elif kind < 0.5:
        holder[key] = r.choice(JSON_VALUES)
    elif kind < 0.8 and isinstance(holder[key], int | float):
        holder[key] = holder[key] + r.choice([-1, 1, 0.5, 1000])
    else:
        other, place = r.choice(places)
        holder[key] = json.loads(json.dumps(other[place], default=repr))


def change_words(r: random.Random, content: bytearray) -> None:
    """Another word somewhere in a text, or a word more."""
    words = bytes(content).split(b" ")
    place = r.randrange(len(words))
    if r.random() < 0.3:
        words.insert(place, r.choice(WORDS))
    else:
        words[place] = r.choice([*WORDS, r.choice(words)])
    content[:] = b" ".join(words)


# Now, or what fails in them would be taken for a refusal.
files()
