//! Every kind's shader against its formulas.

use super::{Formulas, Homography, Kind, LogPerspective, Paraboloid, Parallel, Perspective};
use crate::gpu::shaders::{Shader, file_of};
use crate::lanes::{Lane, V2, V3};
use crate::twin::{Random, Twin, assert_twins};
use glam::DMat3;

const WGSL: &str = "
fn row(i: u32) -> vec4<f32> {
    return vec4<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u], 0.0);
}

fn twin(i: u32) -> array<f32, 32> {
    let q = row(i).xyz;
    let normal = row(i + 3u).xyz;
    let texel = row(i + 6u).xy;
    let step = row(i + 8u).xy;
    let most = inputs[i + 10u];
    let depth = inputs[i + 11u];
    var projection: Projection;
    projection.scale = row(i + 12u).xy;
    projection.convergence = inputs[i + 32u];
    for (var j = 0u; j < 3u; j += 1u) {
        projection.texel_from_place[j] = row(i + 14u + 3u * j);
        projection.place_from_texel[j] = row(i + 23u + 3u * j);
    }
    let homogeneous = homogeneous_from_projected(projection, q);
    let on_map = homogeneous_texel(projection, q);
    let centred = centred_texel_from_projected(projection, q);
    let point = projected_from_ray(projection, normal, depth);
    let of_point = ray_from_projected(projection, q);
    let ray = ray_from_texel(projection, texel);
    let direction = direction_from_texel(projection, texel);
    let plane = depth_plane(projection, normal, q, depth);
    let slope = depth_slope(projection, normal, q);
    let height = height_slope(projection, normal, q);
    return array<f32, 32>(
        homogeneous.x, homogeneous.y, homogeneous.z,
        centred.x, centred.y,
        point.x, point.y, point.z,
        depth_from_projected(q),
        of_point.x, of_point.y, of_point.z,
        ray.x, ray.y, ray.z,
        direction.x, direction.y, direction.z,
        plane.x, plane.y, plane.z,
        depth_on_plane(projection, normal, q),
        slope.x, slope.y,
        depth_of_neighbour(projection, normal, q, step, most),
        beam_growth(projection, q),
        texel_width(projection, q),
        height.x, height.y,
        on_map.x, on_map.y, on_map.z,
    );
}
";

const INPUTS: usize = 33;

fn v3<L: Lane>(inputs: &[L], i: usize) -> V3<L> {
    V3::new(inputs[i], inputs[i + 1], inputs[i + 2])
}

fn v2<L: Lane>(inputs: &[L], i: usize) -> V2<L> {
    V2::new(inputs[i], inputs[i + 1])
}

fn outputs<L: Lane>(kind: &impl Formulas<L>, inputs: &[L]) -> Vec<L> {
    let (q, normal) = (v3(inputs, 0), v3(inputs, 3));
    let (texel, step) = (v2(inputs, 6), v2(inputs, 8));
    let (most, depth) = (inputs[10], inputs[11]);
    let mut found = Vec::new();
    let mut push = |v: V3<L>| found.extend([v.x, v.y, v.z]);
    push(kind.homogeneous_from_projected(q));
    push(
        kind.centred_texel_from_projected(q)
            .extend(kind.projected_from_ray(normal, depth).x),
    );
    let point = kind.projected_from_ray(normal, depth);
    push(V3::new(point.y, point.z, kind.depth_from_projected(q)));
    push(kind.ray_from_projected(q));
    push(kind.ray_from_texel(texel));
    push(kind.direction_from_texel(texel));
    push(kind.depth_plane(normal, q, depth));
    let slope = kind.depth_slope(normal, q);
    push(V3::new(kind.depth_on_plane(normal, q), slope.x, slope.y));
    found.extend([
        kind.depth_of_neighbour(normal, q, step, most),
        kind.beam_growth(q),
        kind.texel_width(q),
    ]);
    let height = kind.height_slope(normal, q);
    let on_map = kind.homogeneous_texel(q);
    found.extend([height.x, height.y, on_map.x, on_map.y, on_map.z]);
    found
}

impl Twin for Kind {
    fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
        let rows = |i: usize| [0, 3, 6].map(|row| v3(inputs, i + row));
        let homography = || Homography {
            texel_from_place: rows(14),
            place_from_texel: rows(23),
            reach: inputs[0],
            convergence: inputs[32],
        };
        match self {
            Self::Parallel(kind) => outputs(kind, inputs),
            Self::Perspective(kind) => outputs(kind, inputs),
            Self::Paraboloid(_) => outputs(
                &Paraboloid {
                    scale: v2(inputs, 12),
                },
                inputs,
            ),
            Self::Homography(_) => outputs(&homography(), inputs),
            Self::LogPerspective(_) => outputs(
                &LogPerspective {
                    straight: homography(),
                    rate: inputs[13],
                },
                inputs,
            ),
        }
    }
}

/// Points around the rays' origin and far off, at the rim, behind, nowhere, and planes that the ray grazes.
fn case(random: &mut Random) -> [f32; INPUTS] {
    let mut case = [0.0; INPUTS].map(|_: f32| random.number());
    let scale = 10f64.powi(random.below(13) as i32 - 6) as f32;
    for coordinate in &mut case[..3] {
        *coordinate *= scale;
    }
    match random.below(8) {
        0 => case[2] = 0.0,
        1 => case[2] = -case[2].abs(),
        2 => (case[0], case[1]) = (0.0, 0.0),
        3 => (case[0], case[1]) = (case[0] * 1e-4, case[1] * 1e-4),
        4 => case[5] = -(case[0] * case[3] + case[1] * case[4]) / case[2],
        _ => {}
    }
    case[10] = [2.0, 1e4][random.below(2)];
    case[12] = case[12].abs().max(1e-3);
    case[13] = case[13].abs().max(1e-3);
    // Rays that are parallel, and that meet beyond the point or before it.
    case[32] *= [0.0, 1e-6, 0.05, 1.0][random.below(4)];
    case
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn shaders_of_projections_compute_what_rust_does() {
    let homography = Homography::new(DMat3::IDENTITY, 1.0);
    let kinds: [Kind; 5] = [
        Parallel.into(),
        homography.into(),
        LogPerspective::new(homography, 1.0).into(),
        Perspective.into(),
        Paraboloid::UNIT.into(),
    ];
    for kind in kinds {
        let mut random = Random(1);
        let cases: Vec<_> = (0..20_000).map(|_| case(&mut random)).collect();
        let source = Shader::new(file_of("projection", kind.name())).compose() + WGSL;
        assert_twins(&source, &kind, &cases, &[]);
    }
}
