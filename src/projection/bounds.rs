//! Bounds that the shaders compute for triangles and boxes of texels, against points of them in float64.

use super::{
    Formulas, Homography, Kind, LogPerspective, Paraboloid, Parallel, Perspective, Projection,
};
use crate::gpu::projection_uniform::ProjectionUniform;
use crate::gpu::shaders::{Shader, file_of};
use crate::lanes::{V2, V3};
use crate::twin::{Random, run_on_device};
use glam::{DMat3, DVec2, DVec3};

const WGSL: &str = "
fn row(i: u32) -> vec3<f32> {
    return vec3<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u]);
}

fn twin(i: u32) -> array<f32, 18> {
    let a = row(i);
    let b = row(i + 3u);
    let c = row(i + 6u);
    let middle = row(i + 9u).xy;
    let reach = row(i + 11u).xy;
    let edge = row(i + 13u);
    let plane = row(i + 16u);
    var projection: Projection;
    projection.z_min = inputs[i + 19u];
    projection.z_max = inputs[i + 20u];
    projection.least_w = inputs[i + 21u];
    projection.scale = row(i + 22u).xy;
    projection.convergence = inputs[i + 42u];
    for (var j = 0u; j < 3u; j += 1u) {
        projection.texel_from_place[j] = vec4<f32>(row(i + 24u + 3u * j), 0.0);
        projection.place_from_texel[j] = vec4<f32>(row(i + 33u + 3u * j), 0.0);
    }
    let extent = texels_of_triangle(projection, a, b, c);
    let depths = depths_of_triangle(a, b, c);
    let range = depths_on_plane_in_box(projection, plane, middle, reach);
    let line = line_of_edge(projection, edge, abs(middle) + reach);
    let texel = homogeneous_texel(projection, a);
    return array<f32, 18>(
        extent.low.x, extent.low.y, extent.high.x, extent.high.y,
        depths.x, depths.y,
        range.x, range.y,
        line.x, line.y, line.z, line.w,
        greatest_of_edge(projection, edge, middle, reach),
        texel.x, texel.y, texel.z,
        side_from_projected(projection, a),
        clamp_to_nearest(a.z, projection.z_min),
    );
}
";

const INPUTS: usize = 43;
const OUTPUTS: usize = 18;
const SIDE: f64 = 512.0;

/// A map of the kind, in the shaders' units, and whether its depths begin near the rays' origin.
fn projection(kind: usize, random: &mut Random) -> Projection {
    let half = DVec2::splat(0.5 * SIDE);
    let [right, down] = [0; 2].map(|_| 1.2 * random.share() - 0.6);
    let place = DMat3::from_cols(
        DVec3::new(half.x, 0.0, right),
        DVec3::new(0.0, half.y, down),
        DVec3::new(0.0, 0.0, 1.5),
    );
    let stretched = |kind: Kind| kind.stretched(half).0;
    let kind: Kind = match kind {
        0 => Parallel.into(),
        1 => {
            let convergence = [0.0, 1e-6, 0.2][random.below(3)];
            let homography = Homography::new(place, 1.0);
            homography.with_convergence(convergence).into()
        }
        2 => Perspective.into(),
        3 => {
            let places = DMat3::from_cols(
                DVec3::new(half.x, 0.0, right),
                DVec3::new(0.0, 0.0, down.signum() * (0.2 + 0.6 * down.abs())),
                DVec3::new(0.0, 1.5, 1.5),
            );
            let convergence = [0.0, 1e-6, 0.2][random.below(3)];
            let straight = Homography::new(places, 1.0).with_convergence(convergence);
            LogPerspective::new(straight, 20.0 + 400.0 * random.share()).into()
        }
        _ => stretched(Paraboloid::UNIT.into()),
    };
    Projection {
        kind,
        origin: DVec3::ZERO,
        x_axis: DVec3::X,
        y_axis: DVec3::Y,
        z_axis: DVec3::Z,
        centre: half,
        width: SIDE as u32,
        height: SIDE as u32,
        near: [0.2, 1e-3, 1e-6][random.below(3)],
        far: 1.0,
        normalizes_depth: false,
    }
}

/// In and around the map, behind the rays' origin, in it, and straight behind it.
fn corner(kind: &Kind, random: &mut Random) -> V3<f64> {
    let mut unit = || 2.0 * random.share() - 1.0;
    let place = V2::new(unit(), unit());
    let z = unit();
    match (kind, random.below(8)) {
        (Kind::Parallel(_), _) => (place * SIDE).extend(z),
        (Kind::Homography(_) | Kind::LogPerspective(_), _) => place.extend(z),
        (_, 0) => (place * 1e-4).extend(z * 1e-4),
        (Kind::Perspective(_), _) => (place * (SIDE * z)).extend(z),
        (_, 1) => V3::new(0.0, 0.0, z),
        (_, 2) => place.extend(0.0),
        _ => place.extend(z),
    }
}

