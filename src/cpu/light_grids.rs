//! The grids of one light, which serve every camera whose receivers they hold.

use super::crowds::Crowd;
use super::extents::{Extent, sampled_extents};
use super::finer_grids::make_finer;
use super::light_grid::{LightGrid, fitted};
use super::receivers::{Receivers, ViewFromEye};
use super::tiles::BLOCK;
use super::view::View;
use crate::light::Light;
use crate::scene::Scene;
use glam::DVec3;
use std::sync::Arc;

/// A grid, and where it sees points from the eye.
pub struct SeenGrid {
    pub grid: Arc<LightGrid>,
    pub view: ViewFromEye,
    /// Of each crowd, once it is made.
    pub finer: Vec<Option<Self>>,
}

impl SeenGrid {
    pub fn new(grid: Arc<LightGrid>, eye: DVec3) -> Self {
        let of_crowd = |crowd: &Crowd<LightGrid>| Some(Self::new(crowd.grid()?.clone(), eye));
        Self {
            view: ViewFromEye::new(&grid.view, eye),
            finer: grid.crowds.all.iter().map(of_crowd).collect(),
            grid,
        }
    }
}

/// Grids of one view, above which they are made anew for another camera: each receiver is looked for in each.
const MAX_KEPT: usize = 3;

/// Of how many blocks along each axis one is sampled where grids are known: those that they do not hold are found anyway.
const SPACING_OF_KNOWN: usize = 2;

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
    fn new(scene: &Scene, light: &Light, views: usize) -> Self {
        Self {
            generation: scene.generation(),
            light: light.clone(),
            of_views: vec![Vec::new(); views],
        }
    }

    /// Those that are known, if they are of the scene as it is and of the light; else none yet.
    pub fn of(known: Option<Arc<Self>>, scene: &Scene, light: &Light, views: usize) -> Self {
        match known.filter(|grids| grids.are_of(scene, light)) {
            Some(grids) => (*grids).clone(),
            None => Self::new(scene, light, views),
        }
    }

    fn are_of(&self, scene: &Scene, light: &Light) -> bool {
        self.generation == scene.generation() && self.light == *light
    }

    /// Of each view, the extent of its receivers if it is to have a grid of them: known ones that fit them are kept.
    pub fn missing(&mut self, receivers: &Receivers, seen: &[ViewFromEye]) -> Vec<Extent> {
        if self.of_views.iter().any(|grids| !grids.is_empty()) {
            let extents = sampled_extents(receivers, seen, SPACING_OF_KNOWN);
            let mut pairs = self.of_views.iter().zip(&extents);
            if pairs.all(|(grids, extent)| extent.is_empty() || fit(grids, extent)) {
                return vec![Extent::EMPTY; extents.len()];
            }
        }
        let mut extents = sampled_extents(receivers, seen, 1);
        for (grids, extent) in self.of_views.iter_mut().zip(&mut extents) {
            match fit(grids, extent) {
                true => *extent = Extent::EMPTY,
                false if !extent.is_empty() => grids.clear(),
                false => (),
            }
        }
        extents
    }

    /// Adds a grid for each extent that is not empty, and those of crowds that are wanted; says whether there are any.
    pub fn add(&mut self, scene: &Scene, views: &[View], extents: &[Extent]) -> bool {
        for (grids, (view, &extent)) in self.of_views.iter_mut().zip(views.iter().zip(extents)) {
            if !extent.is_empty() {
                let grid = Arc::new(LightGrid::new(fitted(view, &extent), scene));
                grids.push(FittedGrid { grid, extent });
            }
        }
        let mut has_new = extents.iter().any(|extent| !extent.is_empty());
        for FittedGrid { grid, .. } in self.of_views.iter().flatten() {
            has_new |= make_finer(grid, scene, false);
        }
        has_new
    }

    pub fn seen_from(&self, eye: DVec3) -> Vec<Vec<SeenGrid>> {
        let seen = |fitted: &FittedGrid| SeenGrid::new(fitted.grid.clone(), eye);
        let of_views = self.of_views.iter();
        of_views
            .map(|grids| grids.iter().map(seen).collect())
            .collect()
    }
}

/// Whether the grids of a view are few, and the first or all of them fit the samples.
fn fit(grids: &[FittedGrid], samples: &Extent) -> bool {
    let both = |all: Extent, fitted: &FittedGrid| all.and(fitted.extent);
    let all = grids.iter().fold(Extent::EMPTY, both);
    let first = grids.first().map_or(Extent::EMPTY, |fitted| fitted.extent);
    let fits = first.is_close_around(samples) || all.is_close_around(samples);
    grids.len() <= MAX_KEPT && fits
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

/// Receivers that are in crowds.
#[derive(Default)]
pub struct Crowded<'a> {
    /// Finer grids, and those that fall in them.
    pub finer: Vec<(&'a SeenGrid, [u32; BLOCK])>,
    /// Whether a grid that some fall in is to be made.
    pub waits: bool,
}

impl<'a> Crowded<'a> {
    /// Puts receivers of one crowd aside.
    #[inline(never)]
    pub fn add(&mut self, seen: &'a SeenGrid, crowd: usize, masks: &[u32; BLOCK]) {
        let Some(finer) = &seen.finer[crowd] else {
            seen.grid.crowds.all[crowd].want();
            self.waits = true;
            return;
        };
        let of_finer = |(grid, _): &&mut (&SeenGrid, _)| std::ptr::eq(*grid, finer);
        match self.finer.iter_mut().find(of_finer) {
            Some((_, all)) => {
                for (all, more) in all.iter_mut().zip(masks) {
                    *all |= more;
                }
            }
            None => self.finer.push((finer, *masks)),
        }
    }
}
