//! What the engine leaves out without a test of each pixel, and what it is sure of, against points in float64.

use super::bins::{Bins, Cover, bins};
use super::lanes::{LANES, Simd, dispatch, f32x16, f64x8, level};
use super::light_grid::{CELL, GRID, LightGrid};
use super::light_space::LightSpace;
use super::rasterize::{NONE, Painter, rasterize};
use super::receivers::{
    BlockPlaces, BlockReceivers, KnownPlanes, Receivers, ViewFromEye, faces_around,
};
use super::tests::{flat_view, prepared};
use super::tile_rays::{Places, Taken, TileRays};
use super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS, Tiling};
use super::view::{Nearness, View};
use crate::camera::{Camera, Rays};
use crate::fits::central::turned_cube_faces;
use crate::light::Light;
use crate::scene::Scene;
use crate::twin::Random;
use fearless_simd::prelude::*;
use glam::{DMat3, DMat4, DQuat, DVec2, DVec3, DVec4};

/// Triangles of all sizes around the origin: some reach behind a camera there, or far beside what it sees.
fn triangles(random: &mut Random, count: usize) -> Scene {
    let mut vertices = Vec::new();
    for _ in 0..count {
        let size = 10_f64.powf(1.5 * random.signed());
        let middle = 2.0 * random.vector();
        vertices.extend([0; 3].map(|_| middle + size * random.vector()));
    }
    let triangles = (0..count as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Scene::new(vertices, triangles.collect()).unwrap()
}

fn camera(random: &mut Random, (width, height): (u32, u32), range: (f64, f64)) -> Camera {
    let turn = DQuat::from_axis_angle(random.vector().normalize(), 3.0 * random.share());
    let half = 0.5 * DVec2::new(f64::from(width), f64::from(height));
    let pose = DMat4::from_rotation_translation(turn, 0.3 * random.vector());
    Camera::new(pose, DVec2::splat(half.x), half, (width, height), range).unwrap()
}

/// Of parallel rays: units of the grid along x and y, the nearer the greater z is.
fn light_view() -> View {
    let scale = GRID as f64 / 8.0;
    let row = |axis: DVec4| (axis + DVec4::W * 4.0) * scale;
    View {
        origin: DVec3::ZERO,
        rows: [row(DVec4::X), row(DVec4::Y), DVec4::W],
        nearness: Nearness::Linear(DVec4::Z),
        width: GRID,
        height: GRID,
        seen: (f64::NEG_INFINITY, f64::INFINITY),
        light: None,
    }
}

fn holds(bins: &Bins, tile: usize, id: u32) -> bool {
    let mut of_tile = bins.iter().map(|of_thread| &of_thread[tile]);
    of_tile.any(|bin| bin.near.contains(&id) || bin.wide.contains(&id))
}

#[test]
fn a_triangle_is_in_every_tile_that_it_covers_a_part_of() {
    let mut random = Random(1);
    let mut found = [0; 2];
    for round in 0..60 {
        let scene = triangles(&mut random, 20);
        let view = View::of_camera(&camera(&mut random, (300, 200), (1e-3, f64::INFINITY)));
        let tiling = Tiling::new(view.width, view.height);
        let places = view.places(&scene);
        let [middles, whole] = [Cover::Middles, Cover::Whole]
            .map(|cover| bins(&view, (tiling, &tiling), &scene, &places, cover));
        for _ in 0..2000 {
            let size = DVec2::new(view.width as f64, view.height as f64);
            let place = DVec2::new(random.share(), random.share()) * size;
            let tile = place.y as usize / TILE * tiling.columns + place.x as usize / TILE;
            let id = random.below(20) as u32;
            if view.nearness_at(&scene, place.floor() + 0.5, id).is_some() {
                assert!(holds(&middles, tile, id), "round {round}: {id} at {place}");
                found[0] += 1;
            }
            if view.nearness_at(&scene, place, id).is_some() {
                assert!(holds(&whole, tile, id), "round {round}: {id} at {place}");
                found[1] += 1;
            }
        }
    }
    assert!(found.iter().all(|&count| count > 5_000), "{found:?}");
}

#[test]
fn a_triangle_whose_edge_ends_a_hair_beyond_a_tile_is_in_it() {
    let mut random = Random(9);
    let mut found = 0;
    for round in 0..3000 {
        let cover = [Cover::Middles, Cover::Whole][random.below(2)];
        // The first or the last column or row of a tile: an edge along it, on the side of the tile's border.
        let axis = random.below(2);
        let side = [-1.0, 1.0][random.below(2)];
        let mut at = DVec2::new(random.share(), random.share()) * 40.0 + 70.0;
        at[axis] = TILE as f64 * (1 + random.below(2)) as f64;
        if cover == Cover::Middles {
            at = at.floor() + 0.5;
            at[axis] -= (random.below(2)) as f64;
        }
        let hair = 10_f64.powf(-7.0 * random.share()) * 0.4;
        let corner = |along: f64, across: f64| {
            let mut corner = at;
            corner[axis] += side * along;
            corner[1 - axis] += across;
            corner.extend(1.0)
        };
        let corners = vec![
            corner(-hair, -20.0 * random.share() - 1.0),
            corner(-hair, 20.0 * random.share() + 1.0),
            corner(50.0, 0.0),
        ];
        let scene = Scene::new(corners, vec![[0, 1, 2]]).unwrap();
        let view = View {
            width: 300,
            height: 200,
            ..flat_view()
        };
        let tiling = Tiling::new(view.width, view.height);
        let bins = bins(
            &view,
            (tiling, &tiling),
            &scene,
            &view.places(&scene),
            cover,
        );
        if cover == Cover::Whole {
            at[axis] -= side * hair * random.share();
        }
        if view.nearness_at(&scene, at, 0).is_some() {
            let tile = at.y as usize / TILE * tiling.columns + at.x as usize / TILE;
            assert!(holds(&bins, tile, 0), "round {round}: {cover:?} {at}");
            found += 1;
        }
    }
    assert!(found > 2_000, "{found}");
}

#[test]
fn texels_whose_rays_an_edge_nearly_passes_are_right() {
    let mut random = Random(10);
    let view = flat_view();
    let mut counts = [0; 2];
    for round in 0..300 {
        let middle = (DVec2::new(random.share(), random.share()) * 0.4 + 0.3) * GRID as f64;
        let size = 10_f64.powf(2.5 * random.share());
        let corners = [0; 3].map(|_| middle.extend(1.0) + size * random.vector());
        let scene = Scene::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
        // Rays near the edges and the corners: those of a block are close to each other, or those of the tile.
        let is_one = random.below(2) == 0;
        let mut places: Box<Places> = Box::new([[0.0; TILE_PIXELS]; 2]);
        let (mut near, mut reach) = (DVec2::ZERO, 0.0);
        for block in 0..BLOCKS * BLOCKS {
            if block == 0 || !is_one {
                let i = random.below(3);
                let share = [0.0, 1.0, random.share()][random.below(3)];
                near = corners[i].lerp(corners[(i + 1) % 3], share).truncate();
                reach = 10_f64.powf(-1.0 - 5.0 * random.share());
            }
            for i in 0..BLOCK * BLOCK {
                let (column, row) = (block % BLOCKS * BLOCK, block / BLOCKS * BLOCK);
                let texel = (row + i / BLOCK) * TILE + column + i % BLOCK;
                let at = near + reach * random.vector().truncate();
                (places[0][texel], places[1][texel]) = (at.x, at.y);
            }
        }
        let known = view.places(&scene);
        let (painter, bins) = Painter::new(&view, &scene, &known, Cover::Whole);
        let mut rays = TileRays::new();
        let (mut ids, mut nearness) = ([NONE; TILE_PIXELS], [f32::NEG_INFINITY; TILE_PIXELS]);
        let inside = Taken::inside((0, 0), (TILE, TILE));
        dispatch!(level(), simd => {
            rays.set(simd, &places, &inside);
            painter.draw_at_rays(simd, &bins, &rays, (&mut ids, &mut nearness), false);
        });
        for (texel, &id) in ids.iter().enumerate() {
            let at = rays.origin() + rays.offset(texel);
            let is_in = view.nearness_at(&scene, at, 0).is_some();
            assert_eq!(
                id == 0,
                is_in,
                "round {round}, texel {texel}: {at} {corners:?}"
            );
            counts[usize::from(is_in)] += 1;
        }
    }
    assert!(counts.iter().all(|&count| count > 200_000), "{counts:?}");
}

#[test]
fn a_surface_a_hair_beyond_the_near_plane_or_the_far_one_is_not_seen() {
    for (plane, inwards) in [(0.5, 1.0), (2.0, -1.0)] {
        for exponent in -12..-2 {
            for (side, is_seen) in [(-1.0, false), (1.0, true)] {
                let depth = plane * (1.0 + side * inwards * 10_f64.powi(exponent));
                // Within the view: what reaches far beside it is set up in float64 anyway.
                let corner = |x: f64, y: f64| DVec3::new(x, y, -1.0) * depth;
                let corners = vec![corner(-0.4, -0.4), corner(0.4, -0.4), corner(0.0, 0.6)];
                let scene = Scene::new(corners, vec![[0, 1, 2]]).unwrap();
                let half = DVec2::splat(20.0);
                let camera = Camera::new(DMat4::IDENTITY, half, half, (40, 40), (0.5, 2.0));
                for rays in [Rays::Perspective, Rays::Orthographic] {
                    let camera = Camera {
                        rays,
                        ..camera.clone().unwrap()
                    };
                    let image = rasterize(&View::of_camera(&camera), &scene);
                    let seen = image.triangle_ids().iter().filter(|&&id| id == 0).count();
                    assert_eq!(seen > 0, is_seen, "{rays:?} {plane} {depth}");
                }
            }
        }
    }
}

#[test]
fn a_cell_lists_every_triangle_over_it_with_room_for_it() {
    let mut random = Random(2);
    let mut found = 0;
    for round in 0..60 {
        let scene = triangles(&mut random, 150);
        let grid = LightGrid::new(light_view(), &scene);
        for _ in 0..1000 {
            let id = random.below(150) as u32;
            // Anywhere, or a hair's breadth inside of a corner of the triangle.
            let anywhere = DVec2::new(random.share(), random.share()) * GRID as f64;
            let [a, b, c] = scene.corners(id);
            let inside = a.lerp((a + b + c) / 3.0, 10_f64.powf(-3.0 - 4.0 * random.share()));
            let [u, v] = [0, 1].map(|k| grid.view.homogeneous(inside).place[k]);
            let is_beside = u.min(v) < 0.0 || u.max(v) >= GRID as f64;
            let place = match random.below(2) == 0 || is_beside {
                true => anywhere,
                false => DVec2::new(u, v),
            };
            let Some(nearness) = grid.view.nearness_at(&scene, place, id) else {
                continue;
            };
            // Where rounding may put a receiver there.
            let off = f64::from(grid.view.rounding()) * random.vector().truncate();
            let place = (place + off).clamp(DVec2::ZERO, DVec2::splat(GRID as f64 - 0.01));
            let cell = grid.cell(place.x as usize / CELL, place.y as usize / CELL);
            let [u, v] = place.as_vec2().to_array();
            // What lies a hair's breadth behind it.
            let farthest = (nearness - 1e-6 * nearness.abs()) as f32;
            let listed = dispatch!(level(), simd => {
                let mut listed = Vec::new();
                for head in cell.heads {
                    let met = head.meets(simd, [u, u, v, v], farthest);
                    for group in (0..LANES).filter(|lane| met >> lane & 1 == 1) {
                        let group = &cell.groups[head.ids[group] as usize];
                        let met = group.meets(simd, [u, u, v, v], farthest);
                        let lanes = (0..LANES).filter(|lane| met >> lane & 1 == 1);
                        listed.extend(lanes.map(|lane| group.ids[lane]));
                    }
                }
                listed
            });
            assert!(listed.contains(&id), "round {round}: {id} at {place}");
            found += 1;
        }
    }
    assert!(found > 2_000, "{found}");
}

#[test]
fn a_triangle_is_seen_between_the_near_plane_and_the_far_one() {
    let mut random = Random(3);
    let mut counts = [0; 3];
    for _ in 0..2_000 {
        let scene = triangles(&mut random, 1);
        let rays = [Rays::Perspective, Rays::Orthographic][random.below(2)];
        let camera = Camera {
            rays,
            ..camera(&mut random, (64, 48), (0.5, 2.0))
        };
        let view = View::of_camera(&camera);
        let pixel = [random.below(64) as u32, random.below(48) as u32];
        // The ray meets the plane at that depth.
        let (start, ray) = camera.ray_from_pixel(pixel[0], pixel[1]);
        let [a, b, c] = scene.corners(0).map(|corner| corner - camera.eye - start);
        let normal = (b - a).cross(c - a);
        let depth = normal.dot(a) / normal.dot(ray);
        let point = ray * depth;
        let sides = [(a, b), (b, c), (c, a)].map(|(a, b)| (b - a).cross(point - a).dot(normal));
        let is_met = sides.iter().all(|&side| side > 0.0);
        let middle = DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])) + 0.5;
        let found = view.nearness_at(&scene, middle, 0);
        let expected = (is_met && (0.5..2.0).contains(&depth)).then_some(match rays {
            Rays::Perspective => 1.0 / depth,
            Rays::Orthographic => -depth,
        });
        match (found, expected) {
            (Some(found), Some(expected)) => {
                assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
                counts[0] += 1;
            }
            (None, None) => counts[if is_met { 1 } else { 2 }] += 1,
            other => panic!("{other:?} at {middle} of {:?}", scene.corners(0)),
        }
    }
    assert!(counts.iter().all(|&count| count > 20), "{counts:?}");
}

