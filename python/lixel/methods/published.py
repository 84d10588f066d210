"""The methods as the papers have them: every value, and where it stands.

The values are data. `ShadowMethod.published`, names such as ``"rtw@published"``, the pages of the
site and `lixel lab departures` read them here. Sections, tables and equations are those of the
paper that the entry is of, unless another is named.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

from ..arguments import did_you_mean

PUBLISHED_NAME = "published"
"""What follows the ``@`` of a method's name for the paper that `PUBLISHED` lists first."""

PAPERS: Mapping[str, str] = MappingProxyType(
    {
        "rosen-2012": 'P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping", '
        "I3D 2012",
        "milet-2015": 'T. Milet, J. Navrátil, P. Zemčík, "An improved non-orthogonal texture '
        'warping for better shadow rendering", WSCG 2015',
        "navratil": "J. Navrátil, doctoral thesis, Brno University of Technology",
        "vanek-2011": 'J. Vanek, J. Navrátil, A. Herout, P. Zemčík, "High-quality shadows with '
        'improved paraboloid mapping", ISVC 2011',
        "chong-2007": 'H. Y. Chong, S. J. Gortler, "Scene optimized shadow mapping", Harvard '
        "TR-07-07, 2007",
    }
)
"""The papers by the names that `published(paper=...)` takes."""


class PublishedValue(NamedTuple):
    """A parameter's value in a paper."""

    value: Any
    """What the parameter is set to."""
    source: str
    """Where the paper says so, or what it leaves open."""
    is_open: bool = False
    """The paper leaves it open; the value is lixel's choice."""


Values: TypeAlias = Mapping[str, PublishedValue]


def _in(value: Any, source: str) -> PublishedValue:
    return PublishedValue(value, source)


def _open(value: Any, source: str) -> PublishedValue:
    return PublishedValue(value, source, is_open=True)


def _straight(source: str) -> dict[str, PublishedValue]:
    """Rasterization of maps that keep lines straight."""
    return {
        "rasterization": _in("linear", source),
        "tessellation": _in(None, "lines stay straight in this map"),
    }


def _from(paper: str, values: Values) -> dict[str, PublishedValue]:
    """What a paper takes from another one, whose sections these are."""
    return {
        name: given._replace(source=f"{paper}, {given.source}") for name, given in values.items()
    }


UNROTATED = _in(0.0, "no rotation of the light's image plane is described")

# --- Rosen ---

_ROSEN: dict[str, PublishedValue] = {
    "resolution": _in(2048, "section 6: 2,048 x 2,048 unless otherwise noted"),
    "lookup": _in("depth", "section 4.4: as in conventional shadow mapping"),
    "bias": _in("constant", "section 6: the shadow bias was fixed by hand"),
    "constant_bias": _open(None, "section 6: fixed by hand, its value is not given; here a texel"),
}
_ROSEN_PLANE = {
    **_ROSEN,
    **_straight("section 3: conventional textures, rasterized by the hardware"),
    "rotation": UNROTATED,
}
_ROSEN_RTW: dict[str, PublishedValue] = {
    **_ROSEN,
    "rasterization": _in("linear", "sections 4.3 and 6.1: the corners are warped"),
    "tessellation": _in(
        0.025, "section 6.1: 2.5 % of the map struck a good balance; Table 3 has 5 %, 1 % and none"
    ),
    "importance": _in(
        "desired_view*distance", "sections 5.1 and 5.2; Figure 3 adds the shadow edge, Figure 6 "
        "the normal"
    ),
    "analysis": _in("backward", "section 4.1 has three; Table 3 and section 6.4 have backward"),
    "fit": _in(
        "uniform", "sections 4.1 and 4.2: a grid along the light's image plane, whose rows and "
        "columns without importance are culled"
    ),
    "rotation": _in(0.0, "section 7: a rotation of the image plane was never pursued"),
    "blur": _in(3.0, "section 6.1: sigma = 3 texels of the warping map"),
    "importance_resolution": _in(512, "section 6: all importance maps were 512 x 512"),
    "analysis_resolution": _in(512, "section 6: the depth image was always 512 x 512"),
    "edge_floor": _in(0.001, "section 5.3: alpha = 0.001"),
    "edge_bias": _open(
        None, "section 5.3: the shadow bias, whose value is not given; here two texels of the "
        "depth image"
    ),
    "normal_bonus": _in(2.0, "section 5.4: beta = 2.0"),
    "previous": _in(None, "section 5.5: temporal blending was found unnecessary"),
}  # fmt: skip

