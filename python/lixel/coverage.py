"""Shadows of several samples in each pixel: what filtered and antialiased shadows are judged by."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import count, instance
from .camera import Camera
from .frame import check_view, chosen_method, is_on_gpu, render_shadows, thread_count
from .light import Light
from .likeness import Likeness
from .methods import Exact, Method
from .pictures import display
from .reference import reference
from .scene import Scene

WRONG = (220, 32, 24)

MAX_TOGETHER = 64
"""Samples of a pixel that the CPU engine has together, at most."""

GOLDEN = 0.5 * (math.sqrt(5.0) - 1.0)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Coverage:
    """The lit share of each pixel, by samples that each see a surface of their own.

    Attributes
    ----------
    visibility : (H, W) float32
        Of the samples that see a surface, the share that is lit, in [0, 1]; NaN where none sees
        one.
    surface : (H, W) float32
        The share of the samples that see a surface.
    tie : (H, W) float32
        Of the samples that see a surface, the share whose truth float64 or float32 leaves open; 0
        where a method rendered, which knows no ties.
    samples : int
        How many each pixel has.
    scene, camera, light
        What was rendered.
    """

    visibility: npt.NDArray[np.float32]
    surface: npt.NDArray[np.float32]
    tie: npt.NDArray[np.float32]
    samples: int
    scene: Scene
    camera: Camera
    light: Light

    @property
    def covered(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: where a sample sees a surface."""
        return self.surface > 0.0

    def __repr__(self) -> str:
        height, width = self.visibility.shape
        partly = (self.visibility > 0.0) & (self.visibility < 1.0)
        return (
            f"<lixel.Coverage: {width} x {height}, {self.samples} samples, "
            f"{int(np.count_nonzero(self.covered)):,} pixels covered, "
            f"{int(np.count_nonzero(partly)):,} partly lit>"
        )

    def _repr_png_(self) -> bytes:
        return display.png_bytes(display.shadow_picture(self.visibility))


def coverage(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method | None = None,
    *,
    samples: SupportsIndex = 32,
    device: str | None = None,
    threads: SupportsIndex | None = None,
) -> Coverage:
    """Render several samples for each pixel, each at its own place of the image.

    What a pixel's area sees of a hard shadow is between lit and dark at edges; this is the truth
    for filtered maps, for antialiasing, and for a renderer that takes many samples. Wyman et al.
    (2015) render so with a frustum-traced irregular z-buffer; here the camera is moved by parts of
    a pixel, so that any method can. The samples are a Fibonacci lattice around the pixel's centre,
    the same in every pixel and at every call; one sample is the centre.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    light : Light
    method : str or method object, optional
        What renders the samples, as for `render_shadows`. None: the float64 `reference`.
    samples : int
        Of each pixel.
    device, threads : optional
        As for `render_shadows`; of no effect where the reference renders.

    Returns
    -------
    Coverage

    Raises
    ------
    TypeError, ValueError
        As `render_shadows`; or `samples` below 1.

    References
    ----------
    C. Wyman, R. Hoetzlein, A. Lefohn: Frustum-traced raster shadows: revisiting irregular
    z-buffers. I3D 2015.

    Examples
    --------
    >>> import lixel as lx
    >>> scene = lx.scenes.plane_and_box()
    >>> view = scene, scene.cameras["default"].resized(96, 64), scene.lights["default"]
    >>> truth = lx.coverage(*view, samples=16)
    >>> soft = lx.DesiredView(resolution=256, lookup=lx.Pcf(radius=1.0, samples=16))
    >>> lx.compare(lx.render_shadows(*view, soft), truth).mean_absolute_error < 0.02
    True
    """
    check_view(scene, camera, light)
    number = count("samples", samples)
    chosen = None if method is None else chosen_method(method, device)
    if isinstance(chosen, Exact) and not is_on_gpu(device):
        return _coverage_of_engine(scene, camera, light, number, thread_count(threads))
    # As narrow as the number allows: bytes are added up in a quarter of the time of int32.
    shape, counted = (camera.height, camera.width), np.min_scalar_type(number)
    lit, seen, open_ = (np.zeros(shape, counted) for _ in range(3))
    for moved in cameras_of_samples(camera, number):
        if method is None:
            truth = reference(scene, moved, light)
            visibility = truth.visibility
            open_ += (truth.covered & (truth.tie | truth.float32_tie)).view(np.uint8)
        else:
            visibility = render_shadows(scene, moved, light, method, device=device, threads=threads)
        lit += (visibility == 1.0).view(np.uint8)
        seen += (~np.isnan(visibility)).view(np.uint8)
    return _coverage_of_counts((scene, camera, light), number, lit, seen, open_)


def _coverage_of_counts(
    view: tuple[Scene, Camera, Light],
    samples: int,
    lit: npt.NDArray[Any],
    seen: npt.NDArray[Any],
    open_: npt.NDArray[Any] | None = None,
) -> Coverage:
    scene, camera, light = view
    of_seen = np.maximum(seen, 1).astype(np.float32)
    tie = np.zeros(lit.shape, np.float32)
    if open_ is not None:
        tie = (open_ / of_seen).astype(np.float32)
    return Coverage(
        visibility=np.where(seen > 0, lit / of_seen, np.nan).astype(np.float32),
        surface=(seen / samples).astype(np.float32),
        tie=tie,
        samples=samples,
        scene=scene,
        camera=camera,
        light=light,
    )


