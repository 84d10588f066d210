//! The shader of warps against its functions in Rust, and its bounds against points.

use super::{Warp, texels_outside};
use crate::gpu::shaders::Shader;
use crate::lanes::{Lane, V2};
use crate::map_size::MapSize;
use crate::twin::{Random, Twin, assert_twins, run_on_device};

const CELLS: usize = 32;
/// A map that is not square, so that nothing along one axis passes for the other's.
const SIZE: MapSize = MapSize {
    width: 48,
    height: 20,
};

/// Functions with cells that have no width, and steep ones.
fn warp(functions: usize, random: &mut Random) -> Warp {
    let values = (0..2 * functions).flat_map(|_| {
        let steps: Vec<_> = (0..CELLS)
            .map(|_| [0.0, 1.0, 30.0][random.below(3)] * random.share())
            .collect();
        let total: f64 = steps.iter().sum();
        let sums = steps.iter().scan(0.0, |sum, step| {
            *sum += step / total;
            Some((*sum as f32).min(1.0))
        });
        std::iter::once(0.0).chain(sums).collect::<Vec<_>>()
    });
    Warp {
        functions,
        boundaries: CELLS + 1,
        values: values.collect(),
    }
}

const BLOCK: usize = 16;

/// What the shader reads: values, inverses, and the least and greatest values of blocks of functions.
fn table(warp: &Warp) -> Vec<f32> {
    let (along_x, along_y) = warp.values.split_at(warp.functions * warp.boundaries);
    let envelope = |choose: fn(f32, f32) -> f32| {
        let blocks = [along_x, along_y].map(|axis| axis.chunks(BLOCK * warp.boundaries));
        let values = blocks.into_iter().flatten().flat_map(move |block| {
            (0..warp.boundaries).map(move |i| {
                let values = block.iter().skip(i).step_by(warp.boundaries);
                values.copied().reduce(choose).unwrap()
            })
        });
        values.collect::<Vec<_>>()
    };
    [
        warp.values.clone(),
        warp.inverses(SIZE).on_map().concat(),
        envelope(f32::min),
        envelope(f32::max),
    ]
    .concat()
}

/// `load()` in WGSL: the warp in the table.
fn source(warp: &Warp, twin: &str) -> String {
    let along_x = warp.functions * warp.boundaries;
    let inverse = 2 * along_x;
    let inverses = [SIZE.width, SIZE.height].map(|texels| warp.functions * texels as usize);
    let least = inverse + inverses[0] + inverses[1];
    let blocks = warp.functions.div_ceil(BLOCK) * warp.boundaries;
    let pair = |first: usize, size: usize| format!("vec2<u32>({first}u, {}u)", first + size);
    format!(
        "{}{}fn load() -> Warp {{
            let functions = vec2<u32>({}u);
            return Warp(functions, vec2<u32>({CELLS}u), {}, {}, {}, {});
        }}
        const SIZE = vec2<u32>({}u, {}u);
        {twin}",
        Shader::new("warp/grid").compose(),
        Shader::new("lib/seams").compose(),
        warp.functions,
        pair(0, along_x),
        pair(inverse, inverses[0]),
        pair(least, blocks),
        pair(least + 2 * blocks, blocks),
        SIZE.width,
        SIZE.height,
    )
}

const WGSL: &str = "
fn twin(i: u32) -> array<f32, 20> {
    let warp = load();
    let uv = vec2<f32>(inputs[i], inputs[i + 1u]);
    let texel = vec2<f32>(inputs[i + 2u], inputs[i + 3u]);
    let warped = warped_from_linear(warp, uv);
    let functions = vec2<f32>(warped.functions);
    let linear = linear_from_texel(warp, vec2<i32>(texel), SIZE);
    let own_patch = patch_of(warp, warped, SIZE);
    let outside = texels_outside(own_patch, vec2<i32>(texel), 2);
    let has_patches = has_patches(warp, warped);
    let has = select(vec4<f32>(0.0), vec4<f32>(1.0), has_patches);
    let k = u32(inputs[i + 4u]);
    let side = SIDES[select(k ^ 1u, k, has_patches[k])];
    let across = texel_across(warp, uv, warped, side, SIZE);
    return array<f32, 20>(
        warped.uv.x, warped.uv.y, functions.x, functions.y, linear.x, linear.y,
        f32(own_patch.low.x), f32(own_patch.low.y), f32(own_patch.high.x), f32(own_patch.high.y),
        f32(outside.x), f32(outside.y), f32(outside.z), f32(outside.w),
        has.x, has.y, has.z, has.w,
        f32(across.x), f32(across.y),
    );
}
";

