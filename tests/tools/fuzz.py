"""Try inputs of every wrong kind: each is refused in words, or gives a right picture.

`python tests/tools/fuzz.py --cases 1000000` runs for long; test_fuzz.py runs some with hypothesis.
A case is a function of a source of random numbers; a failure of the long run prints its seed, and
`--seed SEED --cases 1` runs it again.
"""

from __future__ import annotations

import argparse
import math
import random
import sys
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np
from fuzz_files import file

import lixel as lx
from lixel import _core
from lixel.lab import hard_views

REFUSALS = (ValueError, TypeError, lx.DeviceError)
"""What a wrong input may raise; anything else, and above all a panic, is a fault."""

# --- Values ---

NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 2, 3, 7, 64, 255, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**63, -(2**63), 2**64, 10**30,
    0.0, -0.0, 0.5, -0.5, 1.0, 1.5, 1e-3, 1e-30, 5e-324, 1e10, 1e30, 1e31, 1e38, 1e308, -1e308,
    math.pi, math.pi / 2, math.inf, -math.inf, math.nan,
)  # fmt: skip

OTHERS: tuple[Any, ...] = (
    None, True, False, "", "auto", "1", "nan", "\x00", "é" * 50, b"\xff", 1j, object(), Ellipsis,
    NotImplemented, [], (), {}, set(), [[]], [None], [1, [2, 3]], ["a", "b", "c"], range(3),
    np.float16(1), np.float32(1.5), np.float64("nan"), np.int8(-1), np.uint64(2**64 - 1),
    np.bool_(1), lambda: 0, np.datetime64("2020"), np.str_("x"), np.array(None), np.array("x"),
    np.array(1.0), np.array([]),
    np.zeros((0, 3)), np.zeros((3, 0)), np.zeros((2, 2, 2)), np.zeros(3, "M8[s]"),
    np.zeros(2, [("x", "f4")]), np.ma.masked, np.longdouble(1) * 10**400,
)  # fmt: skip

DTYPES = (
    "f2",
    "<f4",
    ">f4",
    "<f8",
    ">f8",
    "g",
    "i1",
    "u1",
    "<i4",
    ">i8",
    "<u8",
    "c8",
    "?",
    "O",
    "U3",
)


def number(r: random.Random) -> Any:
    if r.random() < 0.5:
        return r.choice(NUMBERS)
    return r.choice(
        [r.uniform(-10, 10), r.uniform(-1, 1) * 10.0 ** r.randint(-300, 300), r.randint(-99, 99)]
    )


def value(r: random.Random) -> Any:
    """Anything at all."""
    kind = r.random()
    if kind < 0.4:
        return number(r)
    if kind < 0.7:
        return r.choice(OTHERS)
    return array(r, [r.randint(0, 4) for _ in range(r.randint(0, 3))])


def array(r: random.Random, shape: Any) -> Any:
    """Numbers of any type, in a layout that is hard, or as lists."""
    values = np.array([number(r) for _ in range(int(np.prod(shape)))], dtype=object).reshape(shape)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            made = np.asarray(values.astype(r.choice(DTYPES) if r.random() < 0.5 else "f8"))
        except (ValueError, TypeError, OverflowError):
            return values.tolist()
    return laid_out(r, made)


def laid_out(r: random.Random, made: Any) -> Any:
    """The same numbers as lists, in steps, backwards, in another byte order, read-only, or in
    memory that another array owns."""
    layout = r.randrange(7)
    if layout == 0:
        return made.tolist()
    if layout == 1:
        made = np.asfortranarray(made)
    elif layout == 2 and made.ndim:
        made = np.repeat(made, 2, axis=0)[::2]
    elif layout == 3 and made.ndim:
        made = np.ascontiguousarray(made[::-1])[::-1]
    elif layout == 4 and made.ndim and len(made):
        made = np.lib.stride_tricks.as_strided(made.copy(), made.shape, made.strides)
    elif layout == 5 and made.dtype.kind in "fiu":
        made = made.astype(made.dtype.newbyteorder())
    if layout == 6 or r.random() < 0.2:
        made = made.copy()
        made.flags.writeable = False
    return made


