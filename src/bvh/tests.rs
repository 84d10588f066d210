//! The walk of the hierarchy: what it must find, and how little else it looks at.

use super::*;
use crate::twin::Random;

/// The triangles near a ray.
fn met(bvh: &Bvh, ray: ThickRay) -> Vec<u32> {
    let mut met = Vec::new();
    bvh.visit(ray, |triangle| {
        met.push(triangle);
        ControlFlow::Continue(f64::INFINITY)
    });
    met
}

#[test]
fn grown_boxes_hold_their_triangles_and_the_margin() {
    let vertices = vec![
        DVec3::ZERO,
        DVec3::X / 3.0,
        DVec3::new(0.1, 0.7, 0.0),
        -DVec3::Z,
    ];
    let scene = Scene::new(vertices, vec![[0, 1, 2], [0, 0, 3], [1, 2, 3]]).unwrap();
    let boxes = TriangleBoxes::new(&scene);
    assert_eq!(boxes.triangles, [0, 2]);
    for margin in [0.0, WALK_MARGIN, 0.25] {
        for (triangle, [least, greatest]) in boxes.triangles.iter().zip(boxes.grown(margin)) {
            let slack = f64::from(margin);
            for corner in scene.corners(*triangle) {
                let corner = boxes.space.place_of(corner);
                let least = Vec3::from(least).as_dvec3();
                let greatest = Vec3::from(greatest).as_dvec3();
                assert!((corner - slack).cmpgt(least).all());
                assert!((corner + slack).cmplt(greatest).all());
            }
        }
    }
}

#[test]
fn a_packet_meets_what_each_of_its_rays_meets() {
    let mut random = Random(7);
    let mut vector = || DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0));
    let mut vertices = Vec::new();
    for _ in 0..400 {
        let middle = 10.0 * vector();
        vertices.extend([0; 3].map(|_| middle + 0.4 * vector()));
    }
    let triangles = (0..400).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    let bvh = Bvh::new(&Scene::new(vertices, triangles).unwrap());
    let met = |ray| met(&bvh, ray);
    let mut count = 0;
    for i in 0..500 {
        // From within the scene, and wide from far outside of it.
        let scale = if i % 4 < 2 { 1.0 } else { 8.0 };
        let (middle, spread) = (scale * 8.0 * vector(), scale * vector().abs());
        let light = 12.0 * vector();
        // Rays that all go one way, and rays that end in one point.
        let has_end = i % 2 == 0;
        let ray_from = |origin: DVec3, spread: DVec3| {
            let to_light = if has_end { light - origin } else { light };
            ThickRay {
                origin,
                direction: to_light.normalize(),
                start: 0.0,
                end: if has_end {
                    to_light.length()
                } else {
                    f64::INFINITY
                },
                margin: 1e-6,
                growth: 0.0,
                spread,
            }
        };
        let of_packet = met(ray_from(middle, spread));
        for _ in 0..20 {
            let of_one = met(ray_from(middle + spread * vector(), DVec3::ZERO));
            count += of_one.len();
            assert!(of_one.iter().all(|triangle| of_packet.contains(triangle)));
        }
    }
    assert!(count > 1000);
}

/// Triangles of very different sizes and places.
fn of_all_sizes(random: &mut Random, count: u32) -> Scene {
    let mut vertices = Vec::new();
    for i in 0..count {
        let mut vector = || DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0));
        let size = 10_f64.powi(i32::try_from(i % 9).unwrap() - 6);
        let middle = 1.5 * size * vector();
        vertices.extend([0; 3].map(|_| middle + size * vector()));
    }
    let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
    Scene::new(vertices, triangles.collect()).unwrap()
}

#[test]
fn a_ray_meets_the_triangle_that_it_goes_to_however_small_the_scene_makes_it() {
    let mut random = Random(11);
    let scene = of_all_sizes(&mut random, 900);
    let bvh = Bvh::new(&scene);
    for i in 0..20_000 {
        let id = random.below(900) as u32;
        let [a, b, c] = scene.corners(id);
        // At the rim of the triangle, or a margin beside it.
        let (share, growth) = (random.share(), if i % 3 == 0 { 1e-3 } else { 0.0 });
        let rim = a.lerp(b, share);
        let mut vector = || DVec3::from_array([0; 3].map(|_| 2.0 * random.share() - 1.0));
        let origin = rim + 10_f64.powi(i % 12 - 7) * vector();
        let outside = (rim - c).normalize_or_zero() * growth * (rim - origin).length();
        let target = rim + 0.9 * outside;
        let ray = ThickRay {
            origin,
            direction: (target - origin).normalize(),
            start: 0.0,
            // It ends there, or not.
            end: if i % 2 == 0 {
                (target - origin).length()
            } else {
                f64::INFINITY
            },
            margin: 1e-15 * (origin.length() + rim.length()),
            growth,
            spread: DVec3::ZERO,
        };
        assert!(met(&bvh, ray).contains(&id), "{i}: {id}");
    }
}

