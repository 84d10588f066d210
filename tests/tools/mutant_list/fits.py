"""Where a map's texels go: fits, turns, splits, layers that are given, and rules of parameters."""

from __future__ import annotations

from .mutant import Mutant

TURNS = ("cargo", "--lib", "rotation")
PARABOLOID = ("cargo", "--lib", "fits::improved_paraboloid")
CASCADES = ("cargo", "--lib", "fits::cascades")
SAMPLES = ("cargo", "--lib", "fits::scene_optimized")
RULES = ("pytest", "tests/test_parameters.py", "-k", "same_words")
GIVEN_LAYERS = ("pytest", "tests/test_given_layers.py")
LEAST_ERROR = ("pytest", "tests/test_log_psm.py", "-k", "least_error or smaller_largest")
ROWS = ("pytest", "tests/test_log_psm.py", "-k", "follow_from or margin_is_left")
LOG_IN_RUST = ("cargo", "--lib", "log_perspective")
TURNED = ("cargo", "--lib", "projection")
TRAPEZOIDS = ("cargo", "--lib", "fits::trapezoid")
SHAPES = ("cargo", "--lib", "map_size")
RECTANGLES = ("cargo", "--lib", "fits::hull")
STEPS = ("cargo", "--lib", "samples")
PLANES = ("cargo", "--lib", "fits::matrix_layers")
OFF_PLANE = ("pytest", "tests/test_light_matrices.py", "-k", "map_of_their_own")
LAID = ("pytest", "tests/test_map_shapes.py", "-k", "lies_along")

LOG = "src/fits/log_perspective.rs"
TRAPEZOID = "src/fits/trapezoid.rs"
LOG_MAP = "src/projection/log_perspective.rs"
SCHEMA = "src/methods/schema.rs"
ROTATION = "src/fits/rotation.rs"
ZOOM = "src/fits/improved_paraboloid.rs"
SPLITS = "src/fits/cascades.rs"
CHOSEN = "src/fits/scene_optimized.rs"
PLANE = "src/fits/plane_optimal.rs"
GIVEN = "src/fits/given.rs"