def vector(r: random.Random) -> Any:
    return array(r, [3]) if r.random() < 0.8 else value(r)


def some(r: random.Random, **arguments: Callable[[random.Random], Any]) -> dict[str, Any]:
    """A choice of keyword arguments."""
    return {name: make(r) for name, make in arguments.items() if r.random() < 0.5}


# --- Cases ---


def scene(r: random.Random) -> None:
    count, faces = r.randint(0, 6), r.randint(0, 4)
    vertices = array(r, [count, 3]) if r.random() < 0.8 else value(r)
    indices = np.array(
        [[r.randint(-1, count) for _ in range(3)] for _ in range(faces)],
        dtype=r.choice("ilhIL" if not faces else "ilh"),
    )
    indices = laid_out(r, indices.reshape(faces, 3)) if r.random() < 0.8 else value(r)
    made = lx.Scene(vertices, indices)
    assert np.isfinite(made.vertices).all()
    assert (made.faces < len(made.vertices)).all()
    np.testing.assert_array_equal(made.vertices, np.asarray(vertices).astype(np.float64))
    made.update_vertices(value(r))


def layouts(r: random.Random) -> None:
    """However numbers lie in memory, they are the same numbers."""
    points = np.array([[r.randint(-9, 9) for _ in range(3)] for _ in range(6)]).astype(
        r.choice(["f4", "f8", "i4"])
    )
    faces = np.array([[0, 1, 2], [3, 4, 5]], dtype=r.choice(["i4", "u4", "i8", "u8", "i2"]))
    made = lx.Scene(laid_out(r, points), laid_out(r, faces))
    np.testing.assert_array_equal(made.vertices, points)
    np.testing.assert_array_equal(made.faces, faces)


def camera(r: random.Random) -> None:
    options = some(r, yfov=number, width=number, height=number, znear=number, zfar=number)
    kind = r.randrange(5)
    if kind == 0:
        made = lx.Camera.look_at(vector(r), vector(r), **some(r, up=vector), **options)
    elif kind == 1:
        pose = np.eye(4)
        pose[r.randrange(4), r.randrange(4)] = float(number(r))
        options = some(r, focal=value, centre=value) | options
        made = lx.Camera(laid_out(r, pose) if r.random() < 0.9 else value(r), **options)
    elif kind == 2:
        intrinsics = [[r.uniform(1, 99), 0, number(r)], [0, r.uniform(1, 99), number(r)], [0, 0, 1]]
        made = lx.Camera.from_intrinsics(intrinsics, np.eye(4), value(r), value(r))
    elif kind == 3:
        made = lx.Camera(np.eye(4), yfov=1.0, width=8, height=8).resized(value(r), value(r))
    else:
        made = lx.Camera(np.eye(4), yfov=1.0, width=8, height=8).posed(value(r))
    assert np.isfinite(made.eye).all()
    assert made.width > 0
    assert made.height > 0
    assert eval(repr(made), {"Camera": lx.Camera, "math": math}) == made


def light(r: random.Random) -> Any:
    kind = r.randrange(4)
    if kind == 0:
        return lx.DirectionalLight(vector(r))
    if kind == 1:
        return lx.PointLight(vector(r))
    if kind == 2:
        return lx.SpotLight(vector(r), vector(r), value(r))
    return lx.HemisphereLight(vector(r), vector(r))


def method(r: random.Random) -> Any:
    name = r.choice(list(lx.METHODS))
    if r.random() < 0.2:
        texts = [r.choice(list(lx.METHODS)), "+", "notw", "", " ", "none", "\x00", "auto"]
        return lx.method_from(
            "".join(r.choices(texts, k=r.randint(0, 4))) if r.random() < 0.9 else value(r)
        )
    kind = lx.METHODS[name]
    fields = list(kind().parameters())
    return kind(
        **{r.choice([*fields, "colour"]): value(r) for _ in range(r.randint(0, 3))}
        if fields
        else {}
    )