# --- Milet, Navrátil, Zemčík, and the thesis ---

_MILET: dict[str, PublishedValue] = {
    "resolution": _in(512, "Table 1: maps of 512 x 512"),
    "lookup": _in("depth", "section 1: the shadow mapping algorithm of Williams"),
    "bias": _open("constant", "no bias is named"),
    "constant_bias": _open(None, "no bias is named; here a texel"),
}
_MILET_STRAIGHT = {**_MILET, **_straight("section 4.1: the linear rasterization unit")}
_MILET_PLANE = {**_MILET_STRAIGHT, "rotation": UNROTATED}
_MILET_WARP: dict[str, PublishedValue] = {
    **_MILET,
    "rasterization": _in("linear", "section 3.1, algorithm 1: the corners are warped"),
    "tessellation": _open(
        0.01, "section 4.1: adaptive tessellation, as Rosen's; its factor is not given"
    ),
    "rotation": UNROTATED,
}
_MILET_RTW = {
    **_from("Rosen", _ROSEN_RTW),
    **_MILET_WARP,
    "importance": _in("desired_view*distance", "section 4: both functions in all images"),
    "analysis": _in("backward", "section 4: RTW with backward analysis"),
    "fit": _in(
        "uniform", "section 3.2: RTW finds the desired view from the importance map's first and "
        "last rows and columns"
    ),
}  # fmt: skip
_MILET_NOTW: dict[str, PublishedValue] = {
    **_MILET_WARP,
    "importance": _in("count", "section 3: the number of view samples"),
    "importance_resolution": _in(None, "section 3: the resolution of the shadow map"),
    "function_count": _in(None, "section 3.1, Eq. 6: a function for every row and every column"),
    "exponent": _in(1.0, "section 3.1, Eq. 1: the number of view samples itself"),
    "even_share": _in(0.0, "section 3.1, Eq. 4: the whole offset g(x) / N - x"),
    "smoothing": _open(
        None, "sections 3.1 and 4.1: a weighted average among the functions, whose window was set "
        "by hand; here a thirty-second of the cells, see NonOrthogonalWarp"
    ),
    "fit": _in("desired_view", "section 3.2: DV by parallel reduction, before the importance map"),
}  # fmt: skip

_THESIS: dict[str, PublishedValue] = {
    "resolution": _in(512, "Table 5.3: maps of 512 x 512"),
    "lookup": _in("depth", "section 2.3.1: the depth in the map is compared"),
    "bias": _in("constant", "section 2.3.2: some bias is added to the surface"),
    "constant_bias": _open(None, "section 2.3.2: its value is not given; here a texel"),
}
_THESIS_STRAIGHT = {**_THESIS, **_straight("section 5.4.1: the linear rasterization unit")}
_THESIS_PLANE = {**_THESIS_STRAIGHT, "rotation": UNROTATED}
_THESIS_WARP: dict[str, PublishedValue] = {
    **_THESIS,
    "rasterization": _in("linear", "sections 4.1.3 and 5.4.1: the corners are warped"),
    "tessellation": _open(
        0.01, "section 5.4.1: adaptive tessellation, as Rosen's; its factor is not given"
    ),
    "rotation": UNROTATED,
}
_THESIS_RTW = {
    **_from("Rosen", _ROSEN_RTW),
    **_THESIS_WARP,
    "importance": _in(
        "desired_view*distance", "section 5.3.2: the desired view is among the functions by "
        "default; the distance as in Milet et al., section 4"
    ),
    "analysis": _in("backward", "section 4.1.2: the fastest of the three"),
    "fit": _in("uniform", "section 4.1.5: RTW finds the desired view from the importance map's "
               "first and last rows and columns"),
}  # fmt: skip
_THESIS_NOTW: dict[str, PublishedValue] = {
    **_THESIS_WARP,
    "importance": _in("count", "section 4.1.3: the number of view samples"),
    "importance_resolution": _in(None, "section 4.1.3: the resolution of the shadow map"),
    "function_count": _in(None, "section 4.1.4, Eq. 4.6: a function for every row and column"),
    "exponent": _in(1.0, "section 4.1.4, Eq. 4.1: the number of view samples itself"),
    "even_share": _in(0.0, "section 4.1.4, Eq. 4.4: the whole offset g(x) / N - x"),
    "smoothing": _open(
        None, "sections 4.1.4 and 5.4.1: a window set by hand for each scene; here a thirty-second "
        "of the cells, see NonOrthogonalWarp"
    ),
    "fit": _in("desired_view", "section 4.1.5: DV by parallel reduction"),
}  # fmt: skip
_THESIS_OMNIDIRECTIONAL: dict[str, PublishedValue] = {
    **_THESIS,
    "resolution": _open(512, "section 5.3 names no size; that of the other experiments"),
}
_THESIS_PARABOLOIDS: dict[str, PublishedValue] = {
    **_THESIS_OMNIDIRECTIONAL,
    "rasterization": _in("linear", "section 3.3.2: mapped only in the vertex shader"),
    "tessellation": _open(0.01, "section 3.3.2: the scene needs to be finely tessellated"),
    "cut": _in("hemisphere", "section 3.3.2: each paraboloid captures one hemisphere"),
    "splitting": _in("light", "section 3.3.2: by the position and the orientation of the light"),
}  # fmt: skip
_OMNIDIRECTIONAL: dict[str, PublishedValue] = {
    "resolution": _open(512, "section 5.3 names no size; that of the other experiments"),
    "rotation": _in(None, "the axes are those of the faces or of the halves"),
}

