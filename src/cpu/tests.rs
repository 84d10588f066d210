//! The engine against the reference, pixel by pixel, on scenes that are hard for float32.

use super::exact::{Answer, exact};
use super::lanes::{LANES, Simd};
use super::light_grid::GRID;
use super::rasterize::{Image, NONE, rasterize};
use super::shapes::{Corners, Shapes};
use super::view::{Nearness, Place, View};
use crate::bvh::{Everything, Search};
use crate::camera::{Camera, Rays};
use crate::light::Light;
use crate::reference::{Reference, reference};
use crate::scene::Scene;
use crate::twin::Random;
use glam::{DMat4, DQuat, DVec2, DVec3, DVec4};
use std::sync::Arc;

#[cfg(test)]
mod counts;
#[cfg(test)]
mod crowds;
#[cfg(test)]
mod importance;
#[cfg(test)]
mod pages;

/// Columns, rows and nearness are the point's own coordinates.
pub(super) fn flat_view() -> View {
    View {
        origin: DVec3::ZERO,
        rows: [DVec4::X, DVec4::Y, DVec4::W],
        nearness: Nearness::Linear(DVec4::Z),
        width: GRID,
        height: GRID,
        seen: (f64::NEG_INFINITY, f64::INFINITY),
        light: None,
    }
}

/// The shapes of a scene's one triangle around an origin, and whether they are for float64 to set up.
#[inline(always)]
pub(super) fn prepared<S: Simd>(
    simd: S,
    places: &[Place],
    view: &View,
    origin: [f32; 2],
    side: f32,
) -> (Shapes, bool) {
    let corners = Corners::new(simd, places, [[0, 1, 2]; LANES]);
    let wide = corners.wide(simd, view) & 1 != 0;
    let corners = corners.relative_to(origin);
    (Shapes::new(simd, &corners, view.rounding(), side), wide)
}

fn scene_of(corners: &[[DVec3; 3]]) -> Scene {
    let triangles = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Scene::new(corners.concat(), triangles.collect()).unwrap()
}

/// Triangles of all sizes around the origin: slivers, pairs that share an edge, triangles along the axes, and without
/// area.
fn soup(random: &mut Random, count: usize) -> Vec<[DVec3; 3]> {
    let mut corners = Vec::new();
    while corners.len() < count {
        let size = 10_f64.powf(1.5 * random.signed() - 1.0);
        let a = random.vector();
        let (b, c) = (a + size * random.vector(), a + size * random.vector());
        // One is far larger than what is seen.
        if corners.len() == count / 2 {
            corners.push([a, a + 1e3 * random.vector(), a + 1e3 * random.vector()]);
        }
        match corners.len() % 5 {
            0 => corners.push([a, b, c]),
            1 => corners.push([a, b, a.lerp(b, 0.4) + 1e-7 * random.vector()]),
            2 => corners.extend([[a, b, c], [c, b, random.vector()]]),
            3 => corners.push([a, a + DVec3::X * size, a + DVec3::Z * size]),
            _ => corners.push([a, a, b]),
        }
    }
    corners
}

/// A camera in some direction, with a quarter turn across its width.
fn camera_at(eye: DVec3, turn: DQuat, (width, height): (u32, u32), range: (f64, f64)) -> Camera {
    let half = 0.5 * DVec2::new(f64::from(width), f64::from(height));
    let pose = DMat4::from_rotation_translation(turn, eye);
    Camera::new(pose, DVec2::splat(half.x), half, (width, height), range).unwrap()
}

/// One at the same place that sees so far to each side of it along parallel rays.
fn orthographic(camera: &Camera, reach: f64) -> Camera {
    Camera {
        rays: Rays::Orthographic,
        focal: camera.focal / reach,
        ..camera.clone()
    }
}

fn any_turn(random: &mut Random) -> DQuat {
    DQuat::from_axis_angle(random.vector().normalize(), 3.0 * random.share())
}

/// The first triangles row by row, -1 for none.
fn triangle_ids(image: &Image) -> Vec<i32> {
    let tiling = image.tiling;
    let pixels = (0..tiling.height).flat_map(|y| (0..tiling.width).map(move |x| (x, y)));
    let ids = pixels.map(|(x, y)| image.triangles[tiling.index(x, y)]);
    ids.map(|id| if id == NONE { -1 } else { id as i32 })
        .collect()
}

