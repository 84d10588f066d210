//! Functions of the passes' shaders against what they are to compute, in Rust.

use super::warp_map::WarpMap;
use crate::gpu;
use crate::gpu::recording::{Recording, Source};
use crate::gpu::shaders::Shader;
use crate::map_size::MapSize;
use crate::neighbourhood;
use crate::twin::{Random, run_on_device};
use crate::warp::Warp;
use glam::{DMat3, DVec2, DVec3};

/// Functions with cells that have no width, and steep ones; some reach the centre of a texel at a boundary.
fn functions(count: usize, cells: usize, texels: usize, random: &mut Random) -> Vec<f32> {
    let function = |_| {
        let steps: Vec<_> = (0..cells)
            .map(|_| [0.0, 1.0, 30.0][random.below(3)] * random.share() + 1e-9)
            .collect();
        let total: f64 = steps.iter().sum();
        let mut sum = 0.0;
        let mut values = vec![0.0];
        for step in steps {
            sum += step / total;
            let texel = (sum * texels as f64).floor();
            let is_at_centre = random.below(3) == 0;
            let value = if is_at_centre {
                (texel + 0.5) / texels as f64
            } else {
                sum
            };
            values.push((value as f32).clamp(*values.last().unwrap(), 1.0));
        }
        values[cells] = 1.0;
        values
    };
    (0..2 * count).flat_map(function).collect()
}

/// What the pass "warp map" makes of functions: their inverses, and the least and greatest values of blocks of them.
fn finished(warp: &Warp, size: MapSize) -> [Vec<f32>; 4] {
    let gpu = gpu::gpu("").unwrap();
    let mut frame = Recording::together(&gpu, 1, true).remove(0);
    let (functions, cells) = (warp.functions as u32, warp.boundaries as u32 - 1);
    let map = WarpMap::new(&frame, functions, cells, size).unwrap();
    let numbers = map.table.size() as usize / 4;
    let values = bytemuck::cast_slice(&warp.values);
    gpu.queue.write_buffer(&map.table, 0, values);
    map.finish(&mut frame, size);
    let read = frame
        .read::<f32>(Source::Kept(&map.table), numbers)
        .unwrap();
    let table = frame.submit().unwrap().take(&read).unwrap();
    let blocks = warp.functions.div_ceil(16) * warp.boundaries;
    let mut rest = &table[warp.values.len()..];
    let inverses = [size.width, size.height].map(|texels| warp.functions * texels as usize);
    [inverses[0], inverses[1], 2 * blocks, 2 * blocks].map(|count| {
        let (part, others) = rest.split_at(count);
        rest = others;
        part.to_vec()
    })
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn the_shader_inverts_functions_as_rust_does() {
    let mut random = Random(1);
    for (count, cells, width, height) in [
        (1, 1, 1, 1),
        (1, 32, 64, 64),
        (5, 33, 48, 130),
        (70, 8, 16, 7),
        (2, 600, 256, 31),
    ] {
        let size = MapSize { width, height };
        let warp = Warp {
            functions: count,
            boundaries: cells + 1,
            values: functions(count, cells, width as usize, &mut random),
        };
        let [along_x, along_y, least, greatest] = finished(&warp, size);
        let expected = warp.inverses(size).on_map();
        let axes = warp.values.chunks(count * warp.boundaries);
        let axes = axes.zip([width as usize, height as usize]);
        for ((found, expected), (values, texels)) in
            [along_x, along_y].iter().zip(&expected).zip(axes)
        {
            assert_eq!(found.len(), expected.len());
            for (i, (found, expected)) in found.iter().zip(expected).enumerate() {
                // Rounding of a step within a cell.
                assert!((found - expected).abs() < 1e-5, "{i}: {found} {expected}");
                // What an inverse is: up to there the function is below the centre of the texel, and beyond it above.
                let function = &values[i / texels * warp.boundaries..][..warp.boundaries];
                let centre = ((i % texels) as f64 + 0.5) / texels as f64;
                let at = |place: f64| {
                    let place = place.clamp(0.0, 1.0) * cells as f64;
                    let cell = (place as usize).min(cells - 1);
                    let [a, b] = [function[cell], function[cell + 1]].map(f64::from);
                    a + (b - a) * (place - cell as f64)
                };
                let (before, after) = (f64::from(*found) - 1e-5, f64::from(*found) + 1e-5);
                let is_inverse = at(before) <= centre + 1e-6 && centre - 1e-6 <= at(after);
                assert!(is_inverse, "{i}: {found} {centre}");
            }
        }
        let blocks = warp.values.chunks(count * warp.boundaries);
        let blocks = blocks.flat_map(|axis| axis.chunks(16 * warp.boundaries));
        let bounds = least.iter().zip(&greatest);
        let mut bounds = bounds.map(|(least, greatest)| [*least, *greatest]);
        for block in blocks {
            for boundary in 0..warp.boundaries {
                let values = block.iter().skip(boundary).step_by(warp.boundaries);
                let ends = values.fold([1.0f32, 0.0], |[a, b], &v| [a.min(v), b.max(v)]);
                assert_eq!(bounds.next(), Some(ends));
            }
        }
        assert_eq!(bounds.next(), None);
    }
}

const SHARE: &str = "
fn twin(i: u32) -> array<f32, 1> {
    let bits = (u32(inputs[i]) << 13u) | u32(inputs[i + 1u]);
    return array<f32, 1>(bilinear_share(bits, vec2<f32>(inputs[i + 2u], inputs[i + 3u])));
}
";

/// The share by its definition: every texel weighs as much as its tent covers the receiver, which is looked up at the
/// border of its own texel where it lies beyond.
fn bilinear_share(bits: u32, aside: DVec2, reach: i32) -> f64 {
    let aside = aside.clamp(DVec2::splat(-0.5), DVec2::splat(0.5));
    let side = 2 * reach + 1;
    let weight = |texel: i32| {
        let step = DVec2::new(
            f64::from(texel % side - reach),
            f64::from(texel / side - reach),
        );
        let tent = (DVec2::ONE - (step - aside).abs()).max(DVec2::ZERO);
        tent.x * tent.y
    };
    let texels = (0..side * side).filter(|texel| bits >> texel & 1 == 1);
    texels.map(weight).sum()
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn texels_around_a_receiver_weigh_bilinearly() {
    for reach in [1, 2] {
        let mut random = Random(2);
        let mut case = || {
            let aside = |random: &mut Random| match random.below(8) {
                0 => [0.0, 0.5, -0.5, 0.7, -1.3][random.below(5)],
                1 => 1e-6 * (random.share() - 0.5),
                _ => random.share() - 0.5,
            };
            let [x, y] = [aside(&mut random), aside(&mut random)];
            let bits = [random.below(1 << 12), random.below(1 << 13)];
            [bits[0] as f32, bits[1] as f32, x as f32, y as f32]
        };
        let cases: Vec<_> = (0..20_000).map(|_| case()).collect();
        let source = Shader::new("lookup").compose() + SHARE;
        let given = format!("override reach: i32 = {reach};");
        let source = source.replace("override reach: i32 = 0;", &given);
        assert!(source.contains(&given));
        let found = run_on_device(&source, &cases, &[], 1);
        for (case, found) in cases.iter().zip(found) {
            let bits = (case[0] as u32) << 13 | case[1] as u32;
            let aside = DVec2::new(f64::from(case[2]), f64::from(case[3]));
            let expected = bilinear_share(bits, aside, reach);
            let on_cpu = neighbourhood::bilinear_share(bits, [case[2], case[3]], reach as usize);
            for found in [found, on_cpu] {
                assert!(
                    (f64::from(found) - expected).abs() < 1e-6,
                    "{case:?}: {found} {expected}"
                );
            }
        }
    }
}

const EDGES: &str = "
fn row(i: u32) -> vec3<f32> {
    return vec3<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u]);
}

