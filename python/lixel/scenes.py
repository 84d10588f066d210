"""Scenes made on the spot, for demos, tests and studies: no file, the same bytes every time.

Each function returns a `Scene` with a camera and a light named ``"default"``. `GENERATORS` lists
them by name. Up is +Y, the ground is at y = 0, and lengths are metres.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from .arguments import count as checked_count
from .camera import Camera
from .light import DirectionalLight
from .scene import Scene, joined

# The generators, in the order of `GENERATORS`.
__all__ = [
    "city",
    "colonnade",
    "grass",
    "needles",
    "objects_on_floor",
    "plane_and_box",
    "terrain",
]

# Corner positions (n, 3) and triangles (m, 3) of one part.
Mesh: TypeAlias = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]
Point: TypeAlias = tuple[float, float, float]


def plane_and_box() -> Scene:
    """A box that stands on a plane: 14 triangles, and a shadow that can be worked out by hand.

    The plane is 10 x 10 around the origin; the box is 2 wide, high and deep.
    """
    return _scene(
        "plane_and_box",
        [floor(5.0, 5.0), moved(created("box"), scale=2.0, to=(0.0, 1.0, 0.0))],
        eye=(4.0, 5.0, 8.0),
        target=(0.0, 0.5, 0.0),
        light=(1.0, -1.5, -0.5),
    )


def objects_on_floor(count: int = 256, subdivisions: int = 4, seed: int = 0) -> Scene:
    """Boxes, spheres, tori and cones of many sizes and tilts on a floor.

    The default has 1,138,690 triangles, most of them smaller than a texel of a common map; each
    step of `subdivisions` has four times as many. With ``subdivisions=0`` it has 4,098.

    Parameters
    ----------
    count : int
        Objects, in a square grid that is filled row by row.
    subdivisions : int
        0 to 6.
    seed : int
        For sizes, places and tilts.
    """
    count = checked_count("count", count)
    if subdivisions not in range(7):
        raise ValueError(f"subdivisions must be an integer from 0 to 6, got {subdivisions}")
    n = 2**subdivisions
    kinds = (
        _divided(created("box"), subdivisions),
        moved(created("icosphere", subdivisions), scale=0.5),
        _torus(0.36, 0.14, 4 * n, 5 * n // 2),
        _divided(_cone(35 if subdivisions else 8), max(subdivisions - 1, 0)),
    )
    random = np.random.default_rng(seed)
    side = math.ceil(math.sqrt(count))
    parts = [floor(side + 1.0, side + 1.0)]
    for i in range(count):
        row, column = divmod(i, side)
        kind = kinds[(row + column) % 4]
        size = random.uniform(0.6, 1.7)
        x, z = 2.0 * np.array([column, row]) - (side - 1) + random.uniform(-0.25, 0.25, 2)
        turn = rotation(random.uniform(0.0, 2.0 * math.pi), random.uniform(-0.5, 0.5))
        vertices = kind[0] * size @ turn.T
        # On the floor, not in it.
        vertices += (x, -vertices[:, 1].min(), z)
        parts.append((vertices, kind[1]))
    return _scene(
        "objects_on_floor",
        parts,
        eye=(-0.9 * side, 0.45 * side, 1.05 * side),
        target=(0.0, 0.0, 0.1 * side),
        light=(0.55, -0.7, -0.35),
        yfov=0.85,
    )


def colonnade(columns: int = 20, detail: int = 38) -> Scene:
    """Two rows of columns joined by arches, with spheres and tori between them, on a long floor.

    The default has 260,710 triangles. A camera in the middle of the aisle sees near and far
    receivers at once, which is where a uniform map does worst.

    Parameters
    ----------
    columns : int
        In each row, at least 2.
    detail : int
        Sections around a column, at least 8.
    """
    columns = checked_count("columns", columns, least=2)
    detail = checked_count("detail", detail, least=8)
    spacing, half_width, height = 2.4, 2.2, 3.4
    # Radius and height: a round base, a swelling shaft, a capital.
    rise = np.linspace(0.0, 1.0, detail // 2)
    shaft = np.column_stack(
        [0.27 - 0.05 * rise + 0.02 * np.sin(math.pi * rise), 0.3 + (height - 0.6) * rise]
    )
    profile = np.vstack(
        [[0.0, 0.0], [0.42, 0.0], [0.42, 0.14], [0.32, 0.3], shaft,
         [0.3, height - 0.3], [0.42, height - 0.16], [0.42, height], [0.0, height]]
    )  # fmt: skip
    column = _revolved(profile, detail)
    # The half torus lies in x and y; turned, it spans from one column to the next.
    arch = _torus(spacing / 2, 0.2, detail, detail // 2, angle=math.pi)
    arch = moved(arch, turn=rotation(math.pi / 2))
    sphere = moved(created("icosphere", 4 if detail >= 32 else 2), scale=0.42)
    ring = _torus(0.34, 0.13, detail, detail // 2)
    length = spacing * columns
    parts = [floor(3.0 * half_width, length / 2 + spacing, centre_z=-length / 2)]
    for i in range(columns):
        z = -spacing * (i + 0.5)
        between = z - spacing / 2
        for x in (-half_width, half_width):
            parts.append(moved(column, to=(x, 0.0, z)))
            if i + 1 < columns:
                parts.append(moved(arch, to=(x, height, between)))
        # One of each for every pair of columns, hung and laid in a steady wave.
        hung = (0.9 * math.sin(1.7 * i), 0.42 + 0.25 * (i % 3), z)
        laid = (1.1 * math.cos(1.3 * i), 1.6 + 0.4 * (i % 2), between)
        parts += [moved(sphere, to=hung), moved(ring, turn=rotation(0.8 * i, 0.9), to=laid)]
    return _scene(
        "colonnade",
        parts,
        eye=(0.7, 1.5, 3.4),
        target=(-0.3, 1.8, -30.0),
        light=(0.42, -0.8, -0.43),
        yfov=1.0,
    )


def city(blocks: int = 24, seed: int = 0) -> Scene:
    """Streets between towers that step back as they rise: large flat casters, long shadows.

    The default has 24,050 triangles.

    Parameters
    ----------
    blocks : int
        Along each side of the square.
    seed : int
        For heights and steps.
    """
    blocks = checked_count("blocks", blocks)
    random = np.random.default_rng(seed)
    pitch, box = 30.0, created("box")
    parts = [floor(pitch * (blocks / 2 + 2), pitch * (blocks / 2 + 2))]
    for i, j in np.ndindex(blocks, blocks):
        x, z = (pitch * (k - (blocks - 1) / 2) for k in (i, j))
        # Taller towards the middle.
        spread = 0.3 * pitch * blocks
        centrality = math.exp(-((x / spread) ** 2) - (z / spread) ** 2)
        width, depth = random.uniform(12.0, 22.0, 2)
        base = 0.0
        for _ in range(random.integers(2, 6)):
            rise = random.uniform(3.0, 9.0) * (1.0 + 2.5 * centrality)
            parts.append(moved(box, scale=(width, rise, depth), to=(x, base + rise / 2, z)))
            base += rise
            width, depth = (width, depth) * random.uniform(0.6, 0.95, 2)
    reach = pitch * blocks
    return _scene(
        "city",
        parts,
        eye=(-0.42 * reach, 0.28 * reach, 0.52 * reach),
        target=(0.0, 0.0, -0.05 * reach),
        light=(0.8, -0.5, 0.3),
    )


def grass(blades: int = 100_000, seed: int = 0) -> Scene:
    """Bent blades on a meadow, each five triangles: casters thinner than texels, seen from close.

    The default has 500,002 triangles.

    Parameters
    ----------
    blades : int
    seed : int
        For places, sizes and bends.
    """
    blades = checked_count("blades", blades)
    random = np.random.default_rng(seed)
    side = 10.0
    root = np.zeros((blades, 3))
    root[:, [0, 2]] = random.uniform(-side, side, (blades, 2))
    azimuth = random.uniform(0.0, 2.0 * math.pi, blades)
    height, bend = random.uniform(0.25, 0.6, blades), random.uniform(0.05, 0.35, blades)
    across = np.column_stack([np.cos(azimuth), np.zeros(blades), np.sin(azimuth)])
    lean = np.column_stack([-np.sin(azimuth), np.zeros(blades), np.cos(azimuth)])
    rows = []
    for t, half_width in ((0.0, 0.008), (0.4, 0.007), (0.75, 0.005)):
        middle = root + lean * (bend * t * t)[:, None]
        middle[:, 1] += height * t
        rows += [middle - half_width * across, middle + half_width * across]
    tip = root + lean * bend[:, None]
    tip[:, 1] += height
    vertices = np.stack([*rows, tip], axis=1).reshape(-1, 3)
    blade = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4], [4, 5, 6]])
    faces = (7 * np.arange(blades)[:, None, None] + blade).reshape(-1, 3)
    return _scene(
        "grass",
        [floor(side + 1.0, side + 1.0), (vertices, faces)],
        eye=(0.0, 1.3, side + 0.5),
        target=(0.0, 0.1, 2.0),
        light=(0.6, -0.7, 0.25),
    )


def needles(count: int = 2000, seed: int = 0) -> Scene:
    """Long thin spikes that stand askew: the hardest case for the rasterizer and for one texel.

    The default has 12,002 triangles, each needle 400 times as long as it is thick.

    Parameters
    ----------
    count : int
    seed : int
        For places and tilts.
    """
    count = checked_count("count", count)
    random = np.random.default_rng(seed)
    side = 10.0
    # A pyramid on a square foot: two triangles for the foot, four for the sides.
    corners = np.array(
        [[-0.5, 0, -0.5], [0.5, 0, -0.5], [0.5, 0, 0.5], [-0.5, 0, 0.5], [0, 1, 0]], dtype=float
    )
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0]])
    parts = [floor(side + 2.0, side + 2.0)]
    for _ in range(count):
        length = random.uniform(1.0, 4.0)
        x, z = random.uniform(-side, side, 2)
        turn = rotation(random.uniform(0.0, 2.0 * math.pi), random.uniform(0.0, 0.6))
        scale = (length / 400.0, length, length / 400.0)
        parts.append(moved((corners, faces), scale=scale, turn=turn, to=(x, 0.0, z)))
    return _scene(
        "needles",
        parts,
        eye=(0.0, 5.0, 15.0),
        target=(0.0, 0.8, 0.0),
        light=(0.5, -0.8, -0.3),
    )


def terrain(cells: int = 1000, seed: int = 0) -> Scene:
    """Hills under a low sun: one surface that casts on itself at grazing angles.

    The default has 2,000,000 triangles.

    Parameters
    ----------
    cells : int
        Along each side; two triangles each.
    seed : int
        For the hills.
    """
    cells = checked_count("cells", cells)
    random = np.random.default_rng(seed)
    side = 1000.0
    x, z = np.meshgrid(*2 * [np.linspace(-side, side, cells + 1)], indexing="ij")
    y = np.zeros_like(x)
    # Waves in random directions, each octave shorter and lower than the last.
    for octave in range(1, 8):
        for _ in range(4):
            angle, phase = random.uniform(0.0, 2.0 * math.pi, 2)
            k = 2.0**octave * math.pi / side / 2
            y += (
                90.0 / 2.0**octave * np.sin(k * (x * math.cos(angle) + z * math.sin(angle)) + phase)
            )
    corner = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    right, below = corner + cells + 1, corner + 1
    pair = [[corner, below, right], [right, below, below + cells + 1]]
    faces = np.concatenate([np.column_stack(corners) for corners in pair])
    return _scene(
        "terrain",
        [(np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces)],
        eye=(-0.6 * side, 0.45 * side, 1.3 * side),
        target=(0.0, 0.0, 0.0),
        light=(0.9, -0.25, -0.2),
        yfov=0.8,
    )


GENERATORS: Mapping[str, Callable[..., Scene]] = MappingProxyType(
    {
        generator.__name__: generator
        for generator in (plane_and_box, objects_on_floor, colonnade, city, grass, needles, terrain)
    }
)
"""Every generator by name."""


# --- Parts ---


def _scene(
    name: str, parts: list[Mesh], *, eye: Point, target: Point, light: Point, yfov: float = 0.9
) -> Scene:
    scene = joined(parts)
    scene.name = name
    scene.cameras["default"] = Camera.look_at(eye, target, yfov=yfov, width=1920, height=1080)
    scene.lights["default"] = DirectionalLight(light)
    return scene


def moved(
    mesh: Mesh,
    *,
    scale: float | Point = 1.0,
    turn: npt.NDArray[np.float64] | None = None,
    to: Point = (0.0, 0.0, 0.0),
) -> Mesh:
    vertices = mesh[0] * scale
    return (vertices if turn is None else vertices @ turn.T) + to, mesh[1]


def rotation(azimuth: float, tilt: float = 0.0) -> npt.NDArray[np.float64]:
    """Tilted about x, then turned about y."""
    (c, s), (d, t) = ((math.cos(a), math.sin(a)) for a in (azimuth, tilt))
    turn = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    tilted = np.array([[1.0, 0.0, 0.0], [0.0, d, -t], [0.0, t, d]])
    return np.asarray(turn @ tilted)


def floor(half_width: float, half_depth: float, centre_z: float = 0.0) -> Mesh:
    """Two triangles at height 0."""
    x, near, far = half_width, centre_z + half_depth, centre_z - half_depth
    vertices = np.array([[-x, 0, near], [x, 0, near], [x, 0, far], [-x, 0, far]], dtype=float)
    return vertices, np.array([[0, 1, 2], [0, 2, 3]])


def created(kind: Literal["box", "icosphere"], *arguments: int) -> Mesh:
    """Around the origin: a box of side 1, or a sphere of radius 1 by its subdivisions."""
    import trimesh

    mesh = getattr(trimesh.creation, kind)(*arguments)
    return np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int64)


def _cone(sections: int) -> Mesh:
    """Radius 1/2, height 1, standing on the origin; a side and a foot."""
    return _revolved(np.array([[0.0, 0.0], [0.5, 0.0], [0.0, 1.0]]), sections)


def _divided(mesh: Mesh, times: int) -> Mesh:
    """Each triangle cut into four, again and again."""
    import trimesh

    subdivide: Any = trimesh.remesh.subdivide  # untyped
    vertices, faces = mesh
    for _ in range(times):
        vertices, faces = subdivide(vertices, faces)
    return vertices, faces


def _revolved(profile: npt.NDArray[np.float64], sections: int) -> Mesh:
    """A profile of (radius, height), turned about y. Where it meets the axis there are no
    triangles of zero area."""
    angle = np.arange(sections) * (2.0 * math.pi / sections)
    ring = np.stack([np.cos(angle), np.zeros(sections), np.sin(angle)], axis=1)
    vertices = (profile[:, :1, None] * ring).reshape(-1, 3)
    vertices[:, 1] = np.repeat(profile[:, 1], sections)
    faces = _grid_faces(len(profile), sections, closed=False)
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return vertices, faces[area > 0.0]


def _torus(
    major: float, minor: float, around: int, across: int, angle: float = 2.0 * math.pi
) -> Mesh:
    """About z, of ring radius `major` and tube radius `minor`; open where `angle` is not a turn."""
    closed = angle == 2.0 * math.pi
    u = np.linspace(0.0, angle, around, endpoint=not closed)
    v = np.arange(across) * (2.0 * math.pi / across)
    radius = major + minor * np.cos(v)
    x, y = np.cos(u)[:, None] * radius, np.sin(u)[:, None] * radius
    z = np.broadcast_to(minor * np.sin(v), x.shape)
    vertices = np.stack([x, y, z], axis=-1).reshape(-1, 3)
    return vertices, _grid_faces(around, across, closed=closed)


def _grid_faces(rows: int, columns: int, *, closed: bool) -> npt.NDArray[np.int64]:
    """Two triangles for each cell of a grid whose columns wrap around, and rows where closed."""
    corners = np.arange(rows * columns).reshape(rows, columns)
    shifts = ((0, 0), (0, -1), (-1, 0), (-1, -1))
    shifted = (np.roll(corners, shift, (0, 1)) for shift in shifts)
    a, b, c, d = (each[: rows if closed else -1].ravel() for each in shifted)
    return np.concatenate([np.column_stack([a, c, b]), np.column_stack([b, c, d])])
