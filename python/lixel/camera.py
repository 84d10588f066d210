"""The camera: it looks along its own -Z, as in glTF, from a pinhole or along parallel rays."""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Protocol, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import finite, real, reals, size, unit_vector

if TYPE_CHECKING:
    import trimesh


class _Geometry(Protocol):
    """What a camera asks of a scene."""

    @property
    def bounds(self) -> npt.NDArray[np.float64]: ...


@dataclass(frozen=True, init=False, repr=False, eq=False)
class Camera:
    """A camera, immutable: a pinhole, or orthographic, whose rays are parallel.

    Camera space is glTF's: x to the right, y up, the view along -Z. Image coordinates are in
    pixels, x to the right, y down, origin at the top left *corner*; the centre of pixel
    ``[row, column]`` is at ``(column + 0.5, row + 0.5)``.

    Parameters
    ----------
    pose : (4, 4) float
        Camera-to-world: a rotation and a translation, in world units.
    yfov : float
        Vertical angle of view in radians, in (0, pi), of a pinhole. Give either `yfov` or `focal`.
    focal : float or (2,) float
        Focal lengths (x, y) in pixels, instead of `yfov`; of an orthographic camera pixels per
        world unit.
    centre : (2,) float, optional
        Principal point (x, y) in image coordinates; the middle of the image if None.
    width, height : int
        Size of the image in pixels.
    znear : float, optional
        Surfaces nearer than this depth, in world units along the view, are not seen. If None, each
        render takes it from the scene: half of the least depth of the scene's box, but not less
        than a billionth of the box's diagonal, or 0 of an orthographic camera.
    zfar : float
        Surfaces beyond this depth are not seen.
    is_orthographic : bool
        Whether the rays are parallel; `orthographic` makes such a camera from the size of its view.

    Raises
    ------
    TypeError, ValueError
        The message names the argument, the rule and the value.

    Examples
    --------
    >>> camera = Camera.look_at((0, 2, 5), (0, 0, 0), yfov=1.0, width=1920, height=1080)
    >>> camera.eye
    array([0., 2., 5.])
    """

    pose: npt.NDArray[np.float64]
    focal: tuple[float, float]
    centre: tuple[float, float]
    width: int
    height: int
    znear: float | None
    zfar: float
    is_orthographic: bool

    def __init__(
        self,
        pose: npt.ArrayLike,
        *,
        yfov: float | None = None,
        focal: float | tuple[float, float] | npt.ArrayLike | None = None,
        centre: tuple[float, float] | npt.ArrayLike | None = None,
        width: SupportsIndex,
        height: SupportsIndex,
        znear: float | None = None,
        zfar: float = math.inf,
        is_orthographic: bool = False,
    ) -> None:
        width, height = size(width, height)
        if (yfov is None) == (focal is None):
            raise TypeError(
                "a camera takes either yfov (radians) or focal (pixels), "
                f"got yfov {yfov!r} and focal {focal!r}"
            )
        if yfov is not None:
            if is_orthographic:
                raise TypeError("an orthographic camera has no yfov, give focal in pixels per unit")
            yfov = real("yfov", yfov)
            # The tangent of the least numbers above 0 is 0.
            if not (0.0 < yfov < math.pi and math.tan(0.5 * yfov) > 0.0):
                raise ValueError(f"yfov must be an angle in radians in (0, pi), got {yfov}")
            focal = 0.5 * height / math.tan(0.5 * yfov)
        if np.ndim(focal) == 0:  # type: ignore[arg-type]
            focal = (focal, focal)  # type: ignore[assignment]
        world_from_camera = reals("pose", pose, 4, 4).copy()
        world_from_camera.flags.writeable = False
        near = None if znear is None else real("znear", znear)
        far = real("zfar", zfar)
        if not far > 0.0:
            raise ValueError(f"zfar must be greater than 0, got {far}")
        middle = (width / 2, height / 2) if centre is None else _pair("centre", centre)
        lens = (_pair("focal", focal), middle, width, height, near, far, bool(is_orthographic))
        for field, value in zip(
            (*_FIELDS, "_compiled"), (world_from_camera, *lens, None), strict=True
        ):
            object.__setattr__(self, field, value)
        # The rest of the rules are the core's. Without a near plane, any valid one serves.
        self._with_znear(min(1.0, 0.5 * far) if near is None else near)

    # --- Other ways to make one ---

    @classmethod
    def look_at(
        cls,
        eye: npt.ArrayLike,
        target: npt.ArrayLike,
        up: npt.ArrayLike = (0.0, 1.0, 0.0),
        *,
        yfov: float | None = None,
        ymag: float | None = None,
        width: SupportsIndex,
        height: SupportsIndex,
        znear: float | None = None,
        zfar: float = math.inf,
    ) -> Camera:
        """A camera at `eye` that has `target` in the middle of its image.

        Parameters
        ----------
        eye, target : (3,) float
            Points in world space; they must differ.
        up : (3,) float
            Direction in world space that points up in the image, any length but zero, not along
            the view.
        yfov, width, height, znear, zfar
            As for `Camera`.
        ymag : float, optional
            Instead of `yfov`, of an `orthographic` camera.

        Raises
        ------
        TypeError
            Not one of `yfov` and `ymag`.
        ValueError
            `eye` equals `target`, or `up` is zero or along the view.
        """
        start, end = finite("eye", eye, 3), reals("target", target, 3)
        if np.array_equal(start, end):
            raise ValueError(f"target must differ from eye, got {start.tolist()} for both")
        forward = unit_vector("target", end - start)
        upward = unit_vector("up", up)
        side = np.cross(forward, upward)
        # Below this the roll of the image would be made of rounding errors.
        if np.linalg.norm(side) < 1e-8:
            raise ValueError(
                "up must not be parallel to the view from eye to target, "
                f"got up {upward.tolist()} and view {forward.tolist()}"
            )
        right = unit_vector("up", side)
        pose = pose_of(start, forward, right)
        if (yfov is None) == (ymag is None):
            raise TypeError(
                "a camera takes either yfov (radians) or ymag (world units), "
                f"got yfov {yfov!r} and ymag {ymag!r}"
            )
        image: dict[str, Any] = {"width": width, "height": height, "znear": znear, "zfar": zfar}
        if ymag is not None:
            return cls.orthographic(pose, ymag=ymag, **image)
        return cls(pose, yfov=yfov, **image)

    @classmethod
    def orthographic(
        cls,
        pose: npt.ArrayLike,
        *,
        ymag: float | None = None,
        xmag: float | None = None,
        width: SupportsIndex,
        height: SupportsIndex,
        znear: float | None = None,
        zfar: float = math.inf,
    ) -> Camera:
        """A camera whose rays are parallel, as for maps, plans and solar studies.

        What is farther away is as large. Nothing behind the camera's own place is seen.

        Parameters
        ----------
        pose : (4, 4) float
            Camera-to-world: a rotation and a translation, in world units. The image is around it.
        ymag, xmag : float, optional
            Half the height and half the width of the view in world units, as glTF's and pyrender's.
            Of one alone pixels are square.
        width, height, znear, zfar
            As for `Camera`; `znear` may be 0.

        Raises
        ------
        TypeError, ValueError
            Neither `ymag` nor `xmag`, or one that is not positive and finite.

        Examples
        --------
        >>> from_above = Camera.look_at((0, 9, 0), (0, 0, 0), (0, 0, -1), ymag=5, width=8, height=4)
        >>> from_above.project([(1, 0, 0)])
        array([[4.4, 2. , 9. ]])
        """
        width, height = size(width, height)
        halves = {"xmag": (xmag, width), "ymag": (ymag, height)}
        scales = []
        for name, (half, pixels) in halves.items():
            if half is not None:
                half = real(name, half)
                if not 0.0 < half < math.inf:
                    raise ValueError(f"{name} must be positive and finite, got {half}")
                scales.append(0.5 * pixels / half)
        if not scales:
            raise TypeError("an orthographic camera takes ymag, xmag or both, got neither")
        return cls(
            pose,
            focal=(scales[0], scales[-1]),
            width=width,
            height=height,
            znear=znear,
            zfar=zfar,
            is_orthographic=True,
        )

    @classmethod
    def from_intrinsics(
        cls,
        intrinsics: npt.ArrayLike,
        pose: npt.ArrayLike,
        width: SupportsIndex,
        height: SupportsIndex,
        *,
        znear: float | None = None,
        zfar: float = math.inf,
    ) -> Camera:
        """A camera from its matrix of intrinsics.

        Parameters
        ----------
        intrinsics : (3, 3) float
            ``[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`` in pixels, no skew. The origin is the top left
            corner of the image; for a matrix of OpenCV, whose origin is the centre of the first
            pixel, add 0.5 to cx and cy.
        pose : (4, 4) float
            Camera-to-world, looking along -Z with y up. A pose of OpenCV looks along +Z with y
            down: multiply it by ``diag(1, -1, -1, 1)`` from the right.
        width, height, znear, zfar
            As for `Camera`.
        """
        matrix = reals("intrinsics", intrinsics, 3, 3)
        rest = matrix[[0, 1, 2, 2, 2], [1, 0, 0, 1, 2]]
        if not np.array_equal(rest, [0, 0, 0, 0, 1]):
            raise ValueError(
                "intrinsics must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew, "
                f"got {matrix.tolist()}"
            )
        lens: dict[str, Any] = {"focal": matrix[[0, 1], [0, 1]], "centre": matrix[:2, 2]}
        return cls(pose, **lens, width=width, height=height, znear=znear, zfar=zfar)

    @classmethod
    def from_pyrender(
        cls,
        camera: Any,
        pose: npt.ArrayLike | None = None,
        width: SupportsIndex = 640,
        height: SupportsIndex = 480,
    ) -> Camera:
        """A camera of pyrender, or a node that holds one.

        Parameters
        ----------
        camera : pyrender.PerspectiveCamera, IntrinsicsCamera, OrthographicCamera or Node
            Of an orthographic one pyrender takes `ymag`, and `xmag` from the shape of the image.
        pose : (4, 4) float, optional
            Camera-to-world. A node alone gives its own matrix; where it has a parent, pass
            ``scene.get_pose(node)``.
        width, height : int
            Size of the image in pixels: the viewport of the renderer.

        Raises
        ------
        TypeError
            Another kind of camera, or no pose.
        """
        held = getattr(camera, "camera", None)
        if held is not None:
            pose, camera = camera.matrix if pose is None else pose, held
        if pose is None:
            raise TypeError("pose must be given with a camera that is not in a node")
        zfar = getattr(camera, "zfar", None)
        depths: dict[str, Any] = {
            "znear": getattr(camera, "znear", None),
            "zfar": math.inf if zfar is None else zfar,
        }
        if hasattr(camera, "fx"):
            intrinsics = [[camera.fx, 0, camera.cx], [0, camera.fy, camera.cy], [0, 0, 1]]
            return cls.from_intrinsics(intrinsics, pose, width, height, **depths)
        if hasattr(camera, "ymag"):
            return cls.orthographic(pose, ymag=camera.ymag, width=width, height=height, **depths)
        if not hasattr(camera, "yfov"):
            raise TypeError(
                "camera must be a pyrender PerspectiveCamera, IntrinsicsCamera or "
                f"OrthographicCamera, got {type(camera).__name__}"
            )
        made = cls(pose, yfov=camera.yfov, width=width, height=height, **depths)
        aspect = getattr(camera, "aspectRatio", None)
        if aspect is None:
            return made
        # An aspect ratio of its own stretches the image where it is not the size's.
        if not (math.isfinite(aspect) and aspect > 0.0):
            raise ValueError(f"aspect ratio must be finite and greater than 0, got {aspect}")
        fy = made.focal[1]
        return made._replaced(focal=(fy * made.width / (made.height * aspect), fy))

    @classmethod
    def from_trimesh(
        cls,
        camera: trimesh.Scene | trimesh.scene.cameras.Camera,
        pose: npt.ArrayLike | None = None,
        *,
        znear: float | None = None,
        zfar: float = math.inf,
    ) -> Camera:
        """The camera of a trimesh scene, or a ``trimesh.scene.Camera`` with a pose.

        Parameters
        ----------
        camera : trimesh.Scene or trimesh.scene.Camera
            A scene without a camera gets the one that trimesh makes, which sees all of it.
        pose : (4, 4) float, optional
            Camera-to-world; a scene knows it already.
        znear, zfar : float
            As for `Camera`. Those of trimesh are not taken: its own rays ignore them.
        """
        import trimesh

        if isinstance(camera, trimesh.Scene):
            # The camera first: trimesh makes one, and its transform, on the first access.
            held = camera.camera
            pose, camera = camera.camera_transform if pose is None else pose, held
        if not isinstance(camera, trimesh.scene.cameras.Camera):
            raise TypeError(
                "camera must be a trimesh.Scene or a trimesh.scene.Camera, "
                f"got {type(camera).__name__}"
            )
        if pose is None:
            raise TypeError("pose must be given with a camera that is not in a scene")
        width, height = (int(n) for n in camera.resolution)
        return cls.from_intrinsics(camera.K, pose, width, height, znear=znear, zfar=zfar)

    def resized(self, width: SupportsIndex, height: SupportsIndex) -> Camera:
        """The same camera with another image size: the vertical extent of the view and the shape of
        a pixel stay, the horizontal extent follows."""
        width, height = size(width, height)
        scale = height / self.height
        focal = (self.focal[0] * scale, self.focal[1] * scale)
        across = width / 2 + (self.centre[0] - self.width / 2) * scale
        centre = (across, self.centre[1] * scale)
        return self._replaced(focal=focal, centre=centre, width=width, height=height)

    def posed(self, pose: npt.ArrayLike) -> Camera:
        """The same camera elsewhere.

        Parameters
        ----------
        pose : (4, 4) float
            Camera-to-world, a rotation and a translation.
        """
        return self._replaced(pose=pose)

    def _replaced(self, **changes: Any) -> Camera:
        """The same camera with other values for some of its fields."""
        return Camera(**{name: getattr(self, name) for name in _FIELDS} | changes)

    # --- What it knows of itself ---

    @property
    def eye(self) -> npt.NDArray[np.float64]:
        """(3,) float64: the pinhole in world space; where an orthographic camera is."""
        return np.array(self.pose[:3, 3])

    @property
    def yfov(self) -> float:
        """Vertical angle of view in radians, of an image centred on the axis; 0 if orthographic."""
        if self.is_orthographic:
            return 0.0
        return 2.0 * math.atan(0.5 * self.height / self.focal[1])

    def sights_of(self, points: npt.NDArray[np.floating]) -> npt.NDArray[np.float64]:
        """Along the rays that see points in world space, (..., 3) each, of any length."""
        if self.is_orthographic:
            return np.broadcast_to(-self.pose[:3, 2], points.shape)
        return points - self.eye

    @property
    def intrinsics(self) -> npt.NDArray[np.float64]:
        """(3, 3) float64: ``[[fx, 0, cx], [0, fy, cy], [0, 0, 1]]`` in pixels; of an orthographic
        camera it takes (x, y, 1) to the image."""
        (fx, fy), (cx, cy) = self.focal, self.centre
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    def project(self, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
        """Where points of the world appear in the image.

        Parameters
        ----------
        points : (N, 3) float
            In world space, such as ``frame.position[frame.covered]``.

        Returns
        -------
        (N, 3) float64
            Column and row in image coordinates, in pixels, whether inside of the image or not; and
            depth along the view, in world units. Column and row are NaN where the depth is not
            greater than 0. The near and the far plane play no part.

        Raises
        ------
        TypeError, ValueError
            The message names the argument, the rule and the value.
        """
        x, y, z = ((reals("points", points, "N", 3) - self.eye) @ self.pose[:3, :3]).T
        # What is divided by: of parallel rays nothing, but behind the camera there is no image.
        width = np.where(z < 0.0, 1.0 if self.is_orthographic else -z, np.nan)
        column = self.centre[0] + self.focal[0] * x / width
        row = self.centre[1] - self.focal[1] * y / width
        return np.stack([column, row, -z], axis=1)

    def _key(self) -> tuple[Any, ...]:
        pose = tuple(self.pose.ravel().tolist())
        return pose, *(getattr(self, name) for name in _FIELDS[1:])

    def __eq__(self, other: object) -> bool:
        return self._key() == other._key() if isinstance(other, Camera) else NotImplemented

    def __hash__(self) -> int:
        return hash(self._key())

    def __repr__(self) -> str:
        return (
            f"Camera({self.pose.tolist()}, focal={self.focal}, centre={self.centre}, "
            f"width={self.width}, height={self.height}, znear={self.znear}, "
            # repr of an infinite float is no expression
            f"zfar={'math.inf' if math.isinf(self.zfar) else self.zfar}"
            f"{', is_orthographic=True' if self.is_orthographic else ''})"
        )

    def __reduce__(self) -> tuple[Any, ...]:
        fields = {name: getattr(self, name) for name in _FIELDS}
        return functools.partial(Camera, **fields), ()

    # --- For the core ---

    def _core_for(self, scene: _Geometry) -> _core.Camera:
        """The compiled camera, with a near plane that suits the scene where none was given."""
        return self._with_znear(self._znear_for(scene) if self.znear is None else self.znear)

    def _znear_for(self, scene: _Geometry) -> float:
        bounds = scene.bounds
        # By plain numbers: for three of them numpy's calls are most of the time.
        x, y, z = (
            min((least - axis[3]) * -axis[2], (greatest - axis[3]) * -axis[2])
            for least, greatest, axis in zip(*bounds.tolist(), self.pose.tolist(), strict=False)
        )
        nearest = float(x + y + z)
        diagonal = bounds[1] - bounds[0]
        least = max(1e-9 * math.sqrt(float(diagonal.dot(diagonal))), 1e-30)
        znear = max(0.5 * nearest, 0.0 if self.is_orthographic else least)
        return min(znear, 0.5 * self.zfar)

    def _with_znear(self, znear: float) -> _core.Camera:
        compiled: tuple[float, _core.Camera] | None = self.__dict__["_compiled"]
        if compiled is None or compiled[0] != znear:
            camera = _core.Camera(
                self.pose,
                self.focal,
                self.centre,
                (self.width, self.height),
                (znear, self.zfar),
                self.is_orthographic,
            )
            compiled = (znear, camera)
            # The same object for the same scene, so that the core knows what it has seen.
            object.__setattr__(self, "_compiled", compiled)
        return compiled[1]


_FIELDS = tuple(field.name for field in fields(Camera))


def pose_of(
    eye: npt.NDArray[np.float64], forward: npt.NDArray[np.float64], right: npt.NDArray[np.float64]
) -> npt.NDArray[np.float64]:
    """Camera-to-world, (4, 4), from a point and two unit vectors at a right angle, (3,) each."""
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(right, forward), -forward, eye], axis=1)
    return pose


def _pair(name: str, value: Any) -> tuple[float, float]:
    x, y = reals(name, value, 2).tolist()
    return x, y