#[test]
fn what_lies_in_the_middle_of_a_wide_scene_is_told_apart() {
    // A wall of small triangles, alone and in a scene that is ten thousand times as wide.
    let side = 64;
    let corner = |x: u32, y: u32| {
        DVec3::new(f64::from(x), f64::from(y), 0.0) / f64::from(side) - 0.5 * DVec3::ONE
    };
    let wall = |width: f64| {
        let wide = [DVec3::X, DVec3::Y, -DVec3::X - DVec3::Y];
        let mut vertices = wide.map(|v| v * width - DVec3::Z).to_vec();
        for x in 0..side {
            for y in 0..side {
                vertices.extend([corner(x, y), corner(x + 1, y), corner(x, y + 1)]);
            }
        }
        let count = vertices.len() as u32 / 3;
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Bvh::new(&Scene::new(vertices, triangles.collect()).unwrap())
    };
    let (alone, in_wide) = (wall(1.0), wall(1e4));
    let mut random = Random(3);
    for _ in 0..200 {
        let place = DVec3::new(random.share() - 0.5, random.share() - 0.5, 1.5);
        let ray = ThickRay {
            origin: place,
            direction: DVec3::new(0.02, 0.01, -1.0).normalize(),
            start: 0.0,
            end: f64::INFINITY,
            margin: 1e-12,
            // What float32 may round of what an eye sees.
            growth: 1e-6,
            spread: DVec3::ZERO,
        };
        let (few, found) = (met(&alone, ray).len(), met(&in_wide, ray).len());
        // Leaves hold several triangles each.
        assert!(found <= few.max(8) + 8, "{few} {found}");
    }
}

/// Boxes that a ray enters, on all ways.
fn entered(bvh: &Bvh, from: DVec3, to: DVec3) -> usize {
    let [from, to] = [from, to].map(|place| bvh.space.place_of(place).as_vec3a());
    let inverse = (to - from).recip();
    let mut stack = vec![0];
    let mut count = 0;
    while let Some(index) = stack.pop() {
        let node: &Bvh2Node = &bvh.nodes[index as usize];
        let (a, b) = (
            (node.aabb.min - from) * inverse,
            (node.aabb.max - from) * inverse,
        );
        if a.min(b).max_element().max(0.0) <= a.max(b).min_element() {
            count += 1;
            if node.prim_count == 0 {
                stack.extend([node.first_index, node.first_index + 1]);
            }
        }
    }
    count
}

#[test]
fn a_wide_floor_does_not_spoil_the_hierarchy_of_what_stands_on_it() {
    // Balls of small triangles, and two triangles below them, so many times as wide.
    let hierarchy = |width: f64| {
        let mut vertices = Vec::new();
        let steps = 40;
        for ball in 0..9 {
            let middle = DVec3::new(f64::from(ball % 3), 0.5, f64::from(ball / 3)) - DVec3::ONE;
            let place = |i: i32, j: i32| {
                let [t, f] = [i, j].map(|i| f64::from(i) / f64::from(steps) * std::f64::consts::PI);
                let (sine, cosine) = (2.0 * f).sin_cos();
                middle + 0.4 * DVec3::new(t.sin() * cosine, t.cos(), t.sin() * sine)
            };
            for (i, j) in (0..steps).flat_map(|i| (0..steps).map(move |j| (i, j))) {
                vertices.extend([place(i, j), place(i + 1, j), place(i, j + 1)]);
                vertices.extend([place(i + 1, j), place(i + 1, j + 1), place(i, j + 1)]);
            }
        }
        let corner = |x: f64, z: f64| DVec3::new(2.0 * width * x, -1.0, 2.0 * width * z);
        vertices.extend([corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0)]);
        vertices.extend([corner(-1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
        let count = vertices.len() as u32 / 3;
        let triangles = (0..count).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Bvh::new(&Scene::new(vertices, triangles.collect()).unwrap())
    };
    let of_rays = |bvh: &Bvh| -> usize {
        let mut random = Random(17);
        let rays = (0..300).map(|_| {
            let from = DVec3::new(
                random.share() * 3.0 - 1.5,
                -0.95,
                random.share() * 3.0 - 1.5,
            );
            entered(bvh, from, from + DVec3::new(3.0, 4.0, 1.5))
        });
        rays.sum()
    };
    let (narrow, wide) = (of_rays(&hierarchy(1.0)), of_rays(&hierarchy(1e3)));
    assert!(wide < narrow * 3 / 2, "{narrow} {wide}");
}

#[test]
fn a_wide_packet_begins_before_any_of_its_rays_enters_the_scene() {
    let corner = DVec3::splat(-10.0);
    let small = |at: DVec3, size: f64| [at, at + size * DVec3::X, at + size * DVec3::Y];
    let vertices = [small(corner, 0.1), small(-corner, -0.1)].concat();
    let bvh = Bvh::new(&Scene::new(vertices, vec![[0, 1, 2], [3, 4, 5]]).unwrap());
    let direction = DVec3::new(0.95, 0.3, 0.1).normalize();
    let origin = corner + DVec3::new(0.03, 0.03, 0.0) - 40.0 * direction;
    // The ray in the middle passes the corner before it comes near the scene.
    let spread = DVec3::new(20.0, 20.0, 0.0);
    let middle = origin - 0.999 * DVec3::new(20.0, -20.0, 0.0);
    for (origin, spread) in [(origin, DVec3::ZERO), (middle, spread)] {
        let ray = ThickRay {
            origin,
            direction,
            start: 0.0,
            end: f64::INFINITY,
            margin: 1e-6,
            growth: 0.0,
            spread,
        };
        let met = met(&bvh, ray);
        assert!(met.contains(&0), "{spread}: {met:?}");
    }
}