fn twin(i: u32) -> array<f32, 6> {
    let none = vec3<f32>(0.0);
    let a = row(i);
    let b = row(i + 3u);
    let ray = row(i + 12u);
    let e = edges_at(triangle_from_homogeneous(a, b, row(i + 6u), none, none.xy), ray);
    // Over the edge from b to a.
    let f = edges_at(triangle_from_homogeneous(b, a, row(i + 9u), none, none.xy), ray);
    return array<f32, 6>(e.x, e.y, e.z, f.x, f.y, f.z);
}
";

/// Two triangles with a common edge, and a ray: a point of the world each, or of a plane before the light. Some have
/// a corner at the light, some are seen edge-on, and some rays go through an edge or a corner.
fn two_triangles(random: &mut Random) -> [f32; 15] {
    let is_parallel = random.below(2) == 0;
    let size = [1.0, 1e-3, 1e3][random.below(3)];
    let point = |random: &mut Random| {
        let place = DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0)) * size;
        if is_parallel {
            place.truncate().extend(1.0)
        } else {
            place
        }
    };
    let mut corners = [0; 4].map(|_| point(random));
    let mut ray = point(random);
    match random.below(10) {
        0 => corners[random.below(4)] = DVec3::ZERO,
        1 => corners[2] = corners[0].lerp(corners[1], random.share()),
        2 => ray = corners[random.below(4)],
        3 => ray = corners[0].lerp(corners[1], random.share()),
        4 => corners[3] = corners[0] + 1e-4 * (corners[1] - corners[0]).any_orthogonal_vector(),
        _ => {}
    }
    if random.below(3) == 0 {
        ray = corners[0]
            + random.share() * (corners[1] - corners[0])
            + 0.3 * random.share() * corners[2];
    }
    let [a, b, c, d] = corners;
    let values = [a, b, c, d, ray].map(|v| v.as_vec3().to_array());
    std::array::from_fn(|i| values[i / 3][i % 3])
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn a_ray_is_inside_of_the_edges_where_it_meets_the_triangle() {
    let mut random = Random(3);
    let cases: Vec<_> = (0..20_000).map(|_| two_triangles(&mut random)).collect();
    let found = run_on_device(&(Shader::new("lookup").compose() + EDGES), &cases, &[], 6);
    let mut counts = [0; 3];
    for (case, found) in cases.iter().zip(found.chunks_exact(6)) {
        let [a, b, c, d, ray] =
            [0, 3, 6, 9, 12].map(|i| DVec3::from_array([0, 1, 2].map(|j| f64::from(case[i + j]))));
        let (first, second) = (&found[..3], &found[3..]);
        let mut areas = [0.0; 2]; // where rounding cannot turn it
        for ((corners, found), area) in [([a, b, c], first), ([b, a, d], second)]
            .into_iter()
            .zip(&mut areas)
        {
            let matrix = DMat3::from_cols_array_2d(&corners.map(|corner| corner.to_array()));
            let size = corners
                .iter()
                .fold(0.0, |size: f64, corner| size.max(corner.length()));
            let signed = matrix.determinant();
            if corners.contains(&DVec3::ZERO) {
                assert_eq!(found, [0.0; 3], "{case:?}");
                counts[0] += 1;
            } else if signed.abs() > 1e-5 * size.powi(3) {
                *area = signed.abs();
                // The ray as a sum of the corners: the parts are the edges' over the area.
                let parts = matrix.inverse() * ray;
                let margin = 1e-5 * size * size * ray.length();
                for (part, &edge) in parts.to_array().iter().zip(found) {
                    let expected = part * *area;
                    let off = (f64::from(edge) - expected).abs();
                    assert!(off < margin, "{case:?}: {found:?} {expected} {margin}");
                }
                counts[1] += usize::from(parts.min_element() > 0.0);
            }
        }
        // The third edge of both is the common one: what is inside of one by it is outside of the other, to the bit.
        if areas[0] * areas[1] > 0.0 {
            assert_eq!(first[2].abs(), second[2].abs(), "{case:?} {found:?}");
            counts[2] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 1_000), "{counts:?}");
}