#[test]
fn pixels_whose_middles_an_edge_nearly_passes_are_right() {
    let mut random = Random(7);
    let mut covered = 0;
    for round in 0..40 {
        // A rectangle, turned by a hair's breadth, whose sides pass the middles of pixels, all but.
        let mut near = |from: f64| {
            let off = 10_f64.powf(4.0 * random.share() - 7.0) * random.signed().signum();
            from + random.below(30) as f64 + 0.5 + off
        };
        let ([x0, y0], [x1, y1]) = ([near(0.0), near(0.0)], [near(90.0), near(60.0)]);
        let turn = 1e-6 * random.signed();
        let corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)];
        let corner = |(x, y): (f64, f64)| DVec3::new(x + turn * y, y - turn * x, 1.0);
        let corners = corners.map(corner).to_vec();
        let scene = Scene::new(corners, vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let view = View {
            width: 150,
            height: 100,
            ..flat_view()
        };
        let image = rasterize(&view, &scene);
        for y in 0..view.height {
            for x in 0..view.width {
                let middle = DVec2::new(x as f64, y as f64) + 0.5;
                let is_in = |id| view.nearness_at(&scene, middle, id).is_some();
                let found = image.triangles[image.tiling.index(x, y)];
                let is_right = match found {
                    NONE => !is_in(0) && !is_in(1),
                    id => is_in(id),
                };
                assert!(is_right, "round {round}: {found} at {middle}");
                covered += usize::from(found != NONE);
            }
        }
    }
    assert!(covered > 100_000, "{covered}");
}

