//! Exact shadows: a grid of triangles over the receivers, as the light sees them, and every receiver against those in
//! its cell, or in that of a finer grid where many triangles lie in few cells (`crowds`).

use super::caster_tests::{Known, Tests};
use super::extents::Extent;
use super::frame::{CASTER_TESTS_LABEL, LIGHT_GRID_LABEL, RECEIVERS_LABEL};
use super::lanes::{dispatch, level};
use super::light_grid::GRID;
use super::light_grids::Grids;
use super::rasterize::Image;
use super::receivers::{Receivers, ViewFromEye};
use super::tiles::cut;
use super::view::{Nearness, View, cube_views};
use crate::camera::Camera;
use crate::fits::source::is_far_away;
use crate::light::Light;
use crate::scene::Scene;
use crate::sides::Source;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;
use std::time::Instant;

/// 1 lit, 0 in shadow, NaN where nothing is seen, row by row; and what it took.
pub struct Answer {
    pub visibility: Vec<f32>,
    /// Milliseconds of each pass.
    pub timings: [(&'static str, f64); 3],
    pub grids: Grids,
    /// Whether there are grids that were not known.
    pub has_new_grids: bool,
}

/// Takes what grids are known as far as they fit.
pub fn exact(
    scene: &Scene,
    image: &Image,
    camera: &Camera,
    light: &Light,
    known: Option<Arc<Grids>>,
) -> Answer {
    let start = Instant::now();
    let receivers = Receivers::new(scene, image, camera, light);
    let views = views(light, scene.bounds());
    let seen = views
        .iter()
        .map(|view| ViewFromEye::new(view, receivers.eye));
    let seen: Vec<_> = seen.collect();
    let width = image.tiling.width;
    // Zeros, which the threads that fill them in come upon first: the system hands them out as they are touched.
    let mut visibility = vec![0.0; width * image.tiling.height];
    let mut grids = Grids::of(known, scene, light, views.len());
    let mut extents = grids.missing(&receivers, &seen);
    let mut open: Vec<_> = cut(&mut visibility, image.tiling)
        .into_iter()
        .enumerate()
        .collect();
    let mut timings = [
        (RECEIVERS_LABEL, milliseconds(start)),
        (LIGHT_GRID_LABEL, 0.0),
        (CASTER_TESTS_LABEL, 0.0),
    ];
    let mut has_new_grids = false;
    // Again with more grids where some receivers are beside what the samples showed, or in a crowd.
    while !open.is_empty() {
        let start = Instant::now();
        has_new_grids |= grids.add(scene, &views, &extents);
        timings[1].1 += milliseconds(start);
        let start = Instant::now();
        let tests = Tests {
            scene,
            light_at: receivers.light_at,
            views: &seen,
            grids: &grids.seen_from(receivers.eye),
            ray: &|pixel, triangle| receivers.ray(pixel, triangle),
            trusts_hits: true,
        };
        let answer = |known: &mut Known, (tile, mut rows): (usize, Vec<_>)| {
            let left = dispatch!(level(), simd => tests.answer_tile(simd, &receivers, tile, &mut rows, known));
            left.map(|beside| (tile, rows, beside))
        };
        let answers = open.into_par_iter().map_init(Known::default, answer);
        let beside: Vec<_> = answers.flatten().collect();
        extents = vec![Extent::EMPTY; views.len()];
        for (_, _, beside) in &beside {
            for (extent, beside) in extents.iter_mut().zip(beside) {
                *extent = extent.and(*beside);
            }
        }
        open = beside.into_iter().map(|(i, rows, _)| (i, rows)).collect();
        timings[2].1 += milliseconds(start);
    }
    Answer {
        visibility,
        timings,
        grids,
        has_new_grids,
    }
}

/// Since a start.
pub fn milliseconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64() * 1e3
}

/// What the light sees of a box: all of it by rays that do not start nearby, the faces of a cube around a position.
pub fn views(light: &Light, (low, high): (DVec3, DVec3)) -> Vec<View> {
    let source = Source::of(light);
    // Around the middle of the box float64 holds places and depths, however far the light is.
    let middle = 0.5 * low + 0.5 * high;
    let (to_light, convergence) = match light.position() {
        None => (light.vector_from_point(DVec3::ZERO), 0.0),
        Some(position) if is_far_away(position, (low, high)) => {
            let (to_light, distance) = (position - middle).normalize_and_length();
            (to_light, distance.recip())
        }
        Some(position) => return cube_views(position, source, GRID).collect(),
    };
    let (x, y) = to_light.any_orthonormal_pair();
    vec![View {
        origin: middle,
        rows: [
            x.extend(0.0),
            y.extend(0.0),
            (to_light * -convergence).extend(1.0),
        ],
        nearness: Nearness::Linear(to_light.extend(0.0)),
        width: GRID,
        height: GRID,
        seen: (f64::NEG_INFINITY, f64::INFINITY),
        light: Some(source),
    }]
}
