"""Views that are hard for float32 and for maps: what `lixel lab stress` renders."""

from __future__ import annotations

import dataclasses
import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .. import scenes
from ..arguments import did_you_mean
from ..camera import Camera
from ..light import DirectionalLight, HemisphereLight, Light, PointLight, SpotLight
from ..methods import METHODS, Method, method_from
from ..scene import Scene, joined
from ..scenes import Mesh, Point, created, floor, moved
from .views import View

IMAGE = {"width": 96, "height": 54}
"""Pixels of the images."""

RESOLUTION = 512
"""Texels along each side of the maps."""

Vector: TypeAlias = npt.NDArray[np.float64]
Make: TypeAlias = Callable[[], View]


@dataclass(frozen=True)
class Case:
    """A view, made when it is needed.

    Attributes
    ----------
    family, name : str
        What is hard, and how hard it is.
    make : callable
        Gives scene, camera and light.
    of : callable, optional
        The same view without what is hard; its misclassified pixels are the bound for maps.
    truth : callable, optional
        A view with the same picture whose reference is the truth, where that of this one has
        little but ties.
    quick : bool
        Whether it is among the hardest of its family.
    """

    family: str
    name: str
    make: Make
    of: Make | None = None
    truth: Make | None = None
    quick: bool = True

    def __str__(self) -> str:
        return f"{self.family}, {self.name}"


def cases(families: Iterable[str] | None = None) -> list[Case]:
    """Every case, or those of some of `FAMILIES`; an unknown one is a `ValueError`."""
    chosen = list(FAMILIES) if families is None else list(families)
    for family in chosen:
        if family not in FAMILIES:
            raise ValueError(
                f"family must be one of {', '.join(FAMILIES)}, got {family!r}"
                f"{did_you_mean(family, FAMILIES)}"
            )
    return [case for family in chosen for case in FAMILIES[family](family)]


# --- The plain views ---


def _plain() -> View:
    """Boxes, spheres, tori and cones on a floor, from a little above."""
    scene = scenes.objects_on_floor(count=9, subdivisions=1)
    return scene, _camera((-3.1, 2.3, 4.2), (0.2, 0.3, 0.1)), scene.lights["default"]


def _point_light() -> View:
    scene, camera, _ = _plain()
    return scene, camera, PointLight((0.7, 2.9, 0.4))


PLAIN = {"directional light": _plain, "point light": _point_light}


def _camera(eye: Any, target: Any, **options: Any) -> Camera:
    return Camera.look_at(eye, target, **{"yfov": 0.8, **IMAGE, **options})


def _size(scene: Scene) -> float:
    low, high = scene.bounds
    return float(np.linalg.norm(high - low))


# --- Moved, scaled, other planes of depth ---


def _transformed(view: View, scale: float = 1.0, offset: Vector | None = None) -> View:
    scene, camera, light = view
    by = np.zeros(3) if offset is None else offset
    pose = camera.pose.copy()
    pose[:3, 3] = scale * pose[:3, 3] + by
    if isinstance(light, PointLight):
        light = PointLight(scale * light.position + by)
    return Scene(scale * scene.vertices + by, scene.faces), camera.posed(pose), light


def _moved_by(plain: Make, power: int) -> View:
    view = plain()
    return _transformed(view, offset=np.array([0.6, -0.48, 0.64]) * 10.0**power * _size(view[0]))


def _moved(family: str) -> Iterator[Case]:
    for (lit_by, plain), power in itertools.product(PLAIN.items(), range(1, 8)):
        make = partial(_moved_by, plain, power)
        yield Case(family, f"10^{power} sizes, {lit_by}", make, of=plain, quick=power == 7)


def _scaled_by(plain: Make, power: int) -> View:
    return _transformed(plain(), scale=10.0**power)


def _scaled(family: str) -> Iterator[Case]:
    hardest = {"directional light": 6, "point light": -6}
    powers = (-6, -4, -2, -1, 1, 2, 4, 6)
    for (lit_by, plain), power in itertools.product(PLAIN.items(), powers):
        make = partial(_scaled_by, plain, power)
        yield Case(family, f"10^{power}, {lit_by}", make, of=plain, quick=power == hardest[lit_by])


def _with_depth_range(power: int) -> View:
    scene, camera, light = _plain()
    far = 2.0 * _size(scene)
    near = far * 10.0**-power
    return scene, camera._replaced(znear=near, zfar=far), light