def _coverage_of_engine(
    scene: Scene, camera: Camera, light: Light, samples: int, threads: int | None
) -> Coverage:
    """That of `Exact` on the CPU engine, which has the samples of a pixel together."""
    shape, places = (camera.height, camera.width), sample_places(samples)
    lit, seen = (np.zeros(shape, np.min_scalar_type(samples)) for _ in range(2))
    for first in range(0, samples, MAX_TOGETHER):
        some = [(x, y) for x, y in places[first : first + MAX_TOGETHER].tolist()]
        found = _core.count_samples(
            scene._core, camera._core_for(scene), light._core, some, threads
        )
        lit += found["lit"]
        seen += found["seen"]
    return _coverage_of_counts((scene, camera, light), samples, lit, seen)


def cameras_of_samples(camera: Camera, samples: int) -> Iterator[Camera]:
    """Cameras whose pixels' centres are samples of the camera's pixels."""
    x, y = camera.centre
    for dx, dy in sample_places(samples):
        yield camera._replaced(centre=(x - dx, y - dy))


def sample_places(samples: int) -> npt.NDArray[np.float64]:
    """(samples, 2) float64: columns and rows of a Fibonacci lattice around a pixel's centre, in
    [-0.5, 0.5)."""
    numbers = np.arange(samples) - 0.5 * (samples - 1)
    columns, rows = numbers / samples, numbers * GOLDEN
    return np.stack([columns, rows - np.floor(rows + 0.5)], axis=1)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class CoverageComparison(Likeness):
    """An image of shares against a `Coverage`. All that costs time is computed on first use.

    Attributes
    ----------
    difference : (H, W) float32
        Image minus truth, nearer to 0 by what ties leave open; 0 where one of the two sees nothing.
    covered : (H, W) bool
        Where both see a surface.
    other_surface : (H, W) bool
        Where only one of them does: on the rims of objects, where one sample is not all of a pixel.
    samples : int
        Of the truth.
    """

    difference: npt.NDArray[np.float32]
    samples: int
    _pictures: tuple[npt.NDArray[np.float32], npt.NDArray[np.float32]]

    _NUMBERS: ClassVar[tuple[str, ...]] = (
        "mean_absolute_error", "rmse", "beyond_count", "rate_beyond", "ssim", "covered_count",
        "other_surface_count", "samples",
    )  # fmt: skip

    @cached_property
    def mean_absolute_error(self) -> float:
        """Mean of the absolute difference over covered pixels; 0 where there are none."""
        return float(np.abs(self.difference, dtype=np.float64).sum() / max(self.covered_count, 1))

    @cached_property
    def rmse(self) -> float:
        """Root of the mean squared difference over covered pixels, in [0, 1]; 0 where there are
        none."""
        squares = np.square(self.difference, dtype=np.float64).sum()
        return math.sqrt(squares / max(self.covered_count, 1))

    @cached_property
    def beyond(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: off by more than one sample."""
        # What float32 rounds of a share is far below a part of a sample.
        return np.abs(self.difference) > (1.0 + 1e-3) / self.samples

    @property
    def beyond_count(self) -> int:
        """Pixels that are off by more than one sample."""
        return int(np.count_nonzero(self.beyond))

    @property
    def rate_beyond(self) -> float:
        """Those over covered pixels, in [0, 1]; 0 where nothing is covered."""
        return self.beyond_count / max(self.covered_count, 1)

    def _both(self) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        return self._pictures

    def picture(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3) uint8: the image, redder where it is wrong."""
        image = np.where(self.covered, self._pictures[0], np.nan).astype(np.float32)
        picture = display.shadow_picture(image)
        share = np.abs(self.difference)[..., None]
        mixed = picture * (1.0 - share) + np.array(WRONG) * share
        return np.asarray(np.round(mixed), np.uint8)

    def __str__(self) -> str:
        return (
            f"mean absolute error {self.mean_absolute_error:.4f}, RMSE {self.rmse:.4f}; "
            f"{self.beyond_count:,} of {self.covered_count:,} covered pixels off by more than one "
            f"of {self.samples} samples"
        )


def compare_shares(image: npt.NDArray[Any], truth: Coverage) -> CoverageComparison:
    """An image of shares against the truth, of the same shape."""
    instance("reference", truth, Coverage)
    has_surface = ~np.isnan(image)
    covered = has_surface & truth.covered
    difference = np.where(covered, image - truth.visibility, 0.0).astype(np.float32)
    open_ = np.where(covered, truth.tie, 0.0)
    difference = np.sign(difference) * np.maximum(np.abs(difference) - open_, 0.0)
    pictures = [np.where(covered, values, 1.0) for values in (image, truth.visibility)]
    return CoverageComparison(
        difference=difference.astype(np.float32),
        covered=covered,
        other_surface=has_surface != truth.covered,
        samples=truth.samples,
        _pictures=(pictures[0].astype(np.float32), pictures[1].astype(np.float32)),
    )
