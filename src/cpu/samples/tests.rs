//! Samples against frames of moved cameras, and footprints against points in float64.

use super::super::exact::exact;
use super::super::lanes::{EPSILON, LANES, Simd, bits, dispatch, f32x16, level};
use super::super::light_grid::{CELL, GRID};
use super::super::rasterize::{NONE, rasterize};
use super::super::receivers::{BlockReceivers, KnownPlanes};
use super::super::shapes::Shapes;
use super::super::tests::{flat_view, prepared};
use super::super::tiles::BLOCK;
use super::draw::{DrawnSamples, SampledTile};
use super::footprints::{BlockFootprints, BlockSquares};
use super::*;
use crate::camera::Rays;
use crate::cpu::bins::Cover;
use crate::cpu::tiles::TILE;
use crate::twin::Random;
use fearless_simd::prelude::*;
use glam::{DMat4, DQuat, DVec3};

/// Triangles of all sizes, some beside each other in strips, some twice, some around the eye or across it.
fn triangles(random: &mut Random, count: usize) -> Scene {
    let mut vertices: Vec<DVec3> = Vec::new();
    for i in 0..count {
        let size = 10_f64.powf(1.5 * random.signed() - 0.5);
        let middle = 2.0 * random.vector();
        let mut corners = [0; 3].map(|_| middle + size * random.vector());
        if i > 0 && random.below(3) > 0 {
            // At an edge of the last one.
            let end = vertices.len();
            (corners[0], corners[1]) = (vertices[end - 2], vertices[end - 1]);
            // Or it once more, from another corner on.
            if random.below(6) == 0 {
                corners[2] = vertices[end - 3];
            }
        }
        vertices.extend(corners);
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Scene::new(vertices, triangles.collect()).unwrap()
}

fn camera(random: &mut Random, (width, height): (u32, u32)) -> Camera {
    let turn = DQuat::from_axis_angle(random.vector().normalize(), 3.0 * random.share());
    let pose = DMat4::from_rotation_translation(turn, 0.5 * random.vector());
    let half = 0.5 * DVec2::new(f64::from(width), f64::from(height));
    let range = [(1e-3, f64::INFINITY), (0.3, 2.5)][random.below(2)];
    let camera = Camera::new(pose, DVec2::splat(half.x), half, (width, height), range).unwrap();
    match random.below(3) {
        0 => Camera {
            rays: Rays::Orthographic,
            focal: camera.focal * 0.3,
            ..camera
        },
        _ => camera,
    }
}

/// Places of samples, on the border of the pixel, too.
fn places(random: &mut Random, count: usize) -> Vec<DVec2> {
    let mut place = || match random.below(4) {
        0 => [-0.5, 0.0, 0.5][random.below(3)],
        _ => random.share() - 0.5,
    };
    (0..count).map(|_| DVec2::new(place(), place())).collect()
}

fn light(random: &mut Random) -> Light {
    let position = 1.5 * random.vector();
    let direction = random.vector().normalize();
    match random.below(4) {
        0 => Light::point(position).unwrap(),
        1 => Light::spot(position, -position.normalize(), 0.6).unwrap(),
        _ => Light::directional(direction).unwrap(),
    }
}

#[test]
fn samples_see_what_moved_cameras_see() {
    let mut random = Random(21);
    let mut counts = [0; 3];
    for round in 0..20 {
        let count = [1, 5, 8, 20, 32][random.below(5)];
        let scene = triangles(&mut random, 60);
        let camera = camera(&mut random, (100, 70));
        let pattern = Pattern::new(&camera, &places(&mut random, count));
        let images = pattern.views.iter().map(|view| rasterize(view, &scene));
        let images: Vec<_> = images.collect();
        let view = View::of_camera(&camera);
        let vertices = view.places(&scene);
        let (painter, bins) = Painter::new(&view, &scene, &vertices, Cover::Whole);
        let mut drawn = DrawnSamples::default();
        for tile in 0..painter.tiling.tiles() {
            let cover = dispatch!(level(), simd => cover_tile(simd, &painter, &bins, tile));
            let corner = painter.tiling.corner(tile);
            let (painter, pattern) = (&painter, &pattern);
            let sampled = SampledTile {
                painter,
                pattern,
                cover: &cover,
                corner,
            };
            dispatch!(level(), simd => drawn.draw(simd, sampled));
            for place in 0..TILE * TILE {
                let (column, row) = (place % TILE, place / TILE);
                let at = (corner.0 + column, corner.1 + row);
                if at.0 >= view.width || at.1 >= view.height {
                    continue;
                }
                let is_whole = cover.whole[row] >> column & 1 != 0;
                let is_mixed = cover.mixed[row] >> column & 1 != 0;
                for (sample, image) in images.iter().enumerate() {
                    let found = match (is_whole, is_mixed) {
                        (true, _) => cover.ids[place],
                        (_, true) => drawn.of_pixel(place, pattern.eights())[sample],
                        _ => NONE,
                    };
                    let expected = image.triangle_at(at.0, at.1).unwrap_or(NONE);
                    assert_eq!(found, expected, "round {round}: {at:?}, sample {sample}");
                }
                counts[usize::from(is_whole) + 2 * usize::from(is_mixed)] += 1;
            }
        }
    }
    assert!(counts.iter().all(|&count| count > 5_000), "{counts:?}");
}

#[test]
fn samples_are_lit_where_moved_cameras_say_so() {
    let mut random = Random(22);
    let mut effort = Effort::default();
    let mut counts = [0; 3];
    for round in 0..16 {
        let count = [1, 4, 9, 16][random.below(4)];
        let many = [10, 60][random.below(2)];
        let scene = triangles(&mut random, many);
        let camera = camera(&mut random, (72, 50));
        let light = light(&mut random);
        let places = places(&mut random, count);
        let kept = KeptParts::default();
        let found = count_samples(&scene, &camera, &light, &places, &kept).unwrap();
        let pixels = camera.pixel_count();
        let (mut lit, mut seen) = (vec![0_u8; pixels], vec![0_u8; pixels]);
        let pattern = Pattern::new(&camera, &places);
        for (camera, view) in pattern.cameras.iter().zip(&pattern.views) {
            let image = rasterize(view, &scene);
            let answer = exact(&scene, &image, camera, &light, None);
            for (i, visibility) in answer.visibility.into_iter().enumerate() {
                lit[i] += u8::from(visibility == 1.0);
                seen[i] += u8::from(!visibility.is_nan());
            }
        }
        for pixel in 0..pixels {
            let expected = (lit[pixel], seen[pixel]);
            let found = (found.lit[pixel], found.seen[pixel]);
            assert_eq!(found, expected, "round {round}: pixel {pixel}, {light:?}");
            let partly = usize::from(lit[pixel] > 0) + usize::from(lit[pixel] == seen[pixel]);
            counts[partly] += usize::from(seen[pixel] > 0);
        }
        effort = effort.and(found.effort);
    }
    assert!(counts.iter().all(|&count| count > 200), "{counts:?}");
    // Else nothing was decided together, or nothing one by one.
    let decided = effort.whole_pixels - effort.open_pixels;
    assert!(decided.min(effort.open_pixels) > 5_000, "{effort:?}");
}

/// A parallelogram: its middle, and half of two of its sides.
type Parallelogram = [DVec3; 3];

/// What is found of the squares of a block of pixels, and where a view sees them.
#[derive(Default)]
struct FoundSquares {
    asked: [u32; BLOCK],
    facing: [u32; BLOCK],
    unsure: [u32; BLOCK],
    known: [u32; BLOCK],
    footprints: [[Parallelogram; LANES]; BLOCK],
}

#[inline(always)]
fn squares_of<S: Simd>(
    simd: S,
    receivers: &Receivers,
    view: &ViewFromEye,
    (x, y): (usize, usize),
) -> FoundSquares {
    let mut found = FoundSquares::default();
    let mut block = BlockReceivers::none(simd);
    for i in 0..BLOCK {
        let ids: [Option<u32>; LANES] =
            std::array::from_fn(|lane| receivers.image.triangle_at(x + lane, y + i));
        let first = ids.iter().flatten().next().copied().unwrap_or(NONE);
        block.ids[i] = ids.map(|id| id.unwrap_or(first));
        block.is_one[i] = block.ids[i].iter().all(|id| *id == first);
        let seen = (0..LANES).filter(|&lane| ids[lane].is_some());
        found.asked[i] = seen.fold(0, |seen, lane| seen | 1 << lane);
    }
    let (mut squares, mut known) = (BlockSquares::none(simd), KnownPlanes::default());
    receivers.squares(
        simd,
        (x, y),
        &found.asked,
        &mut known,
        &mut block,
        &mut squares,
    );
    (found.facing, found.unsure) = (squares.facing, squares.unsure);
    let mut footprints = BlockFootprints::none(simd);
    view.footprints(simd, &block, &squares, &squares.facing, &mut footprints);
    found.known = footprints.known;
    for (i, of_row) in found.footprints.iter_mut().enumerate() {
        let vectors = [
            footprints.middle[i],
            footprints.sides[i][0],
            footprints.sides[i][1],
        ];
        let vectors = vectors.map(|vector| vector.map(<[f32; LANES]>::from));
        for (lane, footprint) in of_row.iter_mut().enumerate() {
            *footprint = vectors.map(|[u, v, n]| {
                DVec3::new(f64::from(u[lane]), f64::from(v[lane]), f64::from(n[lane]))
            });
        }
    }
    found
}

/// Whether a point is in a parallelogram but for rounding to float32, by linear functions of its place.
fn holds(random: &mut Random, [middle, one, other]: Parallelogram, point: DVec3) -> bool {
    let size = middle.abs() + one.abs() + other.abs();
    let across = |side: DVec3| DVec3::new(-side.y, side.x, 0.0);
    let mut functions = vec![DVec3::X, DVec3::Y, DVec3::Z, across(one), across(other)];
    functions.extend((0..6).map(|_| random.vector() / size));
    functions.into_iter().all(|function| {
        let room = 4.0 * f64::from(EPSILON) * function.abs().dot(size);
        let reach = function.dot(one).abs() + function.dot(other).abs();
        function.dot(point - middle).abs() <= reach + room
    })
}

#[test]
fn footprints_hold_what_their_pixels_see() {
    let mut random = Random(24);
    // By views of parallel rays and others, and by cameras of both kinds; within the light's cone, beside it and neither.
    let (mut counts, mut in_cone) = ([[0; 2]; 2], [0; 3]);
    for round in 0..60 {
        let scene = triangles(&mut random, 30);
        let camera = camera(&mut random, (64, 48));
        let light = light(&mut random);
        let image = rasterize(&View::of_camera(&camera), &scene);
        let receivers = Receivers::new(&scene, &image, &camera, &light);
        let view = &views(&light, scene.bounds())[0];
        let seen = ViewFromEye::new(view, camera.eye);
        for block in 0..8 * 6 {
            let corner = (block % 8 * BLOCK, block / 8 * BLOCK);
            let found = dispatch!(level(), simd => squares_of(simd, &receivers, &seen, corner));
            for (i, lane) in
                (0..BLOCK).flat_map(|i| bits(found.asked[i]).map(move |lane| (i, lane)))
            {
                let pixel = (corner.0 + lane, corner.1 + i);
                let [a, b, c] = scene.corners(image.triangle_at(pixel.0, pixel.1).unwrap());
                let normal = (b - a).cross(c - a).normalize();
                let is = |mask: [u32; BLOCK]| mask[i] >> lane & 1 != 0;
                let (is_facing, is_unsure, is_known) =
                    (is(found.facing), is(found.unsure), is(found.known));
                let mut inside = [false; 2];
                for k in 0..12 {
                    let mut share = || match k {
                        0..8 => 0.5 * random.signed().signum(),
                        _ => 0.5 * random.signed(),
                    };
                    let place = DVec2::new(pixel.0 as f64, pixel.1 as f64) + 0.5;
                    let place = place + DVec2::new(share(), share());
                    let (start, ray) = camera.ray_from_place(place);
                    let from = camera.eye + start;
                    let point = from + ray * (normal.dot(a - from) / normal.dot(ray));
                    let case = format!("round {round}: {pixel:?}, {point}, {light:?}");
                    if is_known {
                        let place = view.homogeneous(point);
                        assert!(place.place.z > 0.0, "{case}");
                        let place = place.place.truncate().extend(place.nearness) / place.place.z;
                        let footprint = found.footprints[i][lane];
                        assert!(
                            holds(&mut random, footprint, place),
                            "{place} of {footprint:?}, {case}"
                        );
                    }
                    if let Some(cone) = light.cone() {
                        let depth = cone.depth_of(-light.vector_from_point(point));
                        inside[usize::from(depth > 0.0)] |= depth.abs() > 1e-9;
                    }
                }
                counts[usize::from(camera.rays == Rays::Orthographic)]
                    [usize::from(seen.is_parallel)] += usize::from(is_known);
                let to_eye = match camera.rays {
                    Rays::Perspective => camera.eye - a,
                    Rays::Orthographic => -camera.forward,
                };
                let sides = [to_eye, light.vector_from_point(a)].map(|way| normal.dot(way));
                let faces = sides[0] * sides[1] > 1e-9;
                if light.cone().is_some() && faces {
                    assert!(!is_facing || !inside[0], "round {round}: {pixel:?}");
                    assert!(
                        is_facing || is_unsure || !inside[1],
                        "round {round}: {pixel:?}"
                    );
                    in_cone[usize::from(is_facing) + 2 * usize::from(is_unsure)] += 1;
                }
            }
        }
    }
    assert!(
        counts.as_flattened().iter().all(|&count| count > 500),
        "{counts:?}"
    );
    assert!(in_cone.iter().all(|&count| count > 100), "{in_cone:?}");
}

/// One near an edge of the triangle, or anywhere in the cell around the origin; rounded to float32.
fn parallelogram(random: &mut Random, scene: &Scene, origin: DVec2) -> Parallelogram {
    let corners = scene.corners(0);
    let i = random.below(3);
    let edge = corners[i].lerp(corners[(i + 1) % 3], random.share());
    let reach = 10_f64.powf(2.0 * random.share() - 2.0);
    let near = edge + 10_f64.powf(4.0 * random.share() - 4.0) * random.vector();
    let half = 0.5 * CELL as f64;
    let is_near = (near.truncate() - origin).abs().max_element() < 2.0 * half;
    let anywhere = DVec2::new(random.signed(), random.signed()) * 2.0 * half;
    let z = edge.z - 10_f64.powf(6.0 * random.share() - 5.0) * random.signed().signum();
    let middle = match is_near {
        true => near.truncate().extend(z),
        false => (origin + anywhere).extend(z),
    };
    let slope = 10_f64.powf(3.0 * random.signed());
    let mut side = || random.vector() * DVec3::new(reach, reach, reach * slope);
    let rounded = |v: DVec3| v.as_vec3().as_dvec3();
    let (one, other) = (rounded(side()), rounded(side()));
    [rounded(middle), one, other]
}

#[inline(always)]
fn tested<S: Simd>(
    simd: S,
    shapes: &Shapes,
    origin: DVec2,
    [middle, one, other]: Parallelogram,
) -> [bool; 2] {
    let splat = |v: f64| f32x16::splat(simd, v as f32);
    let [u, v] = [middle.x - origin.x, middle.y - origin.y];
    let place = [splat(u), splat(v), splat(middle.z)];
    let sides = [one, other].map(|side| side.to_array().map(splat));
    let (hit, maybe) = shapes.test_footprints(simd, 0, place, &sides);
    [hit & 1 != 0, maybe & 1 != 0]
}

#[test]
fn footprints_are_decided_as_every_point_in_them() {
    let view = flat_view();
    let mut random = Random(23);
    let mut counts = [0; 3];
    for round in 0..20_000 {
        let origin = (DVec2::new(random.share(), random.share()) * GRID as f64).as_vec2();
        let around = origin.as_dvec2();
        let size = 10_f64.powf(4.0 * random.share() - 1.0);
        let steepness = 10_f64.powf(4.0 * random.share() - 3.0);
        let corner = DVec3::new(size, size, size * steepness);
        let corners = [0; 3].map(|_| around.extend(0.0) + corner * random.vector());
        let scene = Scene::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        let places = view.places(&scene);
        let side = 1.5 * CELL as f32;
        let (mut shapes, wide) =
            dispatch!(level(), simd => prepared(simd, &places, &view, origin.to_array(), side));
        let rounding = view.rounding();
        if wide && !shapes.set_wide(0, (&view, &scene), 0, around, f64::from(side), rounding) {
            continue;
        }
        let footprint = parallelogram(&mut random, &scene, around);
        let [hit, maybe] = dispatch!(level(), simd => tested(simd, &shapes, around, footprint));
        counts[usize::from(hit) + usize::from(maybe)] += 1;
        let [middle, one, other] = footprint;
        for k in 0..12 {
            let mut share = || match k {
                0..8 => random.signed().signum(),
                _ => random.signed(),
            };
            let point = middle + one * share() + other * share();
            let nearness = view.nearness_at(&scene, point.truncate(), 0);
            let is_before = nearness.is_some_and(|nearness| nearness > point.z);
            let case = format!("round {round}: {point} of {footprint:?}, {corners:?}");
            assert!(is_before || !hit, "hit, {case}");
            assert!(!is_before || maybe, "missed, {case}");
        }
    }
    assert!(counts.iter().all(|&count| count > 500), "{counts:?}");
}
