//! The grids of one light, which serve every camera whose receivers they hold.

use super::light_grid::{GRID, LightGrid};
use super::receivers::{Extent, ViewFromEye};
use super::view::View;
use crate::light::Light;
use crate::scene::Scene;
use glam::{DVec3, DVec4};
use std::sync::Arc;

/// A grid, and where it sees points from the eye.
pub type SeenGrid = (Arc<LightGrid>, ViewFromEye);

pub fn seen_grid(grid: Arc<LightGrid>, eye: DVec3) -> SeenGrid {
    let seen = ViewFromEye::new(&grid.view, eye);
    (grid, seen)
}

/// How far from the border of the grid the samples lie, in units.
const ROOM: f64 = 64.0;

/// Grids of one view, above which they are made anew for another camera: each receiver is looked for in each.
const MAX_KEPT: usize = 3;

/// What a view's samples may lie beyond what a grid was fitted to, as a share of its size: less than `ROOM`.
const MAX_BEYOND: f32 = 0.05;

/// How much narrower they may be.
const MIN_SHARE: f32 = 0.5;

/// The grids of one light. They serve every camera whose receivers they hold.
#[derive(Clone)]
pub struct Grids {
    generation: u64,
    light: Light,
    /// Of each view of the light.
    of_views: Vec<Vec<FittedGrid>>,
}

/// A grid, and the receivers that it was fitted to.
#[derive(Clone)]
struct FittedGrid {
    grid: Arc<LightGrid>,
    extent: Extent,
}

impl Grids {
    pub fn new(scene: &Scene, light: &Light, views: usize) -> Self {
        Self {
            generation: scene.generation(),
            light: light.clone(),
            of_views: vec![Vec::new(); views],
        }
    }

    pub fn are_of(&self, scene: &Scene, light: &Light) -> bool {
        self.generation == scene.generation() && self.light == *light
    }

    /// Takes those away that fit the samples badly, and the samples of the others.
    pub fn fit(&mut self, extents: &mut [Extent]) {
        for (grids, extent) in self.of_views.iter_mut().zip(extents) {
            let both = |all: Extent, fitted: &FittedGrid| all.and(fitted.extent);
            let all = grids.iter().fold(Extent::EMPTY, both);
            let first = grids.first().map_or(Extent::EMPTY, |fitted| fitted.extent);
            let fits = first.is_close_around(extent) || all.is_close_around(extent);
            match grids.len() <= MAX_KEPT && fits {
                true => *extent = Extent::EMPTY,
                false if !extent.is_empty() => grids.clear(),
                false => (),
            }
        }
    }

    /// Adds a grid for each extent that is not empty, and says whether there is one.
    pub fn add(&mut self, scene: &Scene, views: &[View], extents: &[Extent]) -> bool {
        for (grids, (view, &extent)) in self.of_views.iter_mut().zip(views.iter().zip(extents)) {
            if !extent.is_empty() {
                let grid = Arc::new(LightGrid::new(fitted(view, &extent), scene));
                grids.push(FittedGrid { grid, extent });
            }
        }
        extents.iter().any(|extent| !extent.is_empty())
    }

    pub fn seen_from(&self, eye: DVec3) -> Vec<Vec<SeenGrid>> {
        let seen = |fitted: &FittedGrid| seen_grid(fitted.grid.clone(), eye);
        let of_views = self.of_views.iter();
        of_views
            .map(|grids| grids.iter().map(seen).collect())
            .collect()
    }
}

impl Extent {
    /// Whether it holds another and is not much wider.
    fn is_close_around(&self, other: &Self) -> bool {
        (0..2).all(|k| {
            let size = self.high[k] - self.low[k];
            let room = MAX_BEYOND * size;
            other.high[k] - other.low[k] >= MIN_SHARE * size
                && self.low[k] - room <= other.low[k]
                && other.high[k] <= self.high[k] + room
        })
    }
}

/// Moves and scales a view, so that an extent fills it but for some room on each side.
pub fn fitted(view: &View, extent: &Extent) -> View {
    let [x, y, w] = view.rows;
    let fit = |row: DVec4, k: usize| {
        let (low, high) = (f64::from(extent.low[k]), f64::from(extent.high[k]));
        // No narrower than float32 can tell from its place.
        let size = (high - low)
            .max(1e-5 * low.abs().max(high.abs()))
            .max(f64::MIN_POSITIVE);
        (row - w * low) * ((GRID as f64 - 2.0 * ROOM) / size) + w * ROOM
    };
    View {
        rows: [fit(x, 0), fit(y, 1), w],
        ..view.clone()
    }
}
