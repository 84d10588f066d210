use super::*;
use crate::gpu;
use glam::{DMat4, DQuat, DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;
use std::sync::atomic::Ordering;

/// A floor, and over it rows of small squares.
fn floor_and_squares() -> Scene {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let mut add = |centre: DVec3, side: f64| {
        let first = vertices.len() as u32;
        for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)] {
            vertices.push(centre + DVec3::new(x, 0.0, z) * side);
        }
        triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
    };
    add(DVec3::ZERO, 4.0);
    for i in 0..100 {
        let (x, z) = (f64::from(i % 10), f64::from(i / 10));
        add(DVec3::new(0.6 * x - 2.7, 1.0, 0.6 * z - 2.7), 0.15);
    }
    Scene::new(vertices, triangles).unwrap()
}

#[test]
fn what_has_no_room_together_is_done_one_by_one() {
    let mut calls = Vec::new();
    let mut work = |items: &[i32]| {
        calls.push(items.len());
        match items {
            [0] => Err(Error::Value("zero".to_string())),
            [one] => Ok(vec![-one]),
            _ => Err(Error::Device("no memory".to_string())),
        }
    };
    assert_eq!(
        one_by_one_where_short(&[1, 2, 3], &mut work),
        Ok(vec![-1, -2, -3])
    );
    assert!(one_by_one_where_short(&[1, 0], &mut work).is_err());
    assert_eq!(calls, [3, 1, 1, 1, 2, 1, 1]);
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn casters_in_parts_cast_the_same_shadows() {
    let scene = floor_and_squares();
    let looking_down = DQuat::from_rotation_x(-FRAC_PI_2);
    let camera = Camera::new(
        DMat4::from_rotation_translation(looking_down, DVec3::new(0.0, 6.0, 0.0)),
        DVec2::splat(60.0),
        DVec2::splat(48.0),
        (96, 96),
        (1e-3, f64::INFINITY),
    )
    .unwrap();
    let light = Light::directional(DVec3::new(0.3, -1.0, 0.2)).unwrap();
    let exact = Method::schema("exact").unwrap();
    let method = Method::new(exact, &exact.defaults()).unwrap();
    let cache = SceneCache::default();
    let render = || {
        let outputs = Outputs::from_names(&[], true).unwrap();
        let engine = Engine::Gpu(gpu::gpu("").unwrap());
        let lights = [&light];
        let rendered = render(&engine, &scene, &cache, &camera, &lights, &method, outputs);
        rendered.unwrap().remove(0)
    };
    let whole = render();
    let in_shadow = whole.visibility.iter().filter(|v| **v == 0.0).count();
    assert!((200..5000).contains(&in_shadow), "{in_shadow}");
    let cached = lock(&cache.gpu);
    let tables = &cached.as_ref().unwrap().tables;
    tables.room.caster_parts.store(5, Ordering::Relaxed);
    drop(cached);
    let parted = render();
    let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&parted.visibility), bits(&whole.visibility));
    // Each part lists fewer.
    let items = |rendered: &Rendered| {
        let mut passes = rendered.stats.facts.0.iter();
        let of_pass = passes.find(|(label, _)| *label == "caster tests");
        let mut facts = of_pass.unwrap().1.iter();
        facts.find(|fact| fact.name == "work_items").unwrap().value
    };
    assert!(2 * items(&parted) < items(&whole) + 2);
}