def _depth_range(family: str) -> Iterator[Case]:
    for power in (1, 2, 3, 4, 5, 6, 7, 14):
        make = partial(_with_depth_range, power)
        yield Case(family, f"far/near 10^{power}", make, of=_plain, quick=power in (1, 7, 14))


# --- Light ---


def _lit_by(light: Light) -> View:
    scene, camera, _ = _plain()
    return scene, camera, light


def _lights(family: str) -> Iterator[Case]:
    scene, camera, _ = _plain()
    forward = -camera.pose[:3, 2]
    spot = (0.7, 2.9, 0.4), (0.1, -1.0, 0.2)
    hard: dict[str, Light] = {
        "along the view": DirectionalLight(forward),
        "against the view": DirectionalLight(-forward),
        "at the eye": PointLight(camera.eye),
        "from below the floor": DirectionalLight((0.1, 1.0, 0.2)),
        "in a cone of 0.001 radians": SpotLight(*spot, 1e-3),
        "in a cone of pi / 2": SpotLight(*spot, math.pi / 2),
        "half of space": HemisphereLight((0.0, 0.9, 1.1), (1.0, 0.0, 0.0)),
    }
    others: dict[str, Light] = {
        f"along {name}": DirectionalLight(-axis)
        for name, axis in zip("xyz", np.eye(3), strict=True)
    }
    for degrees in (10.0, 1.0, 0.1, 0.01):
        angle, words = math.radians(degrees), f"light {degrees:g} degrees above the floor"
        sides = 0.8 * math.cos(angle), 0.6 * math.cos(angle)
        hard[f"directional {words}"] = DirectionalLight((sides[0], -math.sin(angle), sides[1]))
        low = PointLight((-7.2, 9.0 * math.tan(angle), -5.4))
        (hard if degrees < 0.1 else others)[f"point {words}"] = low
    for exponent in (2, 4, 6):
        near = PointLight((-0.4, 10.0**-exponent * _size(scene), 1.7))
        (hard if exponent == 6 else others)[f"10^-{exponent} above the floor"] = near
    for name, light in {**hard, **others}.items():
        yield Case(family, name, partial(_lit_by, light), quick=name in hard)
    yield Case(family, "inside a closed mesh, the eye outside", _light_in_a_ball)
    yield Case(family, "inside a closed mesh, and the eye", _all_in_a_ball)


def _far_away(kind: str, power: int | None) -> View:
    """Lit from so far that it is as good as a directional light; that one without a power."""
    scene, camera, _ = _plain()
    towards_light = np.array([0.3, 0.85, 0.35])
    if power is None:
        return scene, camera, DirectionalLight(-towards_light)
    position = towards_light * 10.0**power * _size(scene)
    lights: dict[str, Light] = {
        "point light": PointLight(position),
        "spot light": SpotLight(position, -towards_light, 0.4),
        "hemisphere light": HemisphereLight(position, -towards_light),
    }
    return scene, camera, lights[kind]


def _far_lights(family: str) -> Iterator[Case]:
    without = partial(_far_away, "", None)
    for kind in ("point light", "spot light", "hemisphere light"):
        for power in (2, 3, 6, 9, 12, 15):
            make = partial(_far_away, kind, power)
            name = f"{kind} 10^{power} sizes away"
            quick = power in (3, 9, 15) and kind == "point light"
            yield Case(family, name, make, of=without, quick=quick)


def _ball(centre: Point, radius: float) -> Mesh:
    return moved(created("icosphere", 2), scale=radius, to=centre)


def _floor(half_side: float, height: float = 0.0) -> Mesh:
    return moved(floor(half_side, half_side), to=(0.0, height, 0.0))


def _light_in_a_ball() -> View:
    scene = joined([_floor(4.0), _ball((0.0, 1.0, 0.0), 0.7)])
    return scene, _camera((-3.1, 2.3, 4.2), (0.0, 0.5, 0.0)), PointLight((0.1, 1.1, -0.1))


def _all_in_a_ball() -> View:
    scene = joined([_ball((0, 0, 0), 3.0), _ball((0.4, -0.5, 0.2), 0.4)])
    return (
        scene,
        _camera((-1.1, 0.3, 1.2), (0.4, -0.5, 0.2), yfov=1.4),
        PointLight((0.1, 1.6, -0.1)),
    )