fn triangle(kind: &Kind, random: &mut Random) -> [V3<f64>; 3] {
    let [a, b, c] = [0; 3].map(|_| corner(kind, random));
    let size = [1.0, 0.1, 1e-3, 0.0][random.below(4)];
    [a, a + (b - a) * size, a + (c - a) * size]
}

/// The ray of a texel, of any length, as edges are evaluated on it.
fn direction(kind: &Kind, centred: V2<f64>) -> V3<f64> {
    let (homography, texel) = match kind {
        Kind::Homography(homography) => (homography, centred),
        Kind::LogPerspective(log) => {
            let s = (-centred.y / log.rate).exp();
            (&log.straight, V2::new(centred.x, s))
        }
        _ => return kind.direction_from_texel(centred),
    };
    let homogeneous = texel.extend(1.0);
    let [x, y, z] = homography.place_from_texel.map(|row| row.dot(homogeneous));
    V3::new(x, y, z)
}

/// The kind of rounded numbers, which is what the shader knows.
fn rounded(kind: &Kind, case: &[f32; INPUTS]) -> Kind {
    let rows = |i: usize| [0, 3, 6].map(|row| v3(case, i + row));
    let rounded = |homography: &Homography| Homography {
        texel_from_place: rows(24),
        place_from_texel: rows(33),
        convergence: case[42].into(),
        ..*homography
    };
    match kind {
        Kind::Homography(homography) => rounded(homography).into(),
        Kind::LogPerspective(log) => {
            LogPerspective::new(rounded(&log.straight), case[23].into()).into()
        }
        kind => *kind,
    }
}

fn v3(values: &[f32], i: usize) -> V3<f64> {
    let [x, y, z] = [0, 1, 2].map(|j| f64::from(values[i + j]));
    V3::new(x, y, z)
}

fn case(kind: usize, random: &mut Random) -> (Kind, [f32; INPUTS]) {
    let projection = projection(kind, random);
    let uniform = ProjectionUniform::new(&projection, DVec3::ZERO);
    let corners = triangle(&projection.kind, random);
    let reach = 0.01 + [0.5, 8.0, 100.0][random.below(3)] * random.share();
    let mut middle = || (SIDE - reach) * (random.share() - 0.5);
    let (middle, edge_place) = ([middle(), middle()], [middle(), middle()]);
    let number = |random: &mut Random| 2.0 * random.share() - 1.0;
    let edge = [0; 3].map(|_| number(random));
    // Through a place near the box, so that its function has either sign there.
    let ray = direction(&projection.kind, V2::new(edge_place[0], edge_place[1]));
    let edge = [
        edge[0],
        edge[1],
        -(edge[0] * ray.x + edge[1] * ray.y) / ray.z,
    ];
    let plane = [0; 3].map(|_| number(random) * [1.0, 1e-2][random.below(2)]);
    let mut case = [0.0; INPUTS];
    let flat = corners.iter().flat_map(|q| [q.x, q.y, q.z]);
    let values = flat
        .chain(middle)
        .chain([reach; 2])
        .chain(edge)
        .chain(plane);
    for (to, from) in case.iter_mut().zip(values) {
        *to = from as f32;
    }
    case[19..24].copy_from_slice(&[
        uniform.z_min,
        uniform.z_max,
        uniform.least_w,
        uniform.scale[0],
        uniform.scale[1],
    ]);
    for j in 0..3 {
        case[24 + 3 * j..27 + 3 * j].copy_from_slice(&uniform.texel_from_place[j][..3]);
        case[33 + 3 * j..36 + 3 * j].copy_from_slice(&uniform.place_from_texel[j][..3]);
    }
    case[42] = uniform.convergence;
    (rounded(&projection.kind, &case), case)
}

/// Whether a point is in front of where the shader cuts triangles off.
fn is_kept(kind: &Kind, case: &[f32; INPUTS], q: V3<f64>) -> bool {
    match kind {
        Kind::Perspective(_) => q.z >= f64::from(case[19]),
        Kind::Homography(homography)
        | Kind::LogPerspective(LogPerspective {
            straight: homography,
            ..
        }) => homography.homogeneous_texel(q).z >= f64::from(case[21]),
        _ => true,
    }
}