const INTEGERS: &str = "
fn integer(i: u32) -> Pair {
    return pair(u32(inputs[i]) | (u32(inputs[i + 1u]) << 16u), u32(inputs[i + 2u]) | (u32(inputs[i + 3u]) << 16u));
}

fn digits(value: Pair) -> vec4<f32> {
    let words = vec2<u32>(first_of(value), second_of(value));
    return vec4<f32>((words.xxyy >> vec4<u32>(0u, 16u, 0u, 16u)) & vec4<u32>(0xffffu));
}

fn twin(i: u32) -> array<f32, 14> {
    let a = integer(i);
    let rounded = float_from_integer(a);
    let sum = digits(sum_of(a, integer(i + 4u)));
    let difference = digits(difference_of(a, integer(i + 4u)));
    let again = digits(integer_from_float(rounded));
    return array<f32, 14>(
        sum.x, sum.y, sum.z, sum.w, difference.x, difference.y, difference.z, difference.w,
        select(0.0, 1.0, is_zero(a)), rounded, again.x, again.y, again.z, again.w,
    );
}
";

/// From low to high.
fn digits(value: u64) -> [f32; 4] {
    [0, 16, 32, 48].map(|shift| (value >> shift & 0xffff) as f32)
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn pairs_are_integers_of_64_bits() {
    let mut random = Random(5);
    // Short ones, and such as are half-way between two numbers of float32, or next to there.
    let mut integer = || {
        let bits = random.below(63);
        let word = |random: &mut Random| random.below(1 << 32) as u64;
        let any = (word(&mut random) << 32 | word(&mut random)) >> (1 + bits);
        let half_way = (1u64 << 24 | any & 0xff_ffff) << 1 | 1;
        match random.below(4) {
            0 => any,
            1 => (half_way << (bits % 38)) + random.below(3) as u64 - 1,
            2 => 1 << bits.min(62),
            _ => (1 << bits.min(62)) - 1,
        }
    };
    let pairs: Vec<_> = (0..20_000).map(|_| [integer(), integer()]).collect();
    let cases: Vec<[f32; 8]> = pairs
        .iter()
        .map(|pair| std::array::from_fn(|i| digits(pair[i / 4])[i % 4]))
        .collect();
    let source = Shader::new("lib/pairs").compose() + INTEGERS;
    let found = run_on_device(&source, &cases, &[], 14);
    for (&[a, b], found) in pairs.iter().zip(found.chunks_exact(14)) {
        let case = format!("{a:#x} {b:#x}");
        assert_eq!(found[..4], digits(a.wrapping_add(b)), "{case}");
        assert_eq!(found[4..8], digits(a.wrapping_sub(b)), "{case}");
        assert_eq!(found[8], f32::from(u8::from(a == 0)), "{case}");
        assert_eq!(found[9], a as f32, "{case}");
        assert_eq!(found[10..], digits(found[9] as u64), "{case}");
    }
}