impl Twin for Warp {
    fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
        let (zero, one) = (inputs[0].constant(0.0), inputs[0].constant(1.0));
        let uv = V2::new(inputs[0], inputs[1]);
        let texel = V2::new(inputs[2], inputs[3]);
        let (warped, functions) = self.warped_from_linear(uv);
        let linear = self.linear_from_texel(&self.inverses(SIZE), texel);
        let patch = self.patch_of(functions, SIZE);
        let has = self.has_patches(functions);
        // The side k, or the one opposite where there is no patch.
        let k = inputs[4];
        let at = |values: [f64; 4]| {
            let [a, b, c, d] = values.map(|value| k.constant(value));
            let at_most = |i: f64| k.at_most(inputs[0].constant(i));
            let rest = L::select(at_most(2.0), c, d);
            L::select(at_most(0.0), a, L::select(at_most(1.0), b, rest))
        };
        let is_end = at([
            0.0,
            self.functions as f64 - 1.0,
            0.0,
            self.functions as f64 - 1.0,
        ]);
        let own = L::select(k.at_most(one), functions.x, functions.y);
        let is_there = !(own.at_most(is_end) & is_end.at_most(own));
        let side = V2::new(at([0.0, 0.0, -1.0, 1.0]), at([-1.0, 1.0, 0.0, 0.0]));
        let side = side.map(|s| L::select(is_there, s, -s));
        let across = self.texel_across(uv, functions, side, SIZE);
        let mut outputs = Vec::new();
        for pair in [warped, functions, linear, patch[0], patch[1]] {
            outputs.extend([pair.x, pair.y]);
        }
        outputs.extend(texels_outside(patch, texel, inputs[0].constant(2.0)));
        outputs.extend(has.map(|mask| L::select(mask, one, zero)));
        outputs.extend([across.x, across.y]);
        outputs
    }
}

/// Inside, outside, at boundaries of cells and of functions, and a step beside them.
fn place(random: &mut Random) -> f32 {
    match random.below(12) {
        0 => random.below(CELLS + 1) as f32 / CELLS as f32,
        1 => (random.below(6) as f32 / 5.0).next_up(),
        2 => random.number(),
        _ => random.share() as f32,
    }
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn the_shader_of_warps_computes_what_rust_does() {
    let mut random = Random(1);
    let warp = warp(5, &mut random);
    let mut case = || {
        let uv = [place(&mut random), place(&mut random)];
        let [x, y] = [SIZE.width, SIZE.height].map(|texels| random.below(texels as usize) as f32);
        [uv[0], uv[1], x, y, random.below(4) as f32]
    };
    let cases: Vec<_> = (0..20_000).map(|_| case()).collect();
    assert_twins(&source(&warp, WGSL), &warp, &cases, &table(&warp));
}

const NONE: &str = "
fn twin(i: u32) -> array<f32, 8> {
    let warp = load_warp();
    let size = vec2<u32>(48u, 20u);
    let texel = vec2<i32>(i32(inputs[i]), i32(inputs[i + 1u]));
    let linear = linear_from_texel(warp, texel, size);
    let warped = warped_from_linear(warp, linear);
    let bound = linear_bound(warp, texel, texel, size);
    let own_patch = patch_of(warp, warped, size);
    return array<f32, 8>(
        linear.x, linear.y, warped.uv.x, warped.uv.y, bound.x, bound.w, f32(own_patch.low.x), f32(own_patch.high.y),
    );
}
";

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn without_a_warp_texels_stay_where_they_are() {
    let cases: Vec<_> = (0..SIZE.width).map(|i| [i as f32, 17.0]).collect();
    let source = Shader::new("warp/none").compose() + NONE;
    let found = run_on_device(&source, &cases, &[], 8);
    for (case, found) in cases.iter().zip(found.chunks_exact(8)) {
        let [x, y] = [
            (case[0] + 0.5) / SIZE.width as f32,
            (case[1] + 0.5) / SIZE.height as f32,
        ];
        for (i, expected) in [x, y, x, y, x, y, 0.0, 19.0].into_iter().enumerate() {
            assert!((found[i] - expected).abs() < 1e-6, "{case:?} {found:?}");
        }
    }
}

#[test]
fn the_inverse_finds_a_texel_and_its_patch_holds_it() {
    let warp = warp(5, &mut Random(2));
    let inverses = warp.inverses(SIZE);
    let (size, mut decided) = (SIZE.texels(), 0);
    for i in 0..SIZE.width * SIZE.height {
        let texel = V2::new(f64::from(i % SIZE.width), f64::from(i / SIZE.width));
        let linear = warp.linear_from_texel(&inverses, texel);
        let (warped, functions) = warp.warped_from_linear(linear);
        let (x, y) = (warped.x * size.x - 0.5, warped.y * size.y - 0.5);
        let is_near = (x - texel.x).abs() < 0.01 && (y - texel.y).abs() < 0.01;
        // Where a function takes a texel to a boundary of another one, rounding may take the other.
        let to_boundary = |place: f64| (place * 5.0 - (place * 5.0).round()).abs();
        if to_boundary(linear.y) > 1e-4 && to_boundary(warped.x) > 1e-4 {
            assert!(is_near, "{texel:?} {warped:?}");
            let [low, high] = warp.patch_of(functions, SIZE);
            let is_inside = low.x <= texel.x && texel.x <= high.x;
            let is_inside = is_inside && low.y <= texel.y && texel.y <= high.y;
            assert!(is_inside, "{texel:?} {low:?} {high:?}");
            decided += 1;
        }
    }
    assert!(decided > SIZE.width * SIZE.height / 2, "{decided}");
}

#[test]
fn around_a_texel_lie_those_that_its_functions_take_beside_it() {
    let warp = warp(5, &mut Random(4));
    let inverses = warp.inverses(SIZE);
    let on_map = inverses.on_map();
    let (width, height) = (SIZE.width as usize, SIZE.height as usize);
    for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
        let texel = V2::new(x as f32, y as f32);
        let middle = warp.linear_from_texel(&inverses, texel);
        let column = (5 * (2 * x + 1) / (2 * width)).min(4);
        let row = ((5.0 * middle.y) as usize).min(4);
        for reach in 0..=super::BORDER {
            let around = warp.linear_around(&inverses, texel, reach);
            assert_eq!(around[reach], middle);
            for (i, place) in around.into_iter().enumerate().take(2 * reach + 1) {
                let at = |texel: usize, last: usize| (texel + i).saturating_sub(reach).min(last);
                let (x, y) = (at(x, width - 1), at(y, height - 1));
                let right = [on_map[0][row * width + x], on_map[1][column * height + y]];
                assert_eq!([place.x, place.y], right, "{texel:?} {reach} {i}");
            }
        }
    }
}