def core(r: random.Random) -> None:
    """The extension module by itself, which whoever skips the facade calls."""
    s, c, li = VIEW
    arguments = (s._core, c._core_for(s), li._core)
    name = r.choice(list(lx.METHODS))
    fields = [*lx.METHODS[name]().parameters(), "colour"]
    parameters = {r.choice(fields): value(r) for _ in range(r.randint(1, 3))}
    sides = parameters.get("resolution")
    if isinstance(sides, int) and not isinstance(sides, bool):
        parameters["resolution"] = min(sides, 512)
    elif isinstance(sides, (list, tuple)) and all(type(side) is int for side in sides):
        parameters["resolution"] = tuple(min(side, 512) for side in sides)
    kind = r.randrange(4)
    if kind == 0:
        _core.Scene(value(r), value(r))
    elif kind == 1:
        _core.Camera(
            array(r, [4, 4]),
            (number(r), number(r)),
            (number(r), number(r)),
            (number(r), number(r)),
            (number(r), number(r)),
        )
    elif kind == 2:
        _core.Light.spot(vector(r), vector(r), number(r))
    else:
        _core.surface(s._core, arguments[1], value(r))


def given(r: random.Random) -> None:
    """Light matrices and warps of one's own, many of them nearly right."""
    g = np.random.default_rng(r.getrandbits(32))
    bent = np.eye(4)
    bent[np.ix_([0, 1, 3], [0, 1, 3])] += 10.0 ** r.uniform(-6, 3) * g.normal(size=(3, 3))
    matrix = r.choice(
        [
            array(r, [4, 4]),
            MATRIX * 10.0 ** r.uniform(-320, 300),
            MATRIX + 10.0 ** r.uniform(-12, 0) * g.normal(size=(4, 4)),
            MATRIX[g.permutation(4)],
            bent @ MATRIX,
            [bent @ MATRIX, MATRIX],
        ]
    )
    planes = 10.0 ** r.uniform(-200, 200) * g.normal(size=(r.randrange(6), 4))
    regions = r.choice([None, None, [planes], [planes, []], value(r)])
    made: Any = lx.LightMatrix(matrix, regions=regions, resolution=r.choice([1, 33]))
    functions = np.sort(g.random((2, r.randint(1, 4), r.randint(2, 9))), axis=-1)
    functions[..., 0], functions[..., -1] = 0.0, r.choice([1.0, 1.0, 2.0, np.nan])
    kind = r.randrange(4)
    if kind == 1:
        made = lx.NonOrthogonalWarp(fit=made, resolution=33, importance_resolution=8)
    elif kind == 2:
        made = lx.GivenWarp(functions, fit=r.choice([made, "lispsm"]), resolution=33)
    elif kind == 3:
        made = lx.GivenWarp(array(r, r.choice([[2, 3, 5], [1, 2, 3, 5]])), resolution=33)
    visibility = lx.render(*VIEW, made, device="cpu").visibility
    assert (np.isnan(visibility) | (visibility == 0.0) | (visibility == 1.0)).all()