# --- Vanek et al. ---

_VANEK: dict[str, PublishedValue] = {
    "resolution": _in(1024, "section 5: 1024 x 1024 was sufficient for all scenes; Table 1 has "
                      "512 x 512 and 2048 x 2048"),
    "lookup": _in("depth", "section 2: the shadow maps algorithm of Williams"),
    "bias": _open("constant", "no bias is named"),
    "constant_bias": _open(None, "no bias is named; here a texel"),
}  # fmt: skip
_VANEK_PARABOLOID: dict[str, PublishedValue] = {
    **_VANEK,
    "rasterization": _in("linear", "section 3.1: the projection is done in the vertex shader"),
    "tessellation": _open(
        0.01, "section 4: hardware tessellation, finer towards the rim; its factor is not given"
    ),
}

# --- Chong and Gortler ---

_CHONG: dict[str, PublishedValue] = {
    "resolution": _in(400, "section 3: maps of 400 x 400"),
    "lookup": _in("depth", "section 2.1: positions and z-buffer values"),
    "bias": _open("constant", "no bias is named"),
    "constant_bias": _open(None, "no bias is named; here a texel"),
    **_straight("section 2.1: a 4 x 4 matrix, rasterized by the hardware"),
}
_CHONG_FRUSTUM: dict[str, PublishedValue] = {
    **_CHONG,
    "fit": _in("frustum", "section 3: the view frustum, projected and intersected"),
    "margin": _open(0.02, "section 2.4 grows only the rectangle of the samples, slightly"),
}

_CASCADES: dict[str, PublishedValue] = {
    **_ROSEN_PLANE,
    "layers": _in(4, "section 6.4: 4 cascades"),
    "splits": _open(
        "practical", "section 6.4: a basic implementation, whose planes are not given; Milet et "
        "al., section 2, name the practical splits"
    ),
    "boxes": _in("slabs", "section 6.4: the view frustum is split; section 2 tells sample "
                 "distribution shadow maps apart"),
    "weight": _open(0.5, "Milet et al., section 2: the average of logarithmic and uniform splits"),
}  # fmt: skip

