use super::*;
use crate::bvh::Everything;
use crate::gpu::device::Variant;
use crate::gpu::{self, Gpu};
use crate::reference::{Reference, reference};
use glam::{DMat4, DQuat, DVec2, DVec3};
use std::f64::consts::FRAC_PI_2;
use std::sync::atomic::Ordering;

/// A floor, and over it rows of small squares.
pub(super) fn floor_and_squares(floor: f64) -> Scene {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    let mut add = |centre: DVec3, side: f64| {
        let first = vertices.len() as u32;
        for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)] {
            vertices.push(centre + DVec3::new(x, 0.0, z) * side);
        }
        triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
    };
    add(DVec3::ZERO, floor);
    for i in 0..100 {
        let (x, z) = (f64::from(i % 10), f64::from(i / 10));
        add(DVec3::new(0.6 * x - 2.7, 1.0, 0.6 * z - 2.7), 0.15);
    }
    Scene::new(vertices, triangles).unwrap()
}

pub(super) fn looking_down() -> Camera {
    looking_down_from(6.0)
}

fn looking_down_from(height: f64) -> Camera {
    let turned = DQuat::from_rotation_x(-FRAC_PI_2);
    Camera::new(
        DMat4::from_rotation_translation(turned, DVec3::new(0.0, height, 0.0)),
        DVec2::splat(60.0),
        DVec2::splat(48.0),
        (96, 96),
        (1e-3, f64::INFINITY),
    )
    .unwrap()
}

pub(super) fn sun() -> Light {
    Light::directional(DVec3::new(0.3, -1.0, 0.2)).unwrap()
}

/// The image that a method with its defaults finds.
pub(super) fn shadows(
    gpu: &Arc<Gpu>,
    (scene, camera, light): (&Scene, &Camera, &Light),
    name: &str,
) -> Result<Vec<f32>> {
    let schema = Method::schema(name)?;
    let method = Method::new(schema, &schema.defaults())?;
    let outputs = Outputs::from_names(&[], true)?;
    let engine = Engine::Gpu(gpu.clone());
    let cache = SceneCache::default();
    let mut frames = render(&engine, scene, &cache, camera, &[light], &method, outputs)?;
    Ok(frames.remove(0).visibility)
}

/// Pixels off ties that are not as the reference says.
pub(super) fn wrong_pixels(found: &[f32], truth: &Reference) -> usize {
    let pixels = found.iter().zip(&truth.visibility).zip(&truth.tie);
    let is_wrong = |((found, truth), is_tie): &((&f32, &f32), &bool)| {
        found.to_bits() != truth.to_bits() && !**is_tie
    };
    pixels.filter(is_wrong).count()
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
    let scene = floor_and_squares(4.0);
    let (camera, light) = (looking_down(), sun());
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

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn a_frame_like_the_one_before_makes_no_buffer_and_no_bind_group() {
    let scene = floor_and_squares(4.0);
    let lamp = Light::point(DVec3::new(0.4, 3.0, 0.7)).unwrap();
    let sun = sun();
    let outputs = Outputs::from_names(&[], true).unwrap();
    let bits = |frame: &Rendered| {
        let values = frame.visibility.iter();
        values.map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    // So that each frame sees something else.
    let cameras = [6.0, 6.1, 6.2, 6.1].map(looking_down_from);
    for (name, light) in [
        ("desired_view", &sun),
        ("cascades", &sun),
        ("rtw", &sun),
        ("notw", &sun),
        ("cube", &lamp),
        ("exact", &lamp),
        ("ray_traced", &lamp),
        ("shadow_volumes", &lamp),
    ] {
        let schema = Method::schema(name).unwrap();
        let method = Method::new(schema, &schema.defaults()).unwrap();
        let gpu = Gpu::variant(Variant::default());
        let engine = Engine::Gpu(gpu.clone());
        let cache = SceneCache::default();
        let frames = cameras.each_ref().map(|camera| {
            let before = gpu.pool.made();
            let frames = render(&engine, &scene, &cache, camera, &[light], &method, outputs);
            (bits(&frames.unwrap()[0]), gpu.pool.made() - before)
        });
        assert!(frames[0].1 > 10 && frames[0].0 != frames[2].0, "{name}");
        assert_eq!(frames[1].0, frames[3].0, "{name}");
        assert_eq!([frames[2].1, frames[3].1], [0, 0], "{name}");
        // They do not keep a scene's tables that is gone.
        assert!(gpu.kept_bind_groups() > 5, "{name}");
        drop(cache);
        assert_eq!(gpu.kept_bind_groups(), 0, "{name}");
    }
}

/// Products that a compiler may join to the sum that they are part of: by the left or by the right one of two.
fn contracted(source: String, functions: &str) -> String {
    let calls = [
        "dot(side.normal, ",
        "cross(away, ",
        "dot(volumes.clip_x, scaled)",
        "dot(volumes.clip_y, scaled)",
        "dot(volumes.clip_w, scaled)",
        "dot(normal_of_triangle(id), nearest)",
        "dot(ray.x, ",
        "dot(ray.y, ",
        "dot(ray.z, ",
        "cross(from_end, ",
    ];
    let whole = calls.iter().fold(source, |source, call| {
        source.replace(call, &format!("contracted_{call}"))
    });
    whole + functions
}

fn contracted_on_the_left(source: String) -> String {
    let functions = "
fn contracted_dot(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return fma(a.x, b.x, a.y * b.y) + a.z * b.z;
}
fn contracted_cross(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return fma(a.yzx, b.zxy, -(a.zxy * b.yzx));
}
";
    contracted(source, functions)
}

fn contracted_on_the_right(source: String) -> String {
    let functions = "
fn contracted_dot(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return fma(a.z, b.z, fma(a.y, b.y, a.x * b.x));
}
fn contracted_cross(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return fma(-a.zxy, b.yzx, a.yzx * b.zxy);
}
";
    contracted(source, functions)
}

/// With cross products that point the wrong way: a rewritten shader is run.
fn turned(source: String) -> String {
    let functions = "
fn contracted_dot(a: vec3<f32>, b: vec3<f32>) -> f32 {
    return dot(a, b);
}
fn contracted_cross(a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    return cross(b, a);
}
";
    contracted(source, functions)
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn contracted_products_change_no_exact_shadow() {
    let (camera, light) = (looking_down(), sun());
    // Float32 knows what a floor is that is little wider than the image; a wide one looks the same.
    let near = floor_and_squares(8.0);
    let truth = reference(&near, &Everything(&near), &camera, &light);
    let scene = floor_and_squares(1e6);
    let wrong = |gpu: &Arc<Gpu>, name| {
        let found = shadows(gpu, (&scene, &camera, &light), name).unwrap();
        wrong_pixels(&found, &truth)
    };
    let rewriting = |rewrite| {
        Gpu::variant(Variant {
            rewrite,
            ..Variant::default()
        })
    };
    for rewrite in [contracted_on_the_left, contracted_on_the_right] {
        let gpu = rewriting(rewrite);
        for name in ["exact", "ray_traced", "shadow_volumes"] {
            assert_eq!(wrong(&gpu, name), 0, "{name}");
        }
    }
    assert!(wrong(&rewriting(turned), "shadow_volumes") > 100);
}