/// Compares what the engine finds with the truth, but for ties, and gives how many pixels are in light and shadow.
fn assert_right(scene: &Scene, camera: &Camera, light: &Light, case: &str) -> [usize; 2] {
    assert_right_by(&Everything(scene), scene, camera, light, case)
}

/// The same with a truth that is searched for.
fn assert_right_by(
    search: &impl Search,
    scene: &Scene,
    camera: &Camera,
    light: &Light,
    case: &str,
) -> [usize; 2] {
    let image = rasterize(&View::of_camera(camera), scene);
    let visibility = exact(scene, &image, camera, light, None).visibility;
    let truth: Reference = reference(scene, search, camera, light);
    let ids = triangle_ids(&image);
    let mut counts = [0; 2];
    for pixel in 0..camera.pixel_count() {
        let place = (pixel % camera.width as usize, pixel / camera.width as usize);
        let at = format!(
            "{case}, pixel {place:?}, {:?} in light {light:?}",
            camera.eye
        );
        if !truth.triangle_tie[pixel] {
            assert_eq!(ids[pixel], truth.triangle_id[pixel], "{at}");
        }
        if !truth.triangle_tie[pixel] && !truth.tie[pixel] {
            let (found, right) = (visibility[pixel], truth.visibility[pixel]);
            assert!(
                found == right || found.is_nan() && right.is_nan(),
                "{at}: {found}, not {right}"
            );
            match found {
                0.0 => counts[0] += 1,
                1.0 => counts[1] += 1,
                _ => {}
            }
        }
    }
    counts
}

fn lights(random: &mut Random, scale: f64) -> Vec<Light> {
    let near = scale * random.vector();
    vec![
        Light::directional(random.vector()).unwrap(),
        Light::directional(DVec3::NEG_Y).unwrap(),
        Light::point(2.0 * scale * random.vector()).unwrap(),
        Light::point(near).unwrap(),
        Light::spot(2.0 * near, -near, 0.6).unwrap(),
        Light::hemisphere(near, random.vector()).unwrap(),
    ]
}

#[test]
fn pixels_of_any_soup_are_right() {
    let mut random = Random(7);
    let mut counts = [[0; 2]; 2];
    for round in 0..12 {
        let scale = [1e-6, 1.0, 1e6][round % 3];
        let corners = soup(&mut random, 60)
            .into_iter()
            .map(|t| t.map(|v| v * scale));
        let scene = scene_of(&corners.collect::<Vec<_>>());
        let distance = [0.0, 1.0, 3.0][round / 3 % 3];
        let turn = any_turn(&mut random);
        let eye = scale * distance * (turn * DVec3::Z) + 0.1 * scale * random.vector();
        let range = (1e-9 * scale, [f64::INFINITY, 2.0 * scale][round % 2]);
        let camera = camera_at(eye, turn, (75, 41), range);
        let parallel = orthographic(&camera, scale);
        for light in lights(&mut random, scale) {
            for (kind, camera) in [&camera, &parallel].into_iter().enumerate() {
                let case = format!("round {round}, camera {kind}");
                let of_case = assert_right(&scene, camera, &light, &case);
                counts[kind] = [counts[kind][0] + of_case[0], counts[kind][1] + of_case[1]];
            }
        }
    }
    let has_both = |[dark, lit]: [usize; 2]| dark > 20_000 && lit > 3_000;
    assert!(counts.into_iter().all(has_both), "{counts:?}");
}

/// A floor far larger than what stands on it.
fn floor(side: f64) -> Vec<[DVec3; 3]> {
    let corner = |x: f64, z: f64| DVec3::new(x * side, 0.0, z * side);
    let [a, b, c, d] = [
        corner(-1.0, -1.0),
        corner(1.0, -1.0),
        corner(1.0, 1.0),
        corner(-1.0, 1.0),
    ];
    vec![[a, c, b], [a, d, c]]
}