#[test]
fn texels_of_a_row_that_share_a_function_lie_where_each_does() {
    let warp = warp(5, &mut Random(5));
    let inverses = warp.inverses(SIZE);
    let mut counts = [0; 2];
    for first in 0..SIZE.width as usize {
        let columns = first..first + 4;
        let functions = columns
            .clone()
            .map(|x| (5 * (2 * x + 1)) / (2 * SIZE.width as usize));
        let is_shared =
            columns.end <= SIZE.width as usize && functions.clone().min() == functions.max();
        let function = warp.function_of_columns(&inverses, columns);
        assert_eq!(function.is_some(), is_shared, "{first}");
        counts[usize::from(is_shared)] += 1;
        let Some(function) = function else {
            continue;
        };
        for row in 0..SIZE.height as usize {
            let (x, y) = warp.linear_from_row::<4>(&inverses, function, [first, row]);
            for (i, &x) in x.iter().enumerate() {
                let texel = V2::new((first + i) as f32, row as f32);
                assert_eq!(V2::new(x, y), warp.linear_from_texel(&inverses, texel));
            }
        }
    }
    assert!(counts.iter().all(|&count| count > 5), "{counts:?}");
}

const BOUNDS: &str = "
fn twin(i: u32) -> array<f32, 8> {
    let warp = load();
    let a = vec4<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u], inputs[i + 3u]);
    let image = warped_bound(warp, a.xy, a.zw);
    let texels = vec4<i32>(a * vec4<f32>(vec4<u32>(SIZE, SIZE) - 1u));
    let linear = linear_bound(warp, texels.xy, texels.zw, SIZE);
    return array<f32, 8>(image.x, image.y, image.z, image.w, linear.x, linear.y, linear.z, linear.w);
}
";

/// Of boxes of one function, of a few, of blocks of them, and of more than the shader looks through.
#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn bounds_of_warped_boxes_hold_their_points() {
    for functions in [1, 5, 70] {
        let mut random = Random(3);
        let warp = warp(functions, &mut random);
        let inverses = warp.inverses(SIZE);
        let mut ends = || {
            let low = random.share();
            let size = [0.01, 0.3, 1.0][random.below(3)] * random.share();
            [low as f32, (low + size).min(1.0) as f32]
        };
        let mut case = || {
            let [x, y] = [ends(), ends()];
            [x[0], y[0], x[1], y[1]]
        };
        let cases: Vec<_> = (0..2_000).map(|_| case()).collect();
        let found = run_on_device(&source(&warp, BOUNDS), &cases, &table(&warp), 8);
        for (case, found) in cases.iter().zip(found.chunks_exact(8)) {
            let is_in = |bound: &[f32], at: V2<f64>| {
                let [left, top, right, bottom] = [0, 1, 2, 3].map(|i| f64::from(bound[i]));
                let slack = 1e-6;
                left - slack <= at.x
                    && at.x <= right + slack
                    && top - slack <= at.y
                    && at.y <= bottom + slack
            };
            let [left, top, right, bottom] = case.map(f64::from);
            for _ in 0..20 {
                let mix = |low: f64, high: f64, t: f64| low + (high - low) * t;
                let mut share = || [0.0, 1.0, random.share()][random.below(3)];
                let at = V2::new(mix(left, right, share()), mix(top, bottom, share()));
                let warped = warp.warped_from_linear(at).0;
                assert!(is_in(&found[..4], warped), "{case:?} {found:?} {warped:?}");
                let last = V2::from(SIZE.texels() - 1.0);
                let texel = at.zip(last, |place, last| {
                    (place as f32 * last as f32).floor().into()
                });
                let linear = warp.linear_from_texel(&inverses, texel);
                assert!(is_in(&found[4..], linear), "{case:?} {found:?} {linear:?}");
            }
        }
    }
}
