//! Many triangles in little of what is seen: right pixels, and few boxes for each receiver.

use super::*;
use crate::bvh::Bvh;
use crate::cpu::light_grid::{CELL, GRID_CELLS};
use crate::cpu::light_grids::SeenGrid;
use crate::cpu::receivers::Receivers;

/// Triangles in a cube of side 1 that stands on the ground.
fn heap(random: &mut Random, count: usize) -> Vec<[DVec3; 3]> {
    let size = (count as f64).powf(-1.0 / 3.0);
    let mut corners = Vec::new();
    for _ in 0..count {
        let middle = 0.5 * random.vector() + 0.55 * DVec3::Y;
        corners.push([0; 3].map(|_| middle + size * random.vector()));
    }
    corners
}

/// A heap on a floor five hundred times as wide, from nearby and so that it is less than a pixel wide.
fn heaps_and_cameras() -> (Scene, [Camera; 2]) {
    let mut corners = floor(250.0);
    corners.extend(heap(&mut Random(21), 12_000));
    let near = DQuat::from_rotation_x(-0.4);
    let far = DQuat::from_rotation_x(-0.9);
    let range = (1e-3, f64::INFINITY);
    let cameras = [
        camera_at(DVec3::new(0.1, 1.5, 2.5), near, (96, 64), range),
        camera_at(DVec3::new(0.3, 300.0, 230.0), far, (96, 64), range),
    ];
    (scene_of(&corners), cameras)
}

fn lights_of_heap() -> Vec<Light> {
    vec![
        Light::directional(DVec3::new(0.55, -0.7, -0.35)).unwrap(),
        Light::point(DVec3::new(-60.0, 90.0, 40.0)).unwrap(),
        Light::spot(
            DVec3::new(-60.0, 90.0, 40.0),
            DVec3::new(0.6, -0.9, -0.4),
            1.2,
        )
        .unwrap(),
    ]
}

/// Triangles that are looked through for a point.
fn listed_for(seen: &SeenGrid, point: DVec3) -> usize {
    let [u, v, ..] = seen.grid.view.place(point);
    let [column, row] = [u, v].map(|place| (place as usize / CELL).min(GRID_CELLS - 1));
    match seen.grid.crowds.of_cell(row * GRID_CELLS + column) {
        Some(crowd) => listed_for(seen.finer[crowd].as_ref().unwrap(), point),
        None => seen.grid.cell(column, row).ids().count(),
    }
}

#[test]
fn pixels_beside_a_heap_on_a_wide_floor_are_right() {
    let (scene, cameras) = heaps_and_cameras();
    for light in lights_of_heap() {
        for camera in &cameras {
            let [dark, lit] = assert_right_by(&Bvh::new(&scene), &scene, camera, &light, "heap");
            // From far away the heap and its shadow are smaller than a pixel.
            let is_far = camera.eye.y > 9.0;
            assert!((is_far || dark > 0) && lit > 500, "{dark} {lit}");
        }
    }
}

#[test]
fn few_triangles_of_a_heap_are_looked_through_for_a_receiver() {
    let (scene, cameras) = heaps_and_cameras();
    let light = &lights_of_heap()[0];
    for camera in &cameras {
        let image = rasterize(&View::of_camera(camera), &scene);
        let answer = exact(&scene, &image, camera, light, None);
        let grids = answer.grids.seen_from(camera.eye);
        let receivers = Receivers::new(&scene, &image, camera, light);
        let mut most = 0;
        let mut in_finer = 0;
        for (pixel, &id) in triangle_ids(&image).iter().enumerate() {
            if id < 0 || answer.visibility[pixel] != 1.0 {
                continue;
            }
            let ray = receivers.ray((pixel % 96, pixel / 96), id as u32);
            let listed = listed_for(&grids[0][0], ray.eye + ray.point);
            most = most.max(listed);
            in_finer += usize::from(listed > 2);
        }
        // A cell of the grid over all that is seen holds most of them.
        assert!(
            most < 600 && (in_finer > 0 || camera.eye.y > 9.0),
            "{most} {in_finer}"
        );
    }
}

#[test]
fn crowds_are_the_same_for_any_number_of_threads_and_serve_other_cameras() {
    let (scene, cameras) = heaps_and_cameras();
    for light in lights_of_heap() {
        let frame = |camera: &Camera, known| {
            let image = rasterize(&View::of_camera(camera), &scene);
            exact(&scene, &image, camera, &light, known)
        };
        let bits = |answer: &Answer| -> Vec<u32> {
            answer.visibility.iter().map(|v| v.to_bits()).collect()
        };
        for camera in &cameras {
            let of_threads = [1, 2, 3].map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
                pool.build().unwrap().install(|| bits(&frame(camera, None)))
            });
            assert!(of_threads.iter().all(|other| *other == of_threads[0]));
            let first = frame(camera, None);
            assert!(first.has_new_grids);
            let again = frame(camera, Some(Arc::new(first.grids)));
            assert!(!again.has_new_grids && bits(&again) == of_threads[0]);
        }
        // The far camera's grid serves the near one, which sees into its crowds.
        let known = Some(Arc::new(frame(&cameras[1], None).grids));
        assert_eq!(
            bits(&frame(&cameras[0], known)),
            bits(&frame(&cameras[0], None))
        );
    }
}

#[test]
fn cells_that_share_their_triangles_do_not_share_where_these_are() {
    // So many large triangles over each other that each tile is one cell.
    let mut random = Random(8);
    let mut corners = floor(500.0);
    for i in 0..600 {
        let size = 200.0 + 800.0 * random.share();
        let y = 5.0 + 0.01 * f64::from(i);
        corners.push([
            DVec3::new(-size, y, -size),
            DVec3::new(size, y, -size),
            DVec3::new(0.0, y + 1.0, size),
        ]);
    }
    let scene = scene_of(&corners);
    let camera = camera_at(
        DVec3::new(0.0, 600.0, 450.0),
        DQuat::from_rotation_x(-0.9),
        (96, 60),
        (1e-3, f64::INFINITY),
    );
    let light = Light::directional(DVec3::new(0.55, -0.7, -0.35)).unwrap();
    let [dark, lit] = assert_right_by(&Bvh::new(&scene), &scene, &camera, &light, "layers");
    assert!(dark > 0 && lit > 2000, "{dark} {lit}");
}
