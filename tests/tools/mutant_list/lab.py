"""What is written in Python: what the papers' tables are made of, and points of the lab."""

from __future__ import annotations

from .mutant import Mutant

PAPERS = (
    "pytest", "tests/test_papers.py", "-k",
    "every_figure or every_row or arithmetic or rows_are_published or beside_the_papers "
    "or shares_of_the_frame or in_milliseconds",
)  # fmt: skip
POINTS = ("pytest", "tests/test_points.py", "-k", "spread_by_area or beside_embree")

ROWS = "python/lixel/lab/papers/rows.py"
MEASURING = "python/lixel/lab/papers/measuring.py"
FIGURES = "python/lixel/lab/papers/figures.py"
AT_POINTS = "python/lixel/lab/points.py"

MUTANTS = (
    Mutant(
        "papers", "a table is printed by the command of another", ROWS,
        '(THESIS, "Table 5.2"): "thesis-2",', '(THESIS, "Table 5.2"): "milet-2",', PAPERS,
    ),
    Mutant(
        "papers", "a row that no command measures has no reason", ROWS,
        '(MILET, "Table 3", "triangles"): TRIANGLES,', "", PAPERS,
    ),
    Mutant(
        "papers", "ranges are their lower ends", FIGURES,
        "sum(figure) / 2 if isinstance(figure, tuple)",
        "figure[0] if isinstance(figure, tuple)", PAPERS,
    ),
    Mutant(
        "papers", "frames per second are times", MEASURING,
        'return 1.0 / middle(figure) if chosen.unit == "fps" else middle(figure)',
        "return middle(figure)", PAPERS,
    ),
    Mutant(
        "papers", "passes that a table leaves out count", MEASURING,
        'return cases["gpu_ms"] - _of_passes(cases, chosen.without)',
        'return cases["gpu_ms"] - 0.0 * _of_passes(cases, chosen.without)', PAPERS,
    ),
    Mutant(
        "papers", "times are over those of the row itself", MEASURING,
        "float(ms.median() / base_ms.median())", "float(ms.median() / ms.median())", PAPERS,
    ),
    Mutant(
        "points of the lab", "triangles have as many, whatever their area", AT_POINTS,
        "p=areas / areas.sum()", "p=None", POINTS,
    ),
    Mutant(
        "points of the lab", "lie beyond the third side", AT_POINTS,
        "shares[beyond] = 1.0 - shares[beyond]", "shares[beyond] = shares[beyond]", POINTS,
    ),
    Mutant(
        "points of the lab", "rays of Embree begin on the surface", AT_POINTS,
        "points + offset * unit", "points - offset * unit", POINTS,
    ),
    Mutant(
        "points of the lab", "rays of Embree count those that are dark", AT_POINTS,
        'query="OCCLUDED") != 0', 'query="OCCLUDED") == 0', POINTS,
    ),
)  # fmt: skip