# --- Suns along walls, lamps in their planes, low suns ---

SIDES = 8
"""Of the house: whichever multiple of 45 degrees a sun comes from, it runs along walls of it."""

APOTHEM, WALL, EAVES = 1.6, 2.0, 2.1
"""Of the house: from its middle to a wall, the height of the walls, and half the roof's width."""


def _around(apothem: float, height: float) -> Vector:
    """Corners of an octagon whose sides face 0, 45, 90, ... degrees of azimuth."""
    angle = np.radians(45.0 * np.arange(SIDES) + 22.5)
    radius = apothem / math.cos(math.pi / SIDES)
    # Walls that face along an axis lie across it, whatever sine and cosine round.
    sides = np.round(radius * np.array([np.sin(angle), np.cos(angle)]), 12)
    return np.column_stack([sides[0], np.full(SIDES, height), sides[1]])


def _prism(apothem: float, low: float, high: float, *, is_open: bool = False) -> Mesh:
    corners = np.concatenate([_around(apothem, low), _around(apothem, high)])
    here, there = np.arange(SIDES), np.roll(np.arange(SIDES), -1)
    faces = [np.column_stack([here, there, there + SIDES])]
    faces += [np.column_stack([here, there + SIDES, here + SIDES])]
    if not is_open:
        fan = np.column_stack([np.zeros(SIDES - 2, int), here[1:-1], there[1:-1]])
        faces += [fan[:, ::-1], fan + SIDES]
    return corners, np.concatenate(faces)


def _house_lit_by(light: Light) -> View:
    """Eight walls under a roof that juts out, in a yard with a low fence."""
    parts = [_floor(12.0), _prism(APOTHEM, 0.0, WALL), _prism(EAVES, WALL, 2.15)]
    scene = joined([*parts, _prism(4.0, 0.0, 0.9, is_open=True)])
    return scene, _camera((2.6, 2.1, 6.8), (0.0, 0.9, 0.0)), light


def sun_at(azimuth: float, elevation: float) -> DirectionalLight:
    """The sun at degrees from +Z towards +X, and above the floor."""
    a, e = math.radians(azimuth), math.radians(elevation)
    to_sun = math.sin(a) * math.cos(e), math.sin(e), math.cos(a) * math.cos(e)
    return DirectionalLight([-c for c in to_sun])


def _edge_on(family: str) -> Iterator[Case]:
    for elevation in (1.0, 15.0, 45.0, 89.9, 90.0):
        for azimuth in np.arange(0.0, 360.0, 45.0):
            turned = sun_at(azimuth + 1.0, min(elevation, 89.0))
            of = partial(_house_lit_by, turned)
            suns = {"": sun_at(azimuth, elevation)}
            if azimuth % 90.0 == 0.0 and elevation in (15.0, 90.0):
                # No component is left of what sine and cosine round.
                exact = np.where(
                    np.abs(suns[""].direction) < 1e-9, 0.0, np.asarray(suns[""].direction)
                )
                suns[", no rounding"] = DirectionalLight(exact)
            for words, sun in suns.items():
                name = f"sun at {azimuth:g} degrees, {elevation:g} above the floor{words}"
                quick = (azimuth, elevation) in ((0.0, 90.0), (90.0, 15.0), (135.0, 45.0))
                yield Case(family, name, partial(_house_lit_by, sun), of=of, quick=quick)
    for (azimuth, height), gap in itertools.product(
        ((0.0, 1.0), (45.0, 3.5), (90.0, 1.5), (315.0, 2.5)), (0.0, 1e-9, 1e-4)
    ):
        make = partial(_lamp_before_wall, azimuth, height, gap)
        of = partial(_lamp_before_wall, azimuth, height, 3.0 * math.radians(1.0))
        name = f"a lamp {gap:g} before the plane of the wall at {azimuth:g} degrees"
        yield Case(family, name, make, of=of, quick=gap == 1e-9)


def _lamp_before_wall(azimuth: float, height: float, gap: float) -> View:
    a = math.radians(azimuth)
    out, along = np.array([math.sin(a), math.cos(a)]), np.array([math.cos(a), -math.sin(a)])
    x, z = (APOTHEM + gap) * out + 3.0 * along
    return _house_lit_by(PointLight((x, height, z)))


