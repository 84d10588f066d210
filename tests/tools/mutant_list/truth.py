"""What decides in the end: exact tests, the reference with its ties, and holes."""

from __future__ import annotations

from .mutant import Mutant

REFERENCE = ("cargo", "--lib", "reference")
SEARCHES = ("pytest", "tests/test_exact.py", "-k", "decide_alike or falls_away")
AT_CUTOFF = ("pytest", "tests/test_masks.py", "-k", "cannot_tell_from_the_cutoff")
ALPHA = ("cargo", "--lib", "masks")
HOLES = ("pytest", "tests/test_masks.py")

RAY = "shaders/lib/shadow_ray.wgsl"
CASTERS = "shaders/caster_tests.wgsl"
TRUTH = "src/reference.rs"

MUTANTS = (
    Mutant(
        "exact", "grid space decides what it does not know", CASTERS,
        "if met.is_certain && !is_own &&",
        "if met.is_possible && !is_own &&", SEARCHES,
    ),
    Mutant(
        "exact", "grid space has no room for its rounding", CASTERS,
        "let room = ROUNDING * (caster.farthest + absolute_sum(q)) + margin;",
        "let room = 0.0;", SEARCHES,
    ),
    Mutant(
        "exact", "what may be is never tested again", CASTERS,
        "unsure |= 1u << i;",
        "unsure |= 0u;", SEARCHES,
    ),
    Mutant(
        "exact", "what may be inside of a triangle's edges is inside", RAY,
        "edges.is_inside && is_between,",
        "edges.may_be_inside && is_between,", SEARCHES,
    ),
    Mutant(
        "ties", "points are known exactly", TRUTH,
        "self.granted * length + self.margin", "self.margin", REFERENCE,
    ),
    Mutant(
        "ties", "the receiver is known exactly", TRUTH,
        "margin: margin + (margin / cosine.abs()).min(self.extent),", "margin: 0.0,",
        REFERENCE,
    ),
    Mutant(
        "ties", "a surface edge-on to the eye may not turn", TRUTH,
        "let is_edge_on = to_light_side != 0 && to_eye_side == 0;",
        "let is_edge_on = false;", REFERENCE,
    ),
    Mutant(
        "ties", "a surface edge-on to the light may shadow", TRUTH,
        "if side == 0.0 || side * height > margin {", "if side * height > margin {", REFERENCE,
    ),
    Mutant(
        "ties", "the side of the light says nothing", TRUTH,
        "self.parts_ends = side * height < -margin;", "self.parts_ends = false;", REFERENCE,
    ),
    Mutant(
        "ties", "neighbours do not keep apart", TRUTH,
        ".all(|&c| normal.dot(c - self.point) <= self.margin)",
        ".all(|&c| normal.dot(c - self.point) <= -1.0)", REFERENCE,
    ),
    Mutant(
        "ties", "an edge inside a mesh hides nothing", TRUTH,
        "end = end.min(covered_until(&candidates, ray.range));", "", REFERENCE,
    ),
    Mutant(
        "ties", "equal distances go to the higher index", TRUTH,
        "a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))", "a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))",
        REFERENCE,
    ),
    Mutant(
        "holes", "a texel is taken for its neighbour", "src/masks.rs",
        "let columns = [x, x + 1].map", "let columns = [x + 1, x].map", ALPHA,
    ),
    Mutant(
        "holes", "a factor of alpha has no say", "src/masks.rs",
        "self.image.alpha_at(at.xy()) * at.z >= self.image.cutoff",
        "self.image.alpha_at(at.xy()) >= self.image.cutoff", ALPHA,
    ),
    Mutant(
        "holes", "between texels alpha is that of the first", "src/masks.rs",
        "a + share.x * (b - a)", "a + 0.0 * share.x * (b - a)", ALPHA,
    ),
    Mutant(
        "holes", "the nearest texel is the one before", "src/masks.rs",
        "Sampling::Nearest => ((place + 0.5).floor(), DVec2::ZERO),",
        "Sampling::Nearest => (place.floor(), DVec2::ZERO),", HOLES,
    ),
    Mutant(
        "holes", "what lies in a hole is in shadow", "src/cpu/holes.rs",
        "Solidity::Hole => (hit, maybe) = (hit & !(1 << i), maybe & !(1 << i)),",
        "Solidity::Hole => maybe &= !(1 << i),", HOLES,
    ),
    Mutant(
        "holes", "what the light grid knows of holes is sure", "src/cpu/holes.rs",
        "Solidity::Open(_) => hit &= !(1 << i),", "Solidity::Open(_) => {}", HOLES,
    ),
    Mutant(
        "holes", "shaders mirror where they should repeat", "shaders/mask/alpha.wgsl",
        "const WRAP_MIRROR: u32 = 1u;", "const WRAP_MIRROR: u32 = 0u;", HOLES,
    ),
    Mutant(
        "holes", "float32 is sure of every alpha", "shaders/mask/alpha.wgsl",
        "let slack = FULL_ALPHA * (reach.x + reach.y) + ALPHA_ROUNDING;", "let slack = 0.0;",
        AT_CUTOFF,
    ),
)  # fmt: skip