fn assert_triangle_is_bounded(
    kind: &Kind,
    case: &[f32; INPUTS],
    found: &[f32],
    random: &mut Random,
) {
    let [a, b, c] = [0, 3, 6].map(|i| v3(case, i));
    let [s, t] = [0; 2].map(|_| [0.0, 1.0, random.share(), random.share()][random.below(4)]);
    let [s, t] = if s + t > 1.0 {
        [1.0 - s, 1.0 - t]
    } else {
        [s, t]
    };
    let q = a + (b - a) * s + (c - a) * t;
    if !is_kept(kind, case, q) {
        return;
    }
    let texel = kind.centred_texel_from_projected(q);
    let bound = |i: usize| f64::from(found[i]);
    for (axis, place) in [texel.x, texel.y].into_iter().enumerate() {
        let (low, high) = (bound(axis), bound(2 + axis));
        // As in lib/coverage.wgsl.
        let slack = 0.01 + 1e-6 * low.abs().max(high.abs());
        let is_held = low - slack <= place && place <= high + slack;
        assert!(
            is_held || place.is_nan(),
            "{kind:?} {case:?} {q:?} {place} {found:?}"
        );
    }
    let depth = kind.depth_from_projected(q);
    let slack = 1e-6 * (depth.abs() + bound(5).abs());
    let is_held = bound(4) - slack <= depth && depth <= bound(5) + slack;
    assert!(is_held, "{kind:?} {case:?} {q:?} {depth} {found:?}");
}

fn assert_box_is_bounded(kind: &Kind, case: &[f32; INPUTS], found: &[f32], random: &mut Random) {
    let mut inside = |axis: usize| {
        let share = [-1.0, 1.0, 2.0 * random.share() - 1.0][random.below(3)];
        // A box is wider than its texels by that, see lib/coverage.wgsl, which covers rounding.
        f64::from(case[9 + axis]) + share * (f64::from(case[11 + axis]) - 0.01)
    };
    let centred = V2::new(inside(0), inside(1));
    let direction = direction(kind, centred);
    let bound = |i: usize| f64::from(found[i]);
    let edge = v3(case, 13).dot(direction);
    assert!(
        edge <= bound(12),
        "{kind:?} {case:?} {centred:?} {edge} {found:?}"
    );
    if kind.has_straight_edges() {
        let [x, y] = [centred.x as f32, centred.y as f32];
        let line = f64::from(found[8] * x + found[9] * y + found[10]);
        assert!(
            (line - edge).abs() <= bound(11),
            "{case:?} {centred:?} {edge} {line} {found:?}"
        );
    }
    let depth = kind.depth_on_plane(v3(case, 16), kind.ray_from_texel(centred));
    let is_met = if kind.is_central() {
        depth > 0.0
    } else {
        direction.z > 0.0
    };
    let is_held = bound(6) <= depth && depth <= bound(7);
    assert!(
        is_held || !is_met,
        "{kind:?} {case:?} {centred:?} {depth} {found:?}"
    );
}

fn assert_corner_is_placed(kind: &Kind, case: &[f32; INPUTS], found: &[f32]) {
    let a = v3(case, 0);
    let texel = kind.centred_texel_from_projected(a);
    // Where rays meet, no caster is nearer than the nearest depth.
    let is_caster = kind.convergence() == 0.0 || a.z >= f64::from(case[19]);
    let is_in_map = texel.x.abs().max(texel.y.abs()) <= 0.5 * SIDE && is_caster;
    let homogeneous = v3(found, 13);
    let side = found[16];
    if side > 0.0 {
        let there = homogeneous.xy() / homogeneous.z;
        let slack = 1e-5 * (SIDE + texel.length());
        let is_there = (there - texel).length() <= slack / homogeneous.z.min(1.0);
        assert!(
            homogeneous.z > 0.0 && is_there,
            "{kind:?} {case:?} {texel:?} {found:?}"
        );
    }
    let z_min = case[19];
    let (expected, clamped) = match kind {
        Kind::Parallel(_) => (true, a.z.max(z_min.into())),
        Kind::Homography(_) | Kind::LogPerspective(_) => (is_in_map, a.z.max(z_min.into())),
        Kind::Perspective(_) => (case[2] > z_min.max(case[20] / 65536.0), a.z),
        Kind::Paraboloid(_) => (a.z > 0.0, a.z),
    };
    let is_sure = !matches!(kind, Kind::Homography(_) | Kind::LogPerspective(_)) || is_in_map;
    assert!(
        !is_sure || expected == (side > 0.0),
        "{kind:?} {case:?} {found:?}"
    );
    assert!(
        clamped == f64::from(found[17]),
        "{kind:?} {case:?} {found:?}"
    );
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn bounds_of_triangles_and_of_boxes_hold_their_points() {
    for kind in 0..5 {
        let mut random = Random(1);
        let cases: Vec<_> = (0..5_000).map(|_| case(kind, &mut random)).collect();
        let inputs: Vec<_> = cases.iter().map(|case| case.1).collect();
        let source = Shader::new(file_of("projection", cases[0].0.name())).compose() + WGSL;
        let found = run_on_device(&source, &inputs, &[], OUTPUTS);
        for ((kind, case), found) in cases.iter().zip(found.chunks_exact(OUTPUTS)) {
            assert_corner_is_placed(kind, case, found);
            for _ in 0..20 {
                assert_triangle_is_bounded(kind, case, found, &mut random);
                assert_box_is_bounded(kind, case, found, &mut random);
            }
        }
    }
}