def _blocks_lit_by(light: Light) -> View:
    """Blocks of many heights on a floor, from above."""
    random = np.random.default_rng(2)
    parts: list[tuple[Any, Any]] = [_floor(6.0)]
    for x, z in itertools.product((-4.0, -2.0, 0.0, 2.0, 4.0), repeat=2):
        height = random.uniform(0.2, 2.0)
        parts.append(moved(created("box"), scale=(0.8, height, 0.8), to=(x, height / 2, z)))
    return joined(parts), _camera((6.5, 7.0, 8.5), (0.0, 0.0, 0.0)), light


def _low_sun(family: str) -> Iterator[Case]:
    for azimuth in (110.0, 205.0):
        of = partial(_blocks_lit_by, sun_at(azimuth, 1.0))
        for degrees in (2.0, 0.5, 0.1, 0.03, 0.01, 1e-3, 1e-4):
            name = f"{degrees:g} degrees high, at {azimuth:g} degrees"
            make = partial(_blocks_lit_by, sun_at(azimuth, degrees))
            yield Case(family, name, make, of=of, quick=degrees in (0.03, 1e-3))


# --- Lights on surfaces, eyes far away ---


def _room_lit_from(position: Point) -> View:
    """Balls in a box with the light on it."""
    vertices, faces = created("box")
    room = np.multiply(np.add(vertices, [0.0, 0.5, 0.0]), [8.0, 3.0, 6.0]), faces
    balls = [_ball((1.1, 0.7, -0.9), 0.5), _ball((-0.7, 1.6, 0.8), 0.4)]
    camera = _camera((-3.6, 1.6, 2.6), (1.0, 0.9, -0.7), yfov=1.2)
    return joined([room, *balls]), camera, PointLight(position)


def _lights_on_surfaces(family: str) -> Iterator[Case]:
    places = {"ceiling": (0.7, 3.0, 0.4), "wall": (4.0, 1.9, 0.3), "corner": (4.0, 3.0, -3.0)}
    inwards = {"ceiling": (0, -1, 0), "wall": (-1, 0, 0), "corner": (-1, -1, 1)}
    for place, gap in itertools.product(places, (0.0, 1e-12, 1e-7, -1e-5)):
        x, y, z = np.add(places[place], np.multiply(gap, inwards[place])).tolist()
        where = f"{gap:g} before" if gap >= 0.0 else f"{-gap:g} behind"
        make = partial(_room_lit_from, (x, y, z))
        yield Case(family, f"{where} the {place}", make, quick=place == "ceiling")


def _from_far_away(sizes: float, plain: Make) -> View:
    """Through a lens that shows as much from everywhere."""
    scene, _, light = plain()
    eye = np.array([-0.6, 0.4, 0.7]) * sizes * _size(scene)
    yfov = 2.0 * math.atan(0.25 / sizes)
    return scene, _camera(eye, (0.2, 0.3, 0.1), yfov=yfov), light


def _far_cameras(family: str) -> Iterator[Case]:
    for (lit_by, plain), sizes in itertools.product(PLAIN.items(), (10.0, 100.0, 1000.0)):
        make = partial(_from_far_away, sizes, plain)
        yield Case(family, f"{sizes:g} sizes away, {lit_by}", make, quick=sizes == 1000.0)


# --- Geometry ---


def _seen(make: Callable[[], Scene], light: Light) -> View:
    return make(), _camera((-1.6, 1.7, 2.6), (0.05, 0.25, 0.0)), light


def _geometry(family: str) -> Iterator[Case]:
    for (name, make), (lit_by, light) in itertools.product(GEOMETRY.items(), LIGHTS.items()):
        # A triangle in the place of another is a tie with it, and so is all behind them.
        truth = partial(_seen, _few_objects, light) if make in REPEATED else None
        quick = lit_by == "directional light"
        yield Case(
            family, f"{name}, {lit_by}", partial(_seen, make, light), truth=truth, quick=quick
        )


LIGHTS: dict[str, Light] = {
    "directional light": DirectionalLight((0.55, -0.7, -0.35)),
    "point light": PointLight((-0.9, 1.9, 0.7)),
}