#[test]
fn a_tiny_dense_object_on_a_huge_floor_casts_its_shadow() {
    let mut random = Random(3);
    let mut corners = floor(100.0);
    for _ in 0..600 {
        let a = DVec3::new(0.02, 0.03, 0.02) * random.vector() + DVec3::Y * 0.04;
        corners.push([a, a + 0.004 * random.vector(), a + 0.004 * random.vector()]);
    }
    let scene = scene_of(&corners);
    let down = DQuat::from_rotation_x(-0.5);
    let camera = camera_at(
        DVec3::new(0.0, 0.1, 0.15),
        down,
        (160, 90),
        (1e-3, f64::INFINITY),
    );
    for light in [
        Light::directional(DVec3::new(0.5, -1.0, 0.2)).unwrap(),
        Light::point(DVec3::new(-0.1, 0.2, -0.05)).unwrap(),
    ] {
        let [dark, lit] = assert_right(&scene, &camera, &light, "floor");
        assert!(dark > 100 && lit > 1000, "{dark} {lit}");
    }
}

#[test]
fn what_no_sample_showed_is_answered_too() {
    // One pixel in the middle of a wall's rows of samples looks through a hole at what is far away.
    let mut corners = Vec::new();
    let quad = |x: [f64; 2], y: [f64; 2], z: f64| {
        let corner = |i: usize, j: usize| DVec3::new(x[i], y[j], z);
        [
            [corner(0, 0), corner(1, 0), corner(1, 1)],
            [corner(0, 0), corner(1, 1), corner(0, 1)],
        ]
    };
    // A hole around the pixel (44, 22), which is of no sampled row.
    let (x, y) = ((44.5 - 40.0) / 40.0, (24.0 - 22.5) / 40.0);
    let half = 0.01;
    corners.extend(quad([-9.0, x - half], [-9.0, 9.0], -1.0));
    corners.extend(quad([x + half, 9.0], [-9.0, 9.0], -1.0));
    corners.extend(quad([x - half, x + half], [-9.0, y - half], -1.0));
    corners.extend(quad([x - half, x + half], [y + half, 9.0], -1.0));
    corners.extend(quad([-900.0, 900.0], [-900.0, 900.0], -100.0));
    corners.extend(quad([5.0, 15.0], [-2.0, 8.0], -90.0));
    let scene = scene_of(&corners);
    let camera = camera_at(
        DVec3::ZERO,
        DQuat::IDENTITY,
        (80, 48),
        (1e-3, f64::INFINITY),
    );
    let image = rasterize(&View::of_camera(&camera), &scene);
    let seen = triangle_ids(&image)[22 * 80 + 44];
    assert!(seen >= 8, "{seen}");
    for position in [DVec3::new(11.0, 3.0, -20.0), DVec3::new(11.0, 3.0, 50.0)] {
        assert_right(&scene, &camera, &Light::point(position).unwrap(), "hole");
        assert_right(
            &scene,
            &camera,
            &Light::directional(-position).unwrap(),
            "hole",
        );
    }
}

#[test]
fn a_lamp_in_the_plane_of_a_ceiling_lights_all_below_it() {
    // Turned, so that rounding puts the lamp to either side of each triangle.
    let mut random = Random(9);
    for round in 0..20 {
        let turn = any_turn(&mut random);
        let square = |y: f64| {
            floor(4.0)
                .into_iter()
                .map(move |t| t.map(|v| v + y * DVec3::Y))
        };
        let corners = square(0.0).chain(square(3.0)).map(|t| t.map(|v| turn * v));
        let scene = scene_of(&corners.collect::<Vec<_>>());
        let eye = turn * DVec3::new(0.0, 1.5, 0.0);
        let down = turn * DQuat::from_rotation_x(-1.3);
        let camera = camera_at(eye, down, (64, 48), (1e-3, f64::INFINITY));
        let image = rasterize(&View::of_camera(&camera), &scene);
        let place = turn * DVec3::new(2.0 * random.signed(), 3.0, 2.0 * random.signed());
        let light = Light::point(place).unwrap();
        let visibility = exact(&scene, &image, &camera, &light, None).visibility;
        let ids = triangle_ids(&image);
        let below = ids
            .iter()
            .zip(&visibility)
            .filter(|(id, _)| **id == 0 || **id == 1);
        let dark = below.clone().filter(|(_, v)| **v != 1.0).count();
        assert!(below.count() > 2000 && dark == 0, "round {round}: {dark}");
    }
}

