"""Pictures of studies and frames, as matplotlib axes.

Each function draws into `ax`, or into new axes where None is given, and returns the axes. What
colour tells, a marker, a hatch or a word tells too, so that a print in black and white can be read.
matplotlib is in the extra ``plot``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..arguments import needs
from ..compare import FALSE_LIT, FALSE_SHADOW, Comparison
from ..frame import Frame
from ..image_files import chunks

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Okabe and Ito's colours, told apart by every kind of eye.
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#8A8A00")
MARKERS = ("o", "s", "^", "D", "v", "P", "X", "<", ">", "*", "h", "p")
HATCHES = ("", "///", "...", "xxx", "\\\\\\", "+++", "ooo", "---", "|||", "***")

NAMES = {
    "gpu_ms": "time of all passes, ms",
    "wall_ms": "time from call to array, ms",
    "misclassified_count": "misclassified pixels",
    "false_lit_count": "false lit pixels",
    "false_shadow_count": "false shadow pixels",
    "rate_covered": "misclassified share of covered pixels",
    "edge_displacement_mean": "mean edge displacement, pixels",
    "edge_displacement_p95": "95th percentile of edge displacement, pixels",
    "aliasing_median": "median aliasing error m",
    "map_bytes": "map, bytes",
    "resolution": "resolution of the map, texels",
}


def time_against_error(
    table: pandas.DataFrame,
    ax: Axes | None = None,
    *,
    time: str = "gpu_ms",
    error: str = "misclassified_count",
    by: str | Sequence[str] = "method",
    label: str | None = "resolution",
    peers: pandas.DataFrame | None = None,
) -> Axes:
    """The time of each method against what it misclassifies; both axes are logarithmic.

    Cases that no other beats in both are joined by the Pareto front. Bars are quartiles of time.
    More than six series are named beside the axes, each by a line to its end, and those that are
    never on the front are grey.

    Parameters
    ----------
    table : pandas.DataFrame
        From `lixel.study`, of one scene, camera, light and size.
    ax : matplotlib.axes.Axes, optional
    time, error : str
        Columns.
    by : str or sequence of str
        Columns whose values make a series.
    label : str or None
        Column that is written beside the points; where there are more than six series its values
        are told once. None: nothing.
    peers : pandas.DataFrame, optional
        Other renderers in the same view, from ``lixel lab peers``, as marks with their names. Their
        times are of whole frames: compare them with ``time="wall_ms"``.

    Raises
    ------
    ValueError
        A column that is not there, a table of several views, or peers of another view.
    """
    table = _one_view(table, time, error, *_listed(by), *_listed(label))
    is_crowded = len(table[_listed(by)].drop_duplicates()) > _FEW
    ax = axes_or_new(ax)
    ax.set_xscale("log")
    others = None if peers is None else _peers_of(table, peers)
    theirs = [] if others is None else others["misclassified"].tolist()
    _scale_errors(ax, table[error].tolist() + theirs)
    front = table[pareto_front(table[time], table[error])].sort_values(time)
    ax.plot(
        front[time], front[error], color="0.75", linewidth=5, zorder=1, label="Pareto front",
        solid_capstyle="round", drawstyle="steps-post",
    )  # fmt: skip
    ends: list[_End] = []
    for style, name, rows in _series(table, _listed(by)):
        rows = rows.sort_values(label or error)
        if is_crowded and not rows.index.isin(front.index).any():
            style |= {"color": "0.55", "linewidth": 0.9, "markersize": 4, "zorder": 1.5}
        ax.plot(rows[time], rows[error], label=name, **style)
        ends.append((rows[time].iloc[-1], rows[error].iloc[-1], name, style["color"]))
        if f"{time}_q1" in rows:
            ax.hlines(
                rows[error], rows[f"{time}_q1"], rows[f"{time}_q3"], color=style["color"], alpha=0.6
            )
        if label is not None and not is_crowded:
            # A method without a map has no resolution.
            named = rows.dropna(subset=[label])
            for x, y, text in zip(named[time], named[error], named[label], strict=True):
                ax.annotate(
                    _text(text), (x, y), xytext=(5, 4), textcoords="offset points",
                    fontsize="x-small", color="0.25",
                )  # fmt: skip
    if others is not None:
        ends += _draw_peers(ax, others)
    _finish(ax, time, error)
    if is_crowded:
        _name_ends(ax, [*ends, (*_middle(front, time, error), "Pareto front", "0.6")])
        if label is not None:
            steps = ", ".join(map(_text, sorted(table[label].dropna().unique())))
            words = f"along each line: {NAMES.get(label, label)}, {steps}"
            ax.set_xlabel(f"{ax.get_xlabel()}\n{words}")
    else:
        ax.legend(fontsize="small")
    return ax


_End: TypeAlias = tuple[float, float, str, str]
"""Where a series ends, its name and its colour."""


def _peers_of(table: pandas.DataFrame, peers: pandas.DataFrame) -> pandas.DataFrame:
    """Those that are not lixel, of the view of the table."""
    for name in ("scene", "width", "height"):
        ours, theirs = set(table.get(name, ())), set(peers.get(name, ()))
        if ours and theirs and ours != theirs:
            raise ValueError(f"peers must be of the table's {name}, {ours}, got {theirs}")
    return peers[~peers["renderer"].str.startswith("lixel ")]


def _draw_peers(ax: Axes, peers: pandas.DataFrame) -> list[_End]:
    times, errors, names = (peers[name] for name in ("ms, median", "misclassified", "renderer"))
    ax.plot(times, errors, "*", color="black", markersize=9, label="other renderers")
    return [(x, y, name, "black") for x, y, name in zip(times, errors, names, strict=True)]


def _middle(front: pandas.DataFrame, time: str, error: str) -> tuple[float, float]:
    """A place on the front, between the last two of its cases."""
    return float(front[time].iloc[-1]), float(front[error].iloc[-2:].mean())


def _name_ends(ax: Axes, ends: Sequence[_End]) -> None:
    """Names right of the axes, from top to bottom as the series end, with a thin line to each."""
    places = ax.transAxes.inverted().transform(ax.transData.transform([end[:2] for end in ends]))
    order = sorted(range(len(ends)), key=lambda i: (-places[i, 1], places[i, 0]))
    gap = min(0.05, 1.0 / max(len(ends) - 1, 1))
    heights = [float(places[i, 1]) for i in order]
    for i in range(1, len(heights)):
        heights[i] = min(heights[i], heights[i - 1] - gap)
    # What hangs below the axes pushes up what is above it.
    lowest = 0.0
    for i in reversed(range(len(heights))):
        heights[i] = max(heights[i], lowest)
        lowest = heights[i] + gap
    for height, i in zip(heights, order, strict=True):
        x, y, name, colour = ends[i]
        ax.annotate(
            name, (x, y), xytext=(1.03, height), textcoords="axes fraction", va="center",
            fontsize="small", color="0.25" if colour == "0.55" else colour,
            arrowprops={
                "arrowstyle": "-", "color": colour, "linewidth": 0.5, "shrinkA": 1, "shrinkB": 3,
                "relpos": (0.0, 0.5),
            },
        )  # fmt: skip


# Series that a legend and labels leave room for inside the axes.
_FEW = 6


def time_against_error_by_view(table: pandas.DataFrame, **options: Any) -> list[Axes]:
    """`time_against_error` for each scene, camera and light of a table, side by side.

    Parameters
    ----------
    table : pandas.DataFrame
        From `lixel.study`.
    **options
        For `time_against_error`.

    Returns
    -------
    list of matplotlib.axes.Axes
        In the order of the table; the title says what differs between them.
    """
    differing = [name for name in ("scene", "camera", "light") if table[name].nunique() > 1]
    views = list(table.groupby(differing, sort=False)) if differing else [((), table)]
    _, axes = needs("matplotlib.pyplot", "plot").subplots(
        1, len(views), figsize=(7.2 * len(views), 4.8), layout="constrained", squeeze=False
    )
    for ax, (names, rows) in zip(axes.flat, views, strict=True):
        time_against_error(rows, ax, **options)
        ax.set_title(", ".join(map(str, names)))
    return list(axes.flat)


def _side(resolution: Any) -> Any:
    """Of a square of as many texels: 512 of ``"1024x256"``."""
    if not isinstance(resolution, str):
        return resolution
    sides = [int(side) for side in resolution.split("x")]
    return math.sqrt(sides[0] * sides[-1])


def error_against_resolution(
    table: pandas.DataFrame,
    ax: Axes | None = None,
    *,
    error: str = "misclassified_count",
    resolution: str = "resolution",
    by: str | Sequence[str] = "method",
) -> Axes:
    """How the error falls as the map grows; both axes are logarithmic.

    Parameters
    ----------
    table, ax, error, by
        As for `time_against_error`.
    resolution : str
        The column across. A map that is not square stands where the square of as many texels does.

    Raises
    ------
    ValueError
        As for `time_against_error`.
    """
    table = _one_view(table, error, resolution, *_listed(by))
    table = table.assign(**{resolution: [_side(value) for value in table[resolution]]})
    ax = axes_or_new(ax)
    ax.set_xscale("log", base=2)
    _scale_errors(ax, table[error])
    for style, name, rows in _series(table.dropna(subset=[resolution]), _listed(by)):
        rows = rows.sort_values(resolution)
        ax.plot(rows[resolution], rows[error], label=name, **style)
    ticks = sorted(table[resolution].dropna().unique())
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    _finish(ax, resolution, error)
    ax.legend(fontsize="small")
    return ax


def pass_times(
    table: pandas.DataFrame,
    ax: Axes | None = None,
    *,
    by: str | Sequence[str] = ("method", "resolution"),
) -> Axes:
    """A bar for each case, with a part for each pass; hatches tell the passes apart.

    Parameters
    ----------
    table, ax
        As for `time_against_error`.
    by : str or sequence of str
        Columns that name a bar.

    Raises
    ------
    ValueError
        As for `time_against_error`.
    """
    table = _one_view(table, "gpu_ms", *_listed(by))
    ax = axes_or_new(ax)
    names = [" ".join(_text(v) for v in row) for row in table[_listed(by)].itertuples(index=False)]
    passes = [name for name in table if name.startswith("pass_ms.")]
    left = np.zeros(len(table))
    for i, name in enumerate(passes):
        ms = table[name].fillna(0.0).to_numpy()
        ax.barh(
            names, ms, left=left, label=name.removeprefix("pass_ms."), edgecolor="white",
            color=COLOURS[i % len(COLOURS)], hatch=HATCHES[i % len(HATCHES)], linewidth=0.5,
        )  # fmt: skip
        left += ms
    for row, total in enumerate(left):
        ax.annotate(
            f"{total:,.0f}" if total >= 100 else f"{total:.3g}", (total, row),
            xytext=(3, 0), textcoords="offset points", va="center", fontsize="x-small",
        )  # fmt: skip
    ax.invert_yaxis()
    ax.margins(x=0.08)
    ax.set_xlabel("time of each pass, ms, median")
    ax.spines[["top", "right"]].set_visible(False)
    ax.legend(fontsize="small")
    return ax


def difference(comparison: Comparison, ax: Axes | None = None) -> Axes:
    """The shadows with misclassified pixels in red, false lit bright and false shadow dark, and
    both counts in words.

    Parameters
    ----------
    comparison : Comparison
    ax : matplotlib.axes.Axes, optional
    """
    ax = axes_or_new(ax)
    ax.imshow(comparison.picture(), interpolation="nearest")
    patch = needs("matplotlib.patches", "plot").Patch
    ax.legend(
        handles=[
            patch(color=np.divide(colour, 255), label=f"{number:,} false {what}")
            for colour, number, what in (
                (FALSE_LIT, comparison.false_lit_count, "lit"),
                (FALSE_SHADOW, comparison.false_shadow_count, "shadow"),
            )
        ],
        loc="lower left",
        fontsize="small",
        framealpha=0.9,
    )
    return bare(ax)


def aliasing_error(frame: Frame, ax: Axes | None = None, *, limit: float = 16.0) -> Axes:
    """Heat map of the papers' aliasing error m, the width of a texel over that of its pixel.

    The contour is where m is 1: beyond it shadow edges turn into stairs.

    Parameters
    ----------
    frame : Frame
    ax : matplotlib.axes.Axes, optional
    limit : float
        Colours go from 1/limit to limit, in steps of equal ratio.

    Raises
    ------
    ValueError
        A limit of 1 or less.
    """
    if not 1.0 < limit < math.inf:
        raise ValueError(f"limit must be greater than 1 and finite, got {limit}")
    colours = needs("matplotlib.colors", "plot")
    ax = axes_or_new(ax)
    error = np.where(frame.facing, frame.aliasing_error, np.nan)
    image = ax.imshow(
        error, norm=colours.LogNorm(1.0 / limit, limit), cmap="cividis", interpolation="nearest"
    )
    finite = error[np.isfinite(error)]
    if finite.size and finite.min() < 1.0 < finite.max():
        ax.contour(error, levels=[1.0], colors="black", linewidths=0.8)
    figure: Any = ax.figure
    bar = figure.colorbar(image, ax=ax, extend="both", shrink=0.8)
    bar.set_label("aliasing error m; black line: m = 1")
    return bare(ax)


def pareto_front(time: npt.ArrayLike, error: npt.ArrayLike) -> npt.NDArray[np.bool_]:
    """Which cases no other beats: none is as fast with less error, or faster with as little.

    Parameters
    ----------
    time, error : (n,) float
        NaN is beaten by all.

    Returns
    -------
    (n,) bool

    Examples
    --------
    >>> pareto_front([1, 2, 3, 3], [9, 4, 4, 1]).tolist()
    [True, True, False, True]
    """
    times, errors = np.asarray(time, float), np.asarray(error, float)
    on_front: npt.NDArray[np.bool_] = ~(np.isnan(times) | np.isnan(errors))
    for i in np.flatnonzero(on_front):
        no_worse = (times <= times[i]) & (errors <= errors[i])
        on_front[i] = not (no_worse & ((times < times[i]) | (errors < errors[i]))).any()
    return on_front


def save(figure: Figure, path: str | Path, command: str, dpi: int = 100) -> None:
    """Write a figure; a .png file tells the command that drew it, see `lixel.read_metadata`."""
    is_png = Path(path).suffix.lower() == ".png"
    figure.savefig(path, dpi=dpi, metadata=chunks({"command": command}) if is_png else None)


# --- What they share ---


def axes_or_new(ax: Axes | None) -> Axes:
    if ax is None:
        _, made = needs("matplotlib.pyplot", "plot").subplots(layout="constrained")
        return made  # type: ignore[no-any-return]
    return ax


def bare(ax: Axes) -> Axes:
    ax.set_xticks([])
    ax.set_yticks([])
    return ax


def _finish(ax: Axes, x: str, y: str) -> None:
    ax.set_xlabel(NAMES.get(x, x))
    ax.set_ylabel(NAMES.get(y, y))
    ticker = needs("matplotlib.ticker", "plot")
    for axis in (ax.xaxis, ax.yaxis):
        if axis.get_scale() == "log" and not isinstance(
            axis.get_major_locator(), ticker.FixedLocator
        ):
            # Less than a decade would else have one number or none.
            axis.set_major_locator(ticker.LogLocator(subs=(1, 2, 5)))
            axis.set_major_formatter(ticker.StrMethodFormatter("{x:g}"))
            axis.set_minor_locator(ticker.NullLocator())
    ax.grid(which="major", color="0.9", linewidth=0.6)
    ax.set_axisbelow(True)
    ax.spines[["top", "right"]].set_visible(False)


def _listed(names: str | Sequence[str] | None) -> list[str]:
    if names is None:
        return []
    return [names] if isinstance(names, str) else list(names)


def _text(value: Any) -> str:
    return f"{value:g}" if isinstance(value, (int, float)) else str(value)


def _one_view(table: pandas.DataFrame, *columns: str) -> pandas.DataFrame:
    """The rows that were measured; refuses a mixture of views, whose times cannot be compared."""
    for name in columns:
        if name not in table:
            raise ValueError(f"table must have the column {name!r}, got {', '.join(table)}")
    if "error" in table:
        table = table[table["error"].isna()]
    for name in ("scene", "camera", "light", "width", "height", "device"):
        if name in table and name not in columns and table[name].nunique() > 1:
            found = ", ".join(map(str, table[name].unique()))
            raise ValueError(
                f"table must hold one {name}, or name it in `by`, got {found}: select rows first"
            )
    return table


def _series(
    table: pandas.DataFrame, by: list[str]
) -> Iterator[tuple[dict[str, Any], str, pandas.DataFrame]]:
    for i, (key, rows) in enumerate(table.groupby(by, sort=False)):
        style = {
            "color": COLOURS[i % len(COLOURS)],
            "marker": MARKERS[i % len(MARKERS)],
            "linestyle": ("-", "--", "-.", ":")[i // len(COLOURS) % 4],
            "markersize": 6,
            "linewidth": 1.4,
        }
        yield style, " ".join(_text(v) for v in (key if isinstance(key, tuple) else (key,))), rows


def _scale_errors(ax: Axes, errors: Iterable[float]) -> None:
    """Logarithmic; linear below the least error where some have none, so that zero has a place."""
    known = [float(error) for error in errors if error == error]
    positive = [error for error in known if error > 0]
    if len(positive) == len(known):
        ax.set_yscale("log")
    elif positive:
        least, most = min(positive), max(positive)
        ax.set_yscale("symlog", linthresh=least)
        ax.set_ylim(-0.1 * least, 2.0 * most)
        ticks = [10.0**n for n in range(math.floor(math.log10(least)), 12) if 10.0**n >= least]
        ax.set_yticks([0.0, *(tick for tick in ticks if tick <= most)])
        ax.yaxis.set_major_formatter(needs("matplotlib.ticker", "plot").StrMethodFormatter("{x:g}"))