def masks(r: random.Random) -> None:
    """Alpha images, where they lie on triangles, and which triangle has which; what is taken is
    seen alike by `exact` and by the reference."""
    g = np.random.default_rng(r.getrandbits(32))
    s, c, li = VIEW

    def alpha(_: random.Random) -> Any:
        shape = (r.choice([1, 1, 2, 3, 17]), r.choice([1, 2, 5]))
        image = g.integers(0, 256, shape).astype(r.choice(["u1", "u1", "u1", "?"]))
        return lx.AlphaMask(
            laid_out(r, image) if r.random() < 0.8 else value(r),
            **some(
                r,
                cutoff=lambda r: r.uniform(0, 1) if r.random() < 0.8 else value(r),
                wrap=lambda r: r.choice(["repeat", "mirror", "clamp", ("clamp", "mirror"), "x", 1]),
                sampling=lambda r: r.choice(["linear", "nearest", "nearest", "cubic"]),
            ),
        )

    kind = r.random()
    uv = g.normal(size=(len(s.vertices), 2)) * 10.0 ** r.uniform(-3, 3)
    if kind < 0.3:
        uv = array(r, [len(s.vertices), 2])
    elif kind < 0.5:
        uv = g.normal(size=(s.triangle_count, 3, 2))
    images = [alpha(r) for _ in range(r.randint(1, 3))]
    numbers = g.integers(-1, len(images) + (r.random() < 0.1), s.triangle_count)
    made = lx.Scene(
        s.vertices,
        s.faces,
        uv=uv if r.random() < 0.95 else value(r),
        alpha=images if r.random() < 0.95 else value(r),
        face_alpha=numbers if r.random() < 0.95 else value(r),
    )
    assert made.masked_count <= made.triangle_count
    visibility = lx.render_shadows(made, c, li, "exact", device="cpu")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # many ties, where an alpha is the cutoff
        assert not lx.compare(visibility, lx.reference(made, c, li)).misclassified_count


def compared(r: random.Random) -> None:
    shape = [r.randint(0, 4), r.randint(0, 4)]
    lx.compare(
        array(r, shape) if r.random() < 0.7 else value(r),
        array(r, shape) if r.random() < 0.7 else value(r),
    ).as_dict()


def arguments(r: random.Random) -> None:
    """Arguments of the wrong kind in every place of the functions that render."""
    view = [x if r.random() < 0.6 else value(r) for x in (*VIEW, "uniform")]
    function = r.choice(
        [lx.render, lx.render_shadows, lx.reference, lx.importance_map, lx.warp_map]
    )
    if function is lx.reference:
        view.pop()
    if view[:3] == list(VIEW) and function in (lx.importance_map, lx.warp_map):
        return
    if function is not lx.reference and r.random() < 0.3:
        function(*view, device=r.choice(["cpu", "no adapter", value(r)]))
    function(*view)


def points(r: random.Random) -> None:
    warp = WARP if r.random() < 0.6 else value(r)
    shape = [r.randint(0, 4), 2]
    function = r.choice([lx.warp_points, lx.unwarp_points])
    function(warp, array(r, shape) if r.random() < 0.7 else value(r))


