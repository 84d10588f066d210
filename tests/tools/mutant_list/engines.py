"""The CPU engine, the choice of an engine, and where both must do the same."""

from __future__ import annotations

from .mutant import Mutant

PACKETS = ("cargo", "--lib", "bvh")
RAYS = ("pytest", "tests/test_devices.py", "-k", "list_of_lights and ray_traced")
TWINS = ("cargo", "--lib", "passes::twins")
SURE = ("cargo", "--lib", "what_lanes_are_sure_of")
BLOCKS = ("cargo", "--lib", "blocks_that_are_left_out")
SEEN = (
    "cargo", "--lib",
    "near_plane", "in_every_tile", "an_edge_nearly_passes", "of_triangles_in_one", "no_pixel_slips",
)  # fmt: skip
SOUP = ("cargo", "--lib", "pixels_of_any_soup")
CELLS = ("cargo", "--lib", "a_cell_lists")
HITS = ("cargo", "--lib", "hit_or_missed_for_sure")
GRIDS = ("cargo", "--lib", "what_no_sample_showed", "grids_of_a_light")
FACES = (
    "cargo", "--lib", "receivers_face_the_light", "where_faces_of_a_cube", "a_lamp_in_the_plane",
)  # fmt: skip
VARIANTS = ("cargo", "--lib", "neither_the_order_of_workgroups")
CHOICE = (
    "pytest", "tests/test_devices.py", "-k",
    "by_environment or hardware_comes or names_nothing",
)  # fmt: skip
VOLUMES = ("pytest", "tests/test_shadow_volumes.py", "-k", "cpu and not hardly")
STRAIGHT = ("pytest", "tests/test_rasterization.py", "-k", "cpu and stay_lines and cube")

BVH = "src/bvh.rs"
CPU_RAYS = "src/cpu/shadow_rays.rs"
LOOKUP = "shaders/lookup.wgsl"
TABLES = "shaders/warp_map.wgsl"
ENGINE = "src/engine.rs"
EDGES = "shaders/lib/edges.wgsl"
CPU_VIEW = "src/cpu/view.rs"
CPU_SHAPES = "src/cpu/shapes.rs"
CPU_BINS = "src/cpu/bins.rs"
CPU_RASTER = "src/cpu/rasterize.rs"
CPU_GRID = "src/cpu/light_grid.rs"
CPU_TESTS = "src/cpu/caster_tests.rs"
CPU_RECEIVERS = "src/cpu/receivers.rs"
CPU_VOLUMES = "src/cpu/shadow_volumes.rs"
CPU_FACES = "src/cpu/volume_faces.rs"
CPU_LINEAR = "src/cpu/linear_map.rs"