#[test]
fn of_triangles_in_one_place_the_first_is_seen() {
    let mut random = Random(4);
    for _ in 0..20 {
        let once = triangles(&mut random, 12);
        let twice = once.triangles().repeat(2);
        let twice = Scene::new(once.vertices().to_vec(), twice).unwrap();
        let view = View::of_camera(&camera(&mut random, (90, 70), (1e-3, f64::INFINITY)));
        let [once, twice] = [once, twice].map(|scene| rasterize(&view, &scene).triangles);
        assert!(once == twice);
    }
}

/// A triangle around a place, a place near it, and a nearness near its plane's.
struct Tested {
    scene: Scene,
    place: DVec2,
    nearness: f64,
}

fn tested(random: &mut Random) -> Tested {
    let origin = DVec2::new(random.share(), random.share()) * GRID as f64;
    let size = 10_f64.powf(3.5 * random.share() - 1.0);
    let [a, b, c] = [0; 3].map(|_| {
        let step = random.vector();
        origin.extend(0.0) + DVec3::new(size, size, 100.0) * step
    });
    let scene = Scene::new(vec![a, b, c], vec![[0, 1, 2]]).unwrap();
    // Half of them at an edge.
    let far = if random.below(2) == 0 {
        0.0
    } else {
        random.share()
    };
    let mut place = a.lerp(b, random.share()).lerp(c, far).truncate();
    place += 10_f64.powf(5.0 * random.share() - 5.0) * DVec2::from_angle(6.3 * random.share());
    let plane = flat_view().nearness_of_plane(&scene, place, 0);
    let off = 10_f64.powf(8.0 * random.share() - 7.0) * random.signed().signum();
    Tested {
        scene,
        place,
        nearness: plane + off,
    }
}

