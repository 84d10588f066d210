"""Frames along a path, one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sized
from dataclasses import fields, replace
from typing import Any, SupportsIndex, cast

import numpy as np
import numpy.typing as npt

from .arguments import instance
from .camera import Camera
from .frame import Frame, chosen_method, render
from .light import LIGHTS, Light
from .methods import Method
from .points import SECONDS_BEFORE_BAR
from .scene import Scene


def render_sequence(
    scene: Scene,
    cameras: Camera | Iterable[Camera],
    lights: Light | Iterable[Light],
    method: str | Method | None = None,
    *,
    vertices: Iterable[npt.ArrayLike] | None = None,
    flicker: bool = False,
    progress: bool = True,
    device: str | None = None,
    threads: SupportsIndex | None = None,
    **parameters: Any,
) -> Iterator[Frame]:
    """The frames of a path, each when it is asked for, so that a long one needs no more memory.

    A method with a parameter `previous` (`RectilinearWarp`, `NonOrthogonalWarp`, `SceneOptimized`,
    or one of one's own) gets the frame before as that, from the second frame on.

    Parameters
    ----------
    scene : Scene
    cameras : Camera, or iterable of them
        One for all frames, or one for each.
    lights : Light, or iterable of them
        Likewise.
    method, device, threads, **parameters
        As for `render`.
    vertices : iterable of (n, 3) arrays, optional
        Of the scene in each frame, see `Scene.update_vertices`.
    flicker : bool
        Count in ``stats``, from the second frame on, the ``matched_pixels``, whose place the frame
        before shows, too, and the ``changed_pixels`` among them, whose visibility is another now.
        Shadows that truly move are among these; ``lixel lab flicker`` tells them apart.
    progress : bool
        Show a bar on stderr where it takes longer than two seconds; how many frames there will be
        is known where `cameras`, `lights` or `vertices` have a length.

    Yields
    ------
    Frame

    Raises
    ------
    ValueError
        Nothing but single cameras and lights, or iterables that end at different frames.
    ValueError, TypeError, DeviceError
        As for `render`.

    Examples
    --------
    >>> import lixel as lx
    >>> scene = lx.scenes.plane_and_box()
    >>> camera = scene.cameras["default"].resized(32, 18)
    >>> path = [lx.DirectionalLight((0.1 * i, -1.0, 0.3)) for i in range(3)]
    >>> [frame.visibility.shape for frame in lx.render_sequence(scene, camera, path, "exact")]
    [(18, 32), (18, 32), (18, 32)]
    """
    instance("scene", scene, Scene)
    chosen = chosen_method(method, device, parameters)
    one: dict[str, Any] = {}
    many: dict[str, Iterator[Any]] = {}
    given = {
        "cameras": (cameras, (Camera,)),
        "lights": (lights, LIGHTS),
        "vertices": (vertices, ()),
    }
    for name, (value, kinds) in given.items():
        if isinstance(value, kinds) or (value is None and name == "vertices"):
            one[name] = value
        elif isinstance(value, Iterable):
            many[name] = iter(value)
        else:
            words = "".join(f"a lixel.{kind.__name__} or " for kind in kinds)
            raise TypeError(
                f"{name} must be {words}an iterable of them, got {type(value).__name__}"
            )
    if not many:
        raise ValueError("cameras, lights or vertices must be one for each frame, got single ones")
    frames = _frames(scene, chosen, one, many, {"device": device, "threads": threads})
    if flicker:
        frames = _with_flicker(frames)
    every: tuple[object, ...] = (cameras, lights, vertices)
    lengths = [len(value) for value in every if isinstance(value, Sized)]
    return _with_bar(frames, min(lengths, default=None)) if progress else frames


def _with_bar(frames: Iterator[Frame], total: int | None) -> Iterator[Frame]:
    from tqdm import tqdm

    with tqdm(desc="frames", total=total, leave=False, delay=SECONDS_BEFORE_BAR) as bar:
        for frame in frames:
            bar.update()
            yield frame


def _with_flicker(frames: Iterator[Frame]) -> Iterator[Frame]:
    last: Frame | None = None
    for frame in frames:
        if last is not None:
            here, there = frame.pixels_seen_by(last)
            changed = frame.visibility.ravel()[here] != last.visibility.ravel()[there]
            frame.stats["matched_pixels"] = here.size
            frame.stats["changed_pixels"] = int(np.count_nonzero(changed))
        yield frame
        last = frame


def _frames(
    scene: Scene,
    method: Method,
    one: dict[str, Any],
    many: dict[str, Iterator[Any]],
    on: dict[str, Any],
) -> Iterator[Frame]:
    follows = any(known.name == "previous" for known in fields(method))
    previous: Any = method.parameters().get("previous")
    end = object()
    while True:
        values = {name: next(values, end) for name, values in many.items()}
        ended = [name for name, value in values.items() if value is end]
        if ended:
            if len(ended) < len(values):
                raise ValueError(
                    f"{', '.join(values)} must be as many, got fewer {' and '.join(ended)}"
                )
            return
        of_frame = {**one, **values}
        if of_frame["vertices"] is not None:
            scene.update_vertices(of_frame["vertices"])
        # Not the last frame's own method, which holds the frame before that.
        current = cast(Method, replace(cast(Any, method), previous=previous)) if follows else method
        frame = render(scene, of_frame["cameras"], of_frame["lights"], current, **on)
        if follows:
            previous = replace(frame, method=method)
        yield frame