def _needles() -> Scene:
    """Spikes a million times as long as they are thick, and some of 400 times."""
    random = np.random.default_rng(1)
    parts: list[tuple[Any, Any]] = [_floor(2.0)]
    for i in range(60):
        foot, along = random.uniform(-1, 1, 3), random.normal(size=3)
        foot[1], along[1] = 0.2, abs(along[1])
        side = np.cross(along, random.normal(size=3))
        side *= (1e-6, 2.5e-3)[i % 2] / np.linalg.norm(side)
        parts.append(([foot, foot + side, foot + along], [[0, 1, 2]]))
    return joined(parts)


def _strip(first: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Two triangles for each pair of vertices and the next pair."""
    return np.concatenate([np.add(first, [0, 1, 2]), np.add(first, [1, 3, 2])])


def _slivers() -> Scene:
    """A sheet of strips, every other one a hundred thousand times as long as it is wide."""
    edges = np.sort(np.concatenate([np.linspace(-1, 1, 25), np.linspace(-1, 1, 25)[:-1] + 2e-5]))
    count = len(edges)
    vertices = [[x, 0.6 + 0.1 * x, z] for x in edges for z in (-0.9, 0.9)]
    first = 2 * np.arange(count - 1)[:, None]
    faces = _strip(first)
    return joined([_floor(2.0), (vertices, faces)])


def _t_junctions() -> Scene:
    """Large triangles beside small ones that end in the middle of their edges; coordinates that
    float32 does not hold."""
    parts: list[tuple[Any, Any]] = [_floor(2.0)]
    height = 0.7
    left = [[-1.0, height, -0.9], [0.1, height, -0.9], [0.1, height, 0.9], [-1.0, height, 0.9]]
    parts.append((left, [[0, 1, 2], [0, 2, 3]]))
    z = np.linspace(-0.9, 0.9, 8)
    right = [[x, height + 0.3 * (x - 0.1), t] for t in z for x in (0.1, 0.9)]
    first = 2 * np.arange(7)[:, None]
    parts.append((right, _strip(first)))
    return joined(parts)


def _coplanar_twins() -> Scene:
    """Two layers in one plane, one turned over, and a third in the plane of the floor."""
    sheet, faces = _floor(0.7, 0.5)
    twin = np.add(sheet, [0.3, 0.0, 0.2]), faces[:, ::-1]
    return joined([_floor(2.0), (sheet, faces), twin, _floor(0.5)])


def _few_objects() -> Scene:
    scene = scenes.objects_on_floor(count=4, subdivisions=0)
    return Scene(scene.vertices * 0.6, scene.faces)


def _duplicates() -> Scene:
    """Every triangle three times, once turned over."""
    scene = _few_objects()
    faces = scene.faces
    return Scene(scene.vertices, np.concatenate([faces, faces[:, ::-1], faces[:, [1, 2, 0]]]))


def _degenerate() -> Scene:
    """Triangles of zero area between others: points, lines, and three corners on one edge."""
    scene = _few_objects()
    points, lines = scene.faces[:, [0, 0, 0]], scene.faces[:, [0, 1, 0]]
    last = len(scene.vertices)
    vertices = np.concatenate([scene.vertices, [[-1, 0.5, 0], [0, 0.5, 0], [1, 0.5, 0]]])
    on_a_line = [[last, last + 1, last + 2]]
    return Scene(vertices, np.concatenate([points, scene.faces, lines, on_a_line]))


def _open_mesh() -> Scene:
    """A ball without its top, so that its inner side is lit and seen."""
    vertices, faces = _ball((0.0, 0.7, 0.0), 0.65)
    return joined([_floor(2.0), (vertices, faces[vertices[faces].mean(axis=1)[:, 1] < 1.0])])


def _non_manifold() -> Scene:
    """Seven triangles that share one edge, like the pages of a book."""
    angle = np.linspace(0.1, 3.0, 7)
    spine = [[0.0, 0.1, -0.8], [0.0, 0.1, 0.8]]
    corners = [[math.cos(a), 0.1 + math.sin(a), z] for a in angle for z in (-0.8, 0.8)]
    first = 2 + 2 * np.arange(len(angle))
    pages = np.concatenate([[[0, i, 1] for i in first], [[1, i, i + 1] for i in first]])
    return joined([_floor(2.0), (np.array(spine + corners), pages)])


GEOMETRY: dict[str, Callable[[], Scene]] = {
    "needles": _needles,
    "slivers": _slivers,
    "T-junctions": _t_junctions,
    "coplanar twins": _coplanar_twins,
    "every triangle three times": _duplicates,
    "triangles of zero area": _degenerate,
    "an open mesh": _open_mesh,
    "a mesh that is no manifold": _non_manifold,
}

REPEATED = (_duplicates, _degenerate)
"""Scenes whose picture is that of `_few_objects`."""


# --- Huge and tiny, shapes of images ---


def _ball_on(ground: Mesh, light: Light) -> View:
    scene = joined([ground, _ball((0.0, 0.5, 0.0), 0.4)])
    return scene, _camera((-1.6, 1.2, 2.1), (0.1, 0.2, 0.0)), light


def _floors(family: str) -> Iterator[Case]:
    for (lit_by, light), power in itertools.product(LIGHTS.items(), (2, 4, 6)):
        make = partial(_ball_on, _floor(10.0**power), light)
        # The reference grants float32 the rounding of a triangle's corners, a share of their
        # distance: all of a huge triangle may be ties. Those of a floor in rings are few.
        truth = partial(_ball_on, _cut_floor(power), light)
        name = f"10^{power} objects wide, {lit_by}"
        yield Case(family, name, make, truth=truth, quick=power == 6)


def _cut_floor(power: int) -> Mesh:
    """A floor of 10^power in rings, each ten times as wide as the next smaller one."""
    corners = np.concatenate(
        [_floor(10.0**p)[0] for p in np.arange(power, 0, -1)] + [_floor(4.0)[0]]
    )
    around, inner = np.arange(4), np.roll(np.arange(4), -1)
    faces = [_floor(1.0)[1] + len(corners) - 4]
    for ring in range(0, len(corners) - 4, 4):
        a, b, c, d = ring + around, ring + inner, ring + 4 + inner, ring + 4 + around
        faces += [np.column_stack([a, b, c]), np.column_stack([a, c, d])]
    return corners, np.concatenate(faces)


def _sized(width: int, height: int) -> View:
    scene, camera, light = _plain()
    return scene, camera.resized(width, height), light


def _angled(angle: float) -> View:
    scene, _, light = _plain()
    return scene, _camera((-3.1, 2.3, 4.2), (0.2, 0.0, 0.1), yfov=angle), light


def _stretched() -> View:
    scene, camera, light = _plain()
    focal = (40.0 * camera.focal[0], camera.focal[1])
    return scene, camera._replaced(focal=focal), light


def _images(family: str) -> Iterator[Case]:
    for width, height in ((1, 1), (1, 400), (700, 1), (2, 3), (900, 4), (3, 500), (67, 41)):
        yield Case(family, f"{width} x {height} pixels", partial(_sized, width, height))
    for angle in (1e-4, 1e-2, 2.8, 3.1):
        yield Case(family, f"{angle:g} radians high", partial(_angled, angle))
    yield Case(family, "pixels 40 times as high as wide", _stretched)


FAMILIES: dict[str, Callable[[str], Iterator[Case]]] = {
    "moved": _moved,
    "scaled": _scaled,
    "depth range": _depth_range,
    "light": _lights,
    "far light": _far_lights,
    "edge-on": _edge_on,
    "low sun": _low_sun,
    "light on a surface": _lights_on_surfaces,
    "far camera": _far_cameras,
    "geometry": _geometry,
    "huge floor": _floors,
    "image": _images,
}
"""What is hard, by name."""


# --- What renders them ---

WITHOUT_MAP = tuple(name for name, method in METHODS.items() if method().map_resolution is None)
"""Methods that have no texels."""


# Cases come one after the other, each with every method.
@functools.lru_cache(maxsize=4)
def made(make: Make) -> View:
    """The view that a case makes; the last ones are kept."""
    return make()


def methods_for(case: Case, names: Iterable[str] | None = None) -> list[Method]:
    """The methods that take the case's light, maps with `RESOLUTION` texels along a side."""
    light = made(case.make)[2]
    chosen: list[Any] = [method_from(name) for name in (METHODS if names is None else names)]
    sized = [
        method if method.name in WITHOUT_MAP else dataclasses.replace(method, resolution=RESOLUTION)
        for method in chosen
    ]
    return [method for method in sized if method.takes(light)]
