//! Exact shadows of several samples in each pixel.
//!
//! A triangle is set up once for all samples, and what is true of a pixel's whole square is found once: which triangle all
//! samples see, that none of them is shadowed, or that one triangle shadows them all. Only the samples of other pixels
//! are drawn and tested one by one, as frames of moved cameras would: every answer is theirs.
//!
//! Chris Wyman, Rama Hoetzlein, Aaron Lefohn. Frustum-traced raster shadows: revisiting irregular z-buffers. I3D 2015.

mod cover;
mod draw;
mod footprint_tests;
mod footprints;
mod pattern;
mod receivers;
mod sampler;
mod squares;
#[cfg(test)]
mod tests;

use super::bins::Cover;
use super::exact::{milliseconds, views};
use super::extents::Extent;
use super::frame::{
    CASTER_TESTS_LABEL, KeptParts, LIGHT_GRID_LABEL, RECEIVERS_LABEL, VISIBILITY_LABEL, check_image,
};
use super::lanes::{dispatch, level};
use super::light_grids::Grids;
use super::rasterize::{Image, Painter};
use super::receivers::{Receivers, ViewFromEye};
use super::tiles::cut;
use super::view::View;
use crate::camera::Camera;
use crate::error::Result;
use crate::light::Light;
use crate::scene::Scene;
use cover::{TileCover, cover_tile};
use glam::DVec2;
pub use pattern::MAX_SAMPLES;
use pattern::Pattern;
use rayon::prelude::*;
pub use sampler::Effort;
use sampler::{Sampler, Scratch, TileRows};
use std::time::Instant;

/// Of each pixel, row by row, how many samples are lit and how many see a surface.
pub struct Counted {
    pub lit: Vec<u8>,
    pub seen: Vec<u8>,
    pub effort: Effort,
    /// Milliseconds of each pass.
    pub timings: [(&'static str, f64); 4],
}

/// Counts the samples of a camera's pixels: at most `MAX_SAMPLES` places, from a pixel's centre, none farther than half a
/// pixel along an axis.
pub fn count_samples(
    scene: &Scene,
    camera: &Camera,
    light: &Light,
    places: &[DVec2],
    kept: &KeptParts,
) -> Result<Counted> {
    check_image(camera)?;
    let pattern = Pattern::new(camera, places);
    let start = Instant::now();
    let view = View::of_camera(camera);
    let vertices = view.places(scene);
    let (painter, bins) = Painter::new(&view, scene, &vertices, Cover::Whole);
    let tiling = painter.tiling;
    let cover = |tile| dispatch!(level(), simd => cover_tile(simd, &painter, &bins, tile));
    let covers: Vec<_> = (0..tiling.tiles()).into_par_iter().map(cover).collect();
    drop(bins);
    let ids: Vec<_> = covers.iter().map(|cover| &cover.ids[..]).collect();
    let image = Image {
        tiling,
        triangles: ids.concat(),
    };
    let of_visibility = milliseconds(start);
    let start = Instant::now();
    let receivers = Receivers::new(scene, &image, camera, light);
    let views = views(light, scene.bounds());
    let seen = views.iter().map(|view| ViewFromEye::new(view, camera.eye));
    let seen: Vec<_> = seen.collect();
    let mut grids = Grids::of(kept.grids.known(), scene, light, views.len());
    let mut extents = grids.missing(&receivers, &seen);
    let of_receivers = milliseconds(start);
    let mut tiles = TilesToDo::new(&covers);
    let pixels = tiling.width * tiling.height;
    let (mut lit, mut surface) = (vec![0; pixels], vec![0; pixels]);
    let rows = cut(&mut lit, tiling)
        .into_iter()
        .zip(cut(&mut surface, tiling));
    tiles.open = rows.map(|(lit, seen)| [lit, seen]).enumerate().collect();
    let (mut of_grids, mut of_tests) = (0.0, 0.0);
    // Again with more grids where some receivers are beside what the samples showed, or in a crowd.
    while !tiles.open.is_empty() {
        let start = Instant::now();
        grids.add(scene, &views, &extents);
        of_grids += milliseconds(start);
        let start = Instant::now();
        let sampler = Sampler {
            painter: &painter,
            pattern: &pattern,
            receivers: &receivers,
            views: &seen,
            grids: &grids.seen_from(camera.eye),
        };
        extents = tiles.answer(&sampler);
        of_tests += milliseconds(start);
    }
    let effort = tiles.effort;
    kept.grids.keep(grids);
    Ok(Counted {
        lit,
        seen: surface,
        effort,
        timings: [
            (VISIBILITY_LABEL, of_visibility),
            (RECEIVERS_LABEL, of_receivers),
            (LIGHT_GRID_LABEL, of_grids),
            (CASTER_TESTS_LABEL, of_tests),
        ],
    })
}

/// Tiles without an answer, by their numbers.
struct TilesToDo<'a, 'r> {
    covers: &'a [Box<TileCover>],
    open: Vec<(usize, TileRows<'r>)>,
    effort: Effort,
}

impl<'a> TilesToDo<'a, '_> {
    fn new(covers: &'a [Box<TileCover>]) -> Self {
        Self {
            covers,
            open: Vec::new(),
            effort: Effort::default(),
        }
    }

    /// Answers them, and gives the extents of receivers that fall in no grid; their tiles stay open, and those with some in
    /// a crowd without a grid.
    fn answer(&mut self, sampler: &Sampler) -> Vec<Extent> {
        let open = std::mem::take(&mut self.open).into_par_iter();
        let answers = open.map_init(Scratch::default, |scratch, (tile, mut rows)| {
            let cover = &*self.covers[tile];
            let found = sampler.answer_tile(tile, cover, &mut rows, scratch);
            (tile, rows, found)
        });
        let answers: Vec<_> = answers.collect();
        let mut extents = vec![Extent::EMPTY; sampler.views.len()];
        for (tile, rows, (effort, beside)) in answers {
            let Some(beside) = beside else {
                self.effort = self.effort.and(effort);
                continue;
            };
            for (extent, beside) in extents.iter_mut().zip(beside) {
                *extent = extent.and(beside);
            }
            self.open.push((tile, rows));
        }
        extents
    }
}