#[inline(always)]
fn answer<S: Simd>(
    simd: S,
    view: &View,
    tested: &Tested,
    origin: [f32; 2],
) -> Option<(bool, bool)> {
    let side = 2.0 * CELL as f32;
    let (mut shapes, wide) = prepared(simd, &view.places(&tested.scene), view, origin, side);
    if wide {
        let seen = (view, &tested.scene);
        let at = DVec2::new(f64::from(origin[0]), f64::from(origin[1]));
        if !shapes.set_wide(0, seen, 0, at, f64::from(side), view.rounding()) {
            return None;
        }
    }
    let [u, v] = tested.place.as_vec2().to_array();
    let [u, v] = [u - origin[0], v - origin[1]].map(|step| f32x16::splat(simd, step));
    let nearness = f32x16::splat(simd, tested.nearness as f32);
    let (hit, maybe) = shapes.test(simd, 0, u, v, nearness);
    Some((hit & 1 == 1, maybe & 1 == 1))
}

#[test]
fn a_receiver_is_hit_or_missed_for_sure_only_where_float64_says_so() {
    let view = flat_view();
    let mut random = Random(5);
    let mut counts = [0; 3];
    for round in 0..100_000 {
        let tested = tested(&mut random);
        // The first receiver of a cell, near the one that is tested.
        let step = DVec2::new(random.signed(), random.signed()) * CELL as f64;
        let origin = (tested.place + step).as_vec2().to_array();
        let found = dispatch!(level(), simd => answer(simd, &view, &tested, origin));
        let Some((hit, maybe)) = found else {
            continue;
        };
        let Tested {
            scene,
            place,
            nearness,
        } = &tested;
        let at_place = view.nearness_at(scene, *place, 0);
        let is_hit = at_place.is_some_and(|caster| caster > *nearness);
        let case = format!("round {round}: {place}, {nearness}, {:?}", scene.corners(0));
        assert!(is_hit || !hit, "{case}");
        assert!(maybe || !is_hit, "{case}");
        assert!(maybe || !hit, "{case}");
        counts[if hit { 0 } else { 1 + usize::from(maybe) }] += 1;
    }
    assert!(counts.iter().all(|&count| count > 5_000), "{counts:?}");
}