PUBLISHED: Mapping[str, Mapping[str, Values]] = MappingProxyType(
    {
        "uniform": {
            "rosen-2012": _ROSEN_PLANE,
            "milet-2015": _MILET_PLANE,
            "navratil": _THESIS_PLANE,
            "vanek-2011": {**_VANEK, **_straight("section 2"), "rotation": UNROTATED},
            "chong-2007": {**_CHONG, "rotation": UNROTATED},
        },
        "desired_view": {"milet-2015": _MILET_PLANE, "navratil": _THESIS_PLANE},
        "min_sm": {"milet-2015": _MILET_STRAIGHT, "navratil": _THESIS_STRAIGHT},
        "focused": {"chong-2007": _CHONG_FRUSTUM},
        "lispsm": {"chong-2007": _CHONG_FRUSTUM},
        "plane_optimal": {"chong-2007": _CHONG_FRUSTUM},
        "psm": {
            "navratil": {
                **_THESIS,
                **_straight("section 3.2.1: generated after the perspective transformation"),
                "fit": _open("frustum", "section 3.2.1 describes the method, and does not run it"),
                "margin": _open(0.02, "section 3.2.1 describes the method, and does not run it"),
            }
        },
        "scene_optimized": {
            "chong-2007": {
                **_CHONG,
                "samples": _in("boundary", "section 2.3: samples near shadow boundaries"),
                "optimizer": _in("paper", "sections 2.3 and 2.4: three steps, nine angles each"),
                "sample_resolution": _in(180, "section 2.4: 180 x 180 samples"),
                "margin": _open(0.02, "section 2.4: the rectangle is grown slightly"),
                "previous": _open(None, "section 2.3: the frame before, which is given by hand"),
                "previous_age": _open(None, "section 2.4: that of the frame before"),
                "every": _in(3, "section 2.4: P is updated every three frames"),
                "boundaries": _in("previous", "section 2.3: by the previous frame's map; a focused "
                                  "one where there is none"),
            }
        },
        "cascades": {"rosen-2012": _CASCADES},
        "rtw": {
            "rosen-2012": _ROSEN_RTW,
            "milet-2015": _MILET_RTW,
            "navratil": _THESIS_RTW,
        },
        "notw": {"milet-2015": _MILET_NOTW, "navratil": _THESIS_NOTW},
        "min_sm+notw": {
            "milet-2015": {
                **_MILET_NOTW,
                "fit": _in("min_sm", "section 3.2: the minimal shadow frustum extension"),
                "rotation": _in(None, "section 3.2: the smallest rectangle's"),
            },
            "navratil": {
                **_THESIS_NOTW,
                "fit": _in("min_sm", "section 4.1.5: the minimal shadow frustum extension"),
                "rotation": _in(None, "section 4.1.5: the smallest rectangle's"),
            },
        },
        "cube+notw": {
            "navratil": {
                **_THESIS_NOTW,
                **_OMNIDIRECTIONAL,
                "fit": _in("cube", "section 5.3.1: cube shadow maps with warping"),
            }
        },
        "dual_paraboloid+notw": {
            "navratil": {
                **_THESIS_NOTW,
                **_OMNIDIRECTIONAL,
                "fit": _in("dual_paraboloid", "section 5.3.1: DPSM with warping"),
            }
        },
        "improved_paraboloid": {
            "vanek-2011": {
                **_VANEK_PARABOLOID,
                "cut": _in("frustum", "sections 3.2 and 3.3, Eq. 1 and 2: the light cone of the "
                           "truncated view frustum"),
                "splitting": _in("light", "sections 3 and 3.1: the regular DPSM where the light is "
                                 "inside; section 5 allows a rotation there"),
            }
        },
        "cube": {
            "navratil": {
                **_THESIS_OMNIDIRECTIONAL,
                **_straight("section 3.3.2: all transformations of cube shadow maps are linear"),
                "cut": _in("face", "section 3.3.1: the faces of the cube"),
                "turned": _in(False, "section 3.3.1: along the axes of its coordinate system"),
            }
        },
        "dual_paraboloid": {
            "navratil": _THESIS_PARABOLOIDS,
            "vanek-2011": {
                **_VANEK_PARABOLOID,
                "cut": _in("hemisphere", "section 2: a field of view of 180 degrees each"),
                "splitting": _in("light", "section 3.1: the rotation of the paraboloids is fixed"),
            },
        },
        "ray_traced": {"rosen-2012": {}},
        "shadow_volumes": {"milet-2015": {}, "navratil": {}},
    }
)  # fmt: skip
"""Methods and compositions by name; of each, the papers that run it, its own first; of each, the
values by parameter. What is not listed has its default."""


def published_values(name: str, paper: str | None = None) -> Values:
    """The values of a method, or of a composition such as ``"cube+notw"``, in a paper.

    Parameters
    ----------
    name : str
        A key of `PUBLISHED`.
    paper : str, optional
        A key of `PAPERS`, or ``"published"``, which is None: the method's own paper, the first that
        `PUBLISHED` lists.

    Raises
    ------
    ValueError
        No paper runs the method, or not this one; the message lists those that do.
    """
    papers = PUBLISHED.get(name, {})
    if not papers:
        raise ValueError(f"no paper runs {name!r}; those that one runs: {', '.join(PUBLISHED)}")
    if paper is None or paper == PUBLISHED_NAME:
        return next(iter(papers.values()))
    if paper not in papers:
        raise ValueError(
            f"paper of {name!r} must be 'published' or one of {', '.join(map(repr, papers))}, "
            f"got {paper!r}{did_you_mean(paper, [PUBLISHED_NAME, *papers])}"
        )
    return papers[paper]