def picture(r: random.Random) -> None:
    """What is accepted is right: nothing but 0, 1 and NaN, and no wrong pixel of `exact`."""
    seed = r.getrandbits(32)
    g = np.random.default_rng(seed)
    scale = 10.0 ** r.randint(-5, 5)
    count = r.randint(1, 20)
    triangles = g.normal(size=(count, 1, 3)) + g.normal(size=(count, 3, 3)) * 10.0 ** g.uniform(
        -6, 0.5, (count, 1, 1)
    )
    if r.random() < 0.3:
        triangles = np.round(triangles)
    if r.random() < 0.3:
        triangles[:, :, r.randrange(3)] *= 1e-4
    offset = scale * 10.0 ** r.randint(0, 6) * g.normal(size=3) if r.random() < 0.3 else np.zeros(3)
    s = lx.Scene(scale * triangles.reshape(-1, 3) + offset, np.arange(3 * count).reshape(-1, 3))
    eye = scale * g.normal(size=3) * 10.0 ** r.uniform(-2, 1.5) + offset
    width, height = r.randint(1, 40), r.randint(1, 40)
    c = lx.Camera.look_at(
        eye, offset, g.normal(size=3), yfov=r.uniform(0.01, 3.0), width=width, height=height
    )
    place = scale * g.normal(size=3) * 10.0 ** r.uniform(-3, 2) + offset
    kind = r.randrange(4)
    if kind == 0:
        li: lx.Light = lx.DirectionalLight(g.normal(size=3))
    elif kind == 1:
        li = lx.PointLight(place)
    elif kind == 2:
        li = lx.SpotLight(place, offset - place, r.uniform(1e-3, math.pi / 2))
    else:
        li = lx.HemisphereLight(place, g.normal(size=3))
    name = r.choice(["exact", "ray_traced", *lx.METHODS])
    chosen = lx.method_from(name)
    if name not in hard_views.WITHOUT_MAP:
        shapes = [] if name == "virtual" else [(1, 70), (129, 3)]
        chosen = type(chosen)(resolution=r.choice([1, 2, 33, 128, *shapes]))
    if not chosen.takes(li):
        return
    device = r.choice(["cpu", None])
    visibility = lx.render_shadows(s, c, li, chosen, device=device)
    assert visibility.shape == (height, width)
    assert (np.isnan(visibility) | (visibility == 0.0) | (visibility == 1.0)).all()
    truth = lx.reference(s, c, li)
    found = lx.compare(visibility, truth, other_surfaces="count")
    if name in ("exact", "ray_traced"):
        assert not found.misclassified_count, f"{found} by {name} on {device}, seed {seed}"
    # No map moves a surface.
    assert not found.other_surface.any(), f"surfaces, seed {seed}"


VIEW = (
    lx.scenes.plane_and_box(),
    lx.Camera.look_at((4, 5, 8), (0, 0.5, 0), yfov=0.9, width=8, height=6),
    lx.DirectionalLight((1.0, -1.5, -0.5)),
)
MATRIX = lx.LightMatrix.of(lx.render(*VIEW, "lispsm", device="cpu")).matrix[0]
WARP = np.linspace(0.0, 1.0, 5)[None].repeat(6, axis=0).reshape(2, 3, 5)

QUICK = (scene, layouts, camera, light, method, core, given, masks, compared, arguments, points)
SLOW = (file, picture)


def attempt(case: Callable[[random.Random], Any], r: random.Random) -> bool:
    """Runs a case; whether its input was taken. What is refused is refused in words."""
    try:
        case(r)
    except REFUSALS as error:
        if not str(error).strip():
            raise AssertionError(f"no words: {error!r}") from error
        return False
    except OSError:
        assert case is file
        return False
    except OverflowError:
        # pyo3's word for an integer that its type does not hold; the facade has looked before.
        assert case is core
        return False
    return True


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cases", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--slow", type=float, default=0.01, help="share of cases that render or load"
    )
    parser.add_argument("--only", help="one kind of case")
    options = parser.parse_args()
    warnings.simplefilter("error")
    np.seterr(all="ignore")
    counts: Counter[str] = Counter()
    faults = 0
    start = time.time()
    for seed in range(options.seed, options.seed + options.cases):
        r = random.Random(seed)
        case = r.choice(SLOW if r.random() < options.slow else QUICK)
        if options.only is not None:
            case = globals()[options.only]
        began = time.time()
        try:
            taken = attempt(case, r)
        except KeyboardInterrupt:
            raise
        except BaseException:  # a panic is no Exception
            faults += 1
            print(f"seed {seed}, {case.__name__}:", file=sys.stderr)
            traceback.print_exc()
            if faults == 20:
                break
            continue
        if time.time() - began > 10.0:
            print(f"seed {seed}, {case.__name__}: {time.time() - began:.0f} s", file=sys.stderr)
        counts[f"{case.__name__}, {'taken' if taken else 'refused'}"] += 1
    for name, count in sorted(counts.items()):
        print(f"{name}: {count:,}")
    print(f"{sum(counts.values()):,} cases in {time.time() - start:.0f} s, {faults} faults")
    return int(faults > 0)


if __name__ == "__main__":
    sys.exit(main())