#[test]
fn receivers_face_the_light_and_fall_where_its_views_see_them() {
    let mut random = Random(6);
    let mut counts = [0; 2];
    for round in 0..60 {
        let scene = triangles(&mut random, 12);
        let camera = camera(&mut random, (40, 24), (1e-3, f64::INFINITY));
        let image = rasterize(&View::of_camera(&camera), &scene);
        let place = 2.0 * random.vector();
        // In the plane of a triangle that is seen, but for rounding.
        let seen = image.triangles.iter().find(|&&id| id != NONE);
        let [a, b, c] = scene.corners(*seen.unwrap_or(&0));
        let in_plane = a.lerp(b, random.signed()).lerp(c, random.signed());
        let light = match round % 4 {
            0 => Light::directional(place),
            1 => Light::point(place),
            2 => Light::point(in_plane),
            _ => Light::spot(place, random.vector(), 1.0),
        };
        let light = light.unwrap();
        let receivers = Receivers::new(&scene, &image, &camera, &light);
        let found = dispatch!(level(), simd => check_blocks(simd, &receivers));
        counts = [counts[0] + found[0], counts[1] + found[1]];
    }
    assert!(counts.iter().all(|&count| count > 1_000), "{counts:?}");
}

/// Receivers of a block that no layer is for.
#[inline(always)]
fn count_in_none<S: Simd>(simd: S, spaces: &[LightSpace], points: &[[DVec3; LANES]; BLOCK]) -> u32 {
    let mut block = BlockReceivers::none(simd);
    block.facing = [0xff; BLOCK];
    for (lanes, points) in block.points.iter_mut().zip(points) {
        *lanes = [0, 1, 2].map(|axis| f64x8::simd_from(simd, points.map(|point| point[axis])));
    }
    let masks = spaces.iter().map(|space| space.masks(simd, &block));
    let found = masks.fold([0; BLOCK], |all: [u32; BLOCK], masks| {
        std::array::from_fn(|i| all[i] | masks[i])
    });
    found.iter().map(|found| (!found & 0xff).count_ones()).sum()
}