MUTANTS = (
    Mutant(
        "packets", "meet what the ray in their middle meets", BVH,
        "let grown = (spread + margin)", "let grown = (0.0 * spread + margin)", PACKETS,
    ),
    Mutant(
        "packets", "begin where the ray in their middle enters the scene", BVH,
        "let width = margin + spread.length() + ray", "let width = margin + ray", PACKETS,
    ),
    Mutant(
        "packets", "are half as wide as their receivers", CPU_RAYS,
        "spread: 0.5 * (high - low),", "spread: 0.25 * (high - low),", RAYS, "gpu",
    ),
    Mutant(
        "packets", "end half-way to the light", CPU_RAYS,
        "end: if has_end { length } else { f64::INFINITY },\n            margin: self.margin,",
        "end: 0.5 * length,\n            margin: self.margin,", RAYS, "gpu",
    ),
    Mutant(
        "packets", "lose half of the rays where they are halved", CPU_RAYS,
        "[std::array::from_fn(|i| packet[i] & !second[i]), second]", "[second, second]",
        ("cargo", "--lib", "shadow_rays"),
    ),
    Mutant(
        "packets", "what is left alone is lit", CPU_RAYS,
        "*alone |= packet;", "*alone |= 0 * packet;", RAYS, "gpu",
    ),
    Mutant(
        "packets", "begin at the first of their receivers", "src/cpu/candidates.rs",
        "(low_u, high_u) = (low_u.min(u), high_u.max(u));",
        "(low_u, high_u) = (low_u, high_u.max(u));", RAYS, "gpu",
    ),
    Mutant(
        "CPU engine", "corners are where they are, to the bit", CPU_SHAPES,
        "let turned = (longest + lengths[i]) * (2.0 * rounding);",
        "let turned = (longest + lengths[i]) * (0.0 * rounding);", SURE,
    ),
    Mutant(
        "CPU engine", "rounding turns no plane", CPU_SHAPES,
        "let off = moved + turned + far_off + size",
        "let off = moved + far_off + size", SURE,
    ),
    Mutant(
        "CPU engine", "a block that a triangle touches aside of its corner is left out", CPU_SHAPES,
        "greatest_of_all.min(e + side * (a.max(0.0) + b.max(0.0)))",
        "greatest_of_all.min(e)", BLOCKS,
    ),
    Mutant(
        "CPU engine", "a block that a triangle nearly covers is covered", CPU_SHAPES,
        "covered: mask_bits(splat(simd, 1.5)",
        "covered: mask_bits(splat(simd, -1.5)", BLOCKS,
    ),
    Mutant(
        "CPU engine", "what is before the near plane is seen", CPU_VIEW,
        "let is_met = far < nearness && nearness < near;",
        "let is_met = far < nearness;", SEEN,
    ),
    Mutant(
        "CPU engine", "a corner behind the eye is beyond a side of the view", CPU_VIEW,
        "x > width * w",
        "x > width", SEEN,
    ),
    Mutant(
        "CPU engine", "a tile is touched where its nearest corner is", CPU_VIEW,
        "side * (edge.x.max(0.0) + edge.y.max(0.0))",
        "side * (edge.x.min(0.0) + edge.y.min(0.0))", SEEN,
    ),
    Mutant(
        "CPU engine", "a triangle around the eye is in one tile", CPU_BINS,
        "_ => [0, tiling.columns - 1, 0, tiling.rows - 1],",
        "_ => [0, 0, 0, 0],", SEEN,
    ),
    Mutant(
        "CPU engine", "the nearest pixel of a block hides all of it", CPU_RASTER,
        "least.reduce_min()",
        "least.reduce_max()", SOUP,
    ),
    Mutant(
        "CPU engine", "the last of triangles in one place is seen", CPU_RASTER,
        "new == old && id < known",
        "new == old && id > known", SEEN,
    ),
    Mutant(
        "CPU engine", "a box ends before its triangle does", CPU_GRID,
        "(least(x) - rounding, greatest(x) + rounding)",
        "(least(x) + rounding, greatest(x) - rounding)", CELLS,
    ),
    Mutant(
        "CPU engine", "a group is as near as its farthest triangle", CPU_GRID,
        "nearest: greatest_of(&self.nearest),",
        "nearest: least_of(&self.nearest),", CELLS,
    ),
    Mutant(
        "CPU engine", "what may be hit is missed", CPU_TESTS,
        "(-rounding).simd_le(before)",
        "rounding.simd_le(before)", HITS,
    ),
    Mutant(
        "CPU engine", "what is about inside of an edge is hit for sure", CPU_TESTS,
        "let hit = f32x16::splat(simd, 1.0).simd_lt(e)",
        "let hit = f32x16::splat(simd, -0.5).simd_lt(e)", HITS,
    ),
    Mutant(
        "CPU engine", "receivers beside the first grid are dark", CPU_TESTS,
        "*left &= !within;",
        "*left = 0;", GRIDS,
    ),
    Mutant(
        "CPU engine", "rounding decides the side of a light in a plane", CPU_RECEIVERS,
        "size(&v) * size(&w) * SURE_OF_SIDE", "0.0 * SURE_OF_SIDE * size(&v) * size(&w)",
        FACES,
    ),
    Mutant(
        "CPU engine", "the side that the camera does not see is lit", CPU_RECEIVERS,
        "let mut faces_light = is_above ^ is_behind;",
        "let mut faces_light = is_above;", FACES,
    ),
    Mutant(
        "CPU engine", "a cone lights what is outside of it", CPU_RECEIVERS,
        "outside.simd_le(within)",
        "within.simd_le(outside)", FACES,
    ),
    Mutant(
        "CPU engine", "two faces of the cube are exchanged", CPU_RECEIVERS,
        "let is_y = !is_x & z.simd_le(y);",
        "let is_y = !is_x & y.simd_le(z);", FACES,
    ),
    Mutant(
        "CPU engine", "an eye is in no shadow volume", CPU_VOLUMES,
        "count: at_eye,",
        "count: 0 * at_eye,", VOLUMES,
    ),
    Mutant(
        "CPU engine", "lines of sight enter sides that they leave", CPU_FACES,
        "entered: volumes * eye_side,",
        "entered: volumes,", VOLUMES,
    ),
    Mutant(
        "CPU engine", "depths between straight edges are those of no perspective", CPU_LINEAR,
        "weighted(|corner| 1.0 / corner.w),",
        "weighted(|_| 1.0),", STRAIGHT,
    ),
    Mutant(
        "choice of engine", "the environment counts for more than the caller", ENGINE,
        "if let Some(name) = device.or(named_by_environment().as_deref()) {",
        "if let Some(name) = named_by_environment().as_deref().or(device) {",
        CHOICE, "gpu",
    ),
    Mutant(
        "choice of engine", "an empty word in the environment names a device", ENGINE,
        ".filter(|name| !name.is_empty())",
        "", CHOICE, "gpu",
    ),
    Mutant(
        "choice of engine", "a software driver comes before the CPU engine", ENGINE,
        "Ok(false) | Err(_) => Ok(Self::Cpu),",
        'Ok(false) | Err(_) => Ok(Self::Gpu(gpu::gpu("")?)),', CHOICE, "gpu",
    ),
    Mutant(
        "two walks", "the second one takes any triangle", "shaders/target/depth_then_triangle.wgsl",
        "index + 1u]) == key {",
        "index + 1u]) != 0u {", ("pytest", "tests/test_without.py"),
    ),
    Mutant(
        "old memory", "lists of receivers begin with what was there",
        "src/gpu/passes/receiver_lists.rs",
        "    frame.clear(&scratch.counts);\n", "", VARIANTS,
    ),
    Mutant(
        "old memory", "what covered a tile of another map hides", "src/gpu/passes/rasterize.rs",
        "    frame.clear(&depths_of_tiles);\n", "", VARIANTS,
    ),
    Mutant(
        "old memory", "an importance map is added to the last one",
        "src/gpu/passes/importance_map.rs",
        "    frame.clear(&map);\n", "", VARIANTS,
    ),
    Mutant(
        "order of workgroups", "receivers end where those of the last do",
        "shaders/receivers.wgsl",
        "atomicMax(&bounds.extremes[axis + 3u], ordered_from_float(high[0][axis]));",
        "atomicStore(&bounds.extremes[axis + 3u], ordered_from_float(high[0][axis]));", VARIANTS,
    ),
    Mutant(
        "order of workgroups", "the last receiver's importance is its cell's",
        "shaders/importance_map.wgsl",
        "atomicMax(&importance_map[cell], bitcast<u32>(weight));",
        "atomicStore(&importance_map[cell], bitcast<u32>(weight));", VARIANTS,
    ),
    Mutant(
        "twins", "an edge is computed from the triangle's own end", EDGES,
        "let swap = is_before(b, a);",
        "let swap = false;", TWINS,
    ),
    Mutant(
        "twins", "weights of the texels above are those of the texels beside", LOOKUP,
        "weights.x), weights.y);",
        "weights.x), weights.x);", TWINS,
    ),
    Mutant(
        "twins", "a carry is lost", "shaders/lib/pairs.wgsl",
        "select(0u, 1u, low < a.x)",
        "0u", TWINS,
    ),
    Mutant(
        "twins", "an inverse ends in the next cell", TABLES,
        "warp_table[forward + middle + 1u] < centre;",
        "warp_table[forward + middle + 1u] <= centre;", TWINS,
    ),
)  # fmt: skip