MUTANTS = (
    Mutant(
        "planes", "every point has as much of a vote, however it is lit", PLANE,
        "filter(agrees).map(|s| s.weight).sum()", "filter(agrees).map(|_| 1.0).sum()", PLANES,
    ),
    Mutant(
        "planes", "what has no place on the plane has no map", PLANE,
        "[Some(held), Some(others)] => vec![held, others]",
        "[Some(held), Some(_)] => vec![held]", OFF_PLANE,
    ),
    Mutant(
        "planes", "both maps are for the same side", PLANE,
        "[border, border.opposite()]", "[border, border]", OFF_PLANE,
    ),
    Mutant(
        "samples", "a narrow image has few", "src/fits/samples.rs",
        "width.max(height).min(side_of_wide)", "width.max(height)", STEPS,
    ),
    Mutant(
        "shapes", "a wide box lies along the fewer texels of a high map", "src/map_size.rs",
        "Ordering::Less => sides.x > sides.y", "Ordering::Less => false", SHAPES,
    ),
    Mutant(
        "shapes", "the longer side of a rectangle may have fewer samples", "src/fits/hull.rs",
        "Some(parallelogram.focus_lengthwise(view, frame))",
        "Some(parallelogram.focus(view, frame))", RECTANGLES,
    ),
    Mutant(
        "shapes", "a map of the receivers lies as a square does", "src/fits/boxes.rs",
        "laid_lengthwise(&projection, corners, sides, size)", "(projection.clone(), corners)", LAID,
    ),
    Mutant(
        "shapes", "the steps of samples are shares of the sides", "src/warp/samples.rs",
        "DVec2::new(x.x, x.y / aspect)", "DVec2::new(x.x, x.y)", STEPS,
    ),
    Mutant(
        "logarithmic", "rows in the corners of an image are no longer", LOG,
        "log_ratio * (1.0 + steepest * steepest).sqrt()", "log_ratio", LOG_IN_RUST,
    ),
    Mutant(
        "logarithmic", "the rows of the margin are left out", LOG,
        "rows / ((1.0 + 2.0 * frame.margin) * log_ratio)", "rows / log_ratio", ROWS,
    ),
    Mutant(
        "logarithmic", "half of the rows lie nearer than half of the way", LOG,
        "let middle = (distance * (distance + candidates.length)).sqrt();",
        "let middle = distance + 0.5 * candidates.length;", LOG_IN_RUST,
    ),
    Mutant(
        "logarithmic", "a pixel is as wide near the eye as anywhere", LOG,
        "camera.width_at(depth.max(nearest)) * area.sqrt()",
        "camera.width_at(nearest) * area.sqrt()", LEAST_ERROR,
    ),
    Mutant(
        "logarithmic", "a depth's slope along a column grows downwards", LOG_MAP,
        "let s = self.fall(q) * self.rate;", "let s = -self.fall(q) * self.rate;", TURNED,
    ),
    Mutant(
        "logarithmic", "a texel's beam is as long as one far away", LOG_MAP,
        "let down = along.length() * self.fall(q);",
        "let down = along.length() / self.rate;", TURNED,
    ),
    Mutant(
        "trapezoidal", "the focus is taken to the rest of the line", TRAPEZOID,
        "(self.line - focus) / ((1.0 - self.line) * focus)",
        "(self.line - focus) / (self.line * focus)", TRAPEZOIDS,
    ),
    Mutant(
        "trapezoidal", "it does not fade where the light shines along the view", TRAPEZOID,
        "rule.perspective((share / FULL_SHARE).min(1.0))", "rule.perspective(1.0 + 0.0 * share)",
        TRAPEZOIDS,
    ),
    Mutant(
        "turns", "the scene's edges have no say", ROTATION,
        "0.5 * area.ln() + EDGES_WORTH * alignment", "0.5 * area.ln()",
        ("pytest", "tests/test_fits.py"),
    ),
    Mutant(
        "turns", "a cube lies along the edges", ROTATION,
        "edges.alignment(x, y) + edges.alignment(y, z) + edges.alignment(z, x)",
        "-edges.alignment(x, y) - edges.alignment(y, z) - edges.alignment(z, x)",
        ("pytest", "tests/test_fits.py", "-k", "turned_cube"),
    ),
    Mutant(
        "turns", "maps lie along the edges", ROTATION,
        "0.5 * area.ln() + EDGES_WORTH * alignment", "0.5 * area.ln() - EDGES_WORTH * alignment",
        TURNS,
    ),
    Mutant(
        "turns", "a paraboloid's axes are the same everywhere", ROTATION,
        "axis - 2.0 * axis.dot(normal) * normal", "axis - 0.0 * axis.dot(normal) * normal", TURNS,
    ),
    Mutant(
        "improved paraboloid", "the zoom factor is the sine of the field of view", ZOOM,
        "(0.5 * self.field_of_view).tan()", "self.field_of_view.sin()", PARABOLOID,
    ),
    Mutant(
        "improved paraboloid", "the axis is pulled to a corner", ZOOM,
        "let sum: DVec3 = border_points.into_iter().sum();",
        "let sum = border_points.into_iter().sum::<DVec3>() + border_points[7];", PARABOLOID,
    ),
    Mutant(
        "cascades", "uniform splits are logarithmic", SPLITS,
        "Splits::Uniform => 0.0,", "Splits::Uniform => 1.0,", CASCADES,
    ),
    Mutant(
        "cascades", "logarithmic splits are uniform", SPLITS,
        "Splits::Logarithmic | Splits::Receivers | Splits::Quantiles => 1.0,",
        "Splits::Logarithmic | Splits::Receivers | Splits::Quantiles => 0.0,", CASCADES,
    ),
    Mutant(
        "cascades", "quantiles are those of cubes", SPLITS,
        "(share * depths.len() as f64) as usize",
        "(share.powi(3) * depths.len() as f64) as usize", CASCADES,
    ),
    Mutant(
        "cascades", "practical splits have no weight", SPLITS,
        "Splits::Practical => weight,", "Splits::Practical => 0.5,", CASCADES,
    ),
    Mutant(
        "scene optimized", "samples at a boundary are all that face the light", CHOSEN,
        "SampleChoice::Boundary => at_boundary(),", "SampleChoice::Boundary => true,", SAMPLES,
    ),
    Mutant(
        "scene optimized", "samples at a boundary are all in shadow", CHOSEN,
        "SampleChoice::Boundary => at_boundary(),",
        "SampleChoice::Boundary => visibility[i] == 0.0 || at_boundary(),", SAMPLES,
    ),
    Mutant(
        "given layers", "any light will do", GIVEN,
        "<= BESIDE_LIGHT,", "<= 2.0,", GIVEN_LAYERS,
    ),
    Mutant(
        "given layers", "a layer is for half of its map", GIVEN,
        "vec![x, w - x, y, w - y]", "vec![x, w - x * 2.0, y, w - y]", GIVEN_LAYERS,
    ),
    Mutant(
        "given layers", "depths may fall", GIVEN,
        "is_seen && last < first", "is_seen && last > first", GIVEN_LAYERS,
    ),
    Mutant(
        "rules", "a count may be zero", SCHEMA,
        "(1..=i64::from(max)).contains(&count)",
        "(0..=i64::from(max)).contains(&count)", RULES,
    ),
    Mutant(
        "rules", "what is above zero may be zero", SCHEMA,
        "Self::AboveZero => number > 0.0,",
        "Self::AboveZero => number >= 0.0,", RULES,
    ),
)  # fmt: skip