#[test]
fn a_receiver_where_faces_of_a_cube_meet_is_in_one_of_them() {
    let mut random = Random(7);
    let light = Light::directional(DVec3::NEG_Y).unwrap();
    for round in 0..100 {
        let scene = triangles(&mut random, 12);
        let camera = camera(&mut random, (8, 8), (1e-3, f64::INFINITY));
        let image = rasterize(&View::of_camera(&camera), &scene);
        let receivers = Receivers::new(&scene, &image, &camera, &light);
        let turn = DQuat::from_axis_angle(random.vector().normalize(), 3.0 * random.share());
        let (position, cube) = (2.0 * random.vector(), DMat3::from_quat(turn));
        let layers = turned_cube_faces(position, cube, scene.bounds());
        let spaces: Vec<_> = layers
            .iter()
            .map(|layer| LightSpace::new(layer, &receivers))
            .collect();
        // Along a diagonal of the cube three faces meet, in a plane through two of them two.
        let points = std::array::from_fn(|_| {
            std::array::from_fn(|lane| {
                let sides = [0, 1, 2].map(|i| f64::from(lane as u32 >> i & 1) * 2.0 - 1.0);
                let mut corner = DVec3::from_array(sides);
                corner[lane % 3] *= [1.0, random.share()][random.below(2)];
                position + cube * corner * (3.0 * random.share()) - camera.eye
            })
        });
        let lost = dispatch!(level(), simd => count_in_none(simd, &spaces, &points));
        assert_eq!(lost, 0, "round {round}");
    }
}

/// Checks all pixels; how many do not face the light and how many do.
#[inline(always)]
fn check_blocks<S: Simd>(simd: S, receivers: &Receivers) -> [usize; 2] {
    let view = light_view();
    let from_eye = ViewFromEye::new(&view, receivers.eye);
    let mut known = KnownPlanes::default();
    let mut block = BlockReceivers::none(simd);
    let mut places = BlockPlaces::none(simd);
    let mut counts = [0; 2];
    let tiling = receivers.image.tiling;
    for y in 0..tiling.height {
        for x in 0..tiling.width {
            let id = receivers.image.triangles[tiling.index(x, y)];
            if id == NONE {
                continue;
            }
            let (i, j) = (y % BLOCK, x % BLOCK);
            receivers.block(simd, (x - j, y - i), 0..BLOCK, &mut known, &mut block);
            let ray = receivers.ray((x, y), id);
            let is_facing = block.facing[i] >> j & 1 == 1;
            assert_eq!(is_facing, ray.is_facing(receivers.light), "{x} {y}");
            counts[usize::from(is_facing)] += 1;
            if !is_facing {
                continue;
            }
            let point = block.points[i].map(|axis| axis.as_slice()[j]);
            let off = DVec3::from_array(point).distance(ray.point);
            assert!(off <= 1e-7 * (1.0 + ray.point.length()), "{x} {y}: {off}");
            from_eye.places(simd, &block, &block.facing, &mut places);
            let expected = view.place(receivers.eye + ray.point);
            for (axis, expected) in [places.u, places.v, places.nearness].iter().zip(expected) {
                let off = axis[i].as_slice()[j] - expected;
                assert!(off.abs() <= 1e-4 * (1.0 + expected.abs()), "{x} {y}: {off}");
            }
            if receivers.light.position().is_some() {
                let faces = faces_around(simd, receivers.light_at, &block.points[i]);
                let faces = faces.map(|face| face >> j & 1 == 1);
                check_face(&faces, -ray.to_light);
            }
        }
    }
    counts
}

/// One face sees the point: that of the axis along which it is farthest from the light.
fn check_face(faces: &[bool; 6], from_light: DVec3) {
    let ahead = (0..6).filter(|&face| faces[face]);
    let ahead = ahead.map(|face| [1.0, -1.0][face % 2] * from_light[face / 2]);
    let ahead: Vec<_> = ahead.collect();
    let farthest = from_light.abs().max_element();
    assert!(
        ahead.len() == 1 && ahead[0] >= (1.0 - 1e-9) * farthest,
        "{faces:?} {from_light}"
    );
}
