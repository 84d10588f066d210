//! The pages of a map, drawn together: its triangles are sorted into the tiles of all of them at once.

use super::table::PageTable;
use super::tree::PageTree;
use crate::cpu::bins::{Bins, Cover, bins};
use crate::cpu::map::{Depths, Map, MapView, view_of};
use crate::cpu::rasterize::{Image, NONE, Painter};
use crate::cpu::receiver_tiles::ALL_BLOCKS;
use crate::cpu::texels::EMPTY;
use crate::cpu::tiles::{TILE_PIXELS, Tiling};
use crate::projection::Projection;
use crate::scene::Scene;
use crate::sides::Source;
use rayon::prelude::*;
use std::sync::Arc;

impl Map {
    /// A map that holds nothing, for a pass that looks at no texels.
    pub fn nothing() -> Self {
        let side = crate::cpu::tiles::TILE;
        Self {
            views: Arc::new([]),
            image: Image {
                tiling: Tiling::new(side, side),
                triangles: vec![NONE; TILE_PIXELS],
            },
            depths: vec![EMPTY; TILE_PIXELS],
            pages: None,
        }
    }

    /// The pages of a table. Those that the same map had before are taken from it.
    pub fn of_pages(
        projection: &Projection,
        scene: &Scene,
        light: Source,
        table: PageTable,
        before: Option<&Self>,
    ) -> Self {
        let views = match before {
            Some(before) => before.views.clone(),
            None => Arc::new([MapView::new(view_of(projection, light), scene)]),
        };
        let slot_before = |page: &[u32; 2]| before?.pages.as_ref()?.slot(*page);
        let known: Vec<_> = table.pages.iter().map(slot_before).collect();
        let is_drawn: Vec<_> = known.iter().map(Option::is_none).collect();
        let texels = table.grid.tiles() * TILE_PIXELS;
        let mut triangles = vec![NONE; table.pages.len() * texels];
        let mut depths = vec![EMPTY; triangles.len()];
        let job = Job::new(projection, scene, &views[0], &table, &is_drawn);
        let tiles = triangles.par_chunks_mut(TILE_PIXELS);
        let tiles = tiles.zip(depths.par_chunks_mut(TILE_PIXELS)).enumerate();
        tiles.for_each(|(tile, (ids, depths))| {
            let of_page = table.grid.tiles();
            match (known[tile / of_page], before) {
                (Some(slot), Some(before)) => {
                    let first = (slot * of_page + tile % of_page) * TILE_PIXELS;
                    let old = first..first + TILE_PIXELS;
                    ids.copy_from_slice(&before.image.triangles[old.clone()]);
                    depths.copy_from_slice(&before.depths[old]);
                }
                _ => job.draw(tile, ids, depths.try_into().expect("a tile")),
            }
        });
        let side = table.grid.page_size() as usize;
        Self {
            views,
            image: Image {
                tiling: Tiling::new(side, side),
                triangles,
            },
            depths,
            pages: Some(table),
        }
    }
}

/// The pages of a map that are to be drawn.
struct Job<'a> {
    table: &'a PageTable,
    painter: Painter<'a>,
    bins: Bins,
    depths: Depths,
}

impl<'a> Job<'a> {
    fn new(
        projection: &Projection,
        scene: &'a Scene,
        MapView { view, places }: &'a MapView,
        table: &'a PageTable,
        is_drawn: &[bool],
    ) -> Self {
        let tiling = Tiling::new(view.width, view.height);
        let tree = PageTree::new(table, tiling, is_drawn);
        let bins = match is_drawn.contains(&true) {
            true => bins(view, (tiling, &tree), scene, places, Cover::Middles),
            false => Bins::new(),
        };
        Self {
            table,
            painter: Painter {
                view,
                tiling,
                scene,
                places,
            },
            bins,
            depths: Depths::new(projection),
        }
    }

    /// Draws a tile of a page, by its number among those of all pages.
    fn draw(&self, tile: usize, ids: &mut [u32], depths: &mut [f32; TILE_PIXELS]) {
        let grid = self.table.grid;
        let (page, within) = (self.table.pages[tile / grid.tiles()], tile % grid.tiles());
        let along = grid.tiles_along();
        let x = page[0] as usize * along + within % along;
        let y = page[1] as usize * along + within / along;
        let tiling = self.painter.tiling;
        // The last pages may reach beyond the map.
        if x < tiling.columns && y < tiling.rows {
            let bins = self.bins.iter().map(|of_thread| &of_thread[tile]);
            let of_map = y * tiling.columns + x;
            self.depths
                .draw_tile(&self.painter, bins, (of_map, ALL_BLOCKS), (ids, depths));
        }
    }
}