#[test]
fn no_pixel_slips_between_triangles_that_share_an_edge() {
    // The diagonal of the square passes the middles of pixels.
    for size in [16, 17] {
        let scene = scene_of(&floor(1.0));
        let down = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
        let camera = camera_at(DVec3::Y * 0.75, down, (size, size), (1e-3, f64::INFINITY));
        let image = rasterize(&View::of_camera(&camera), &scene);
        assert!(triangle_ids(&image).iter().all(|&id| id >= 0));
    }
}

#[test]
fn large_triangles_over_each_other_share_cells() {
    let mut random = Random(5);
    let mut corners = floor(3.0);
    for _ in 0..2500 {
        let mut at = || random.vector() * DVec3::new(3.0, 0.01, 3.0) + DVec3::Y;
        corners.push([at(), at(), at()]);
    }
    let scene = scene_of(&corners);
    let camera = camera_at(
        DVec3::new(0.0, 0.8, 3.5),
        DQuat::from_rotation_x(-0.2),
        (64, 36),
        (1e-3, f64::INFINITY),
    );
    let light = Light::directional(DVec3::new(1.0, -0.4, 0.3)).unwrap();
    let [dark, lit] = assert_right(&scene, &camera, &light, "large");
    assert!(dark > 200 && lit > 20, "{dark} {lit}");
}

#[test]
fn the_number_of_threads_changes_no_pixel() {
    let mut random = Random(11);
    let scene = scene_of(&soup(&mut random, 3000));
    let camera = camera_at(
        DVec3::new(0.0, 0.0, 2.5),
        DQuat::IDENTITY,
        (200, 130),
        (1e-3, f64::INFINITY),
    );
    let light = Light::point(DVec3::new(0.5, 2.0, 1.0)).unwrap();
    let frame = || {
        let image = rasterize(&View::of_camera(&camera), &scene);
        let visibility = exact(&scene, &image, &camera, &light, None).visibility;
        let bits = visibility.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        (triangle_ids(&image), bits)
    };
    let frames = [1, 2, 3, 8].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap();
        pool.install(frame)
    });
    assert!(frames.iter().all(|other| *other == frames[0]));
}

#[test]
fn grids_of_a_light_serve_other_cameras() {
    let mut random = Random(13);
    let scene = scene_of(&soup(&mut random, 400));
    for light in lights(&mut random, 1.0) {
        let mut known = None;
        let mut served = Vec::new();
        let mut turn = 0.0;
        // The same camera again, one beside it, and one that sees other receivers.
        for step in [0.0, 0.0, 0.01, 1.3, 0.01, 3.0] {
            turn += step;
            let turn = DQuat::from_rotation_y(turn);
            let eye = turn * DVec3::new(0.0, 0.0, 2.5);
            let camera = camera_at(eye, turn, (96, 54), (1e-3, f64::INFINITY));
            let image = rasterize(&View::of_camera(&camera), &scene);
            let fresh = exact(&scene, &image, &camera, &light, None);
            let found = exact(&scene, &image, &camera, &light, known);
            let bits = |answer: &Answer| answer.visibility.iter().map(|v| v.to_bits()).collect();
            let (found_bits, fresh_bits): (Vec<_>, Vec<_>) = (bits(&found), bits(&fresh));
            assert_eq!(found_bits, fresh_bits, "{light:?} {eye:?}");
            served.push(!found.has_new_grids);
            known = Some(Arc::new(found.grids));
        }
        assert!(!served[0] && served[1], "{light:?} {served:?}");
        let other = Light::directional(DVec3::new(0.1, -1.0, 0.4)).unwrap();
        let camera = camera_at(
            2.5 * DVec3::Z,
            DQuat::IDENTITY,
            (96, 54),
            (1e-3, f64::INFINITY),
        );
        let image = rasterize(&View::of_camera(&camera), &scene);
        assert!(exact(&scene, &image, &camera, &other, known).has_new_grids);
    }
}
