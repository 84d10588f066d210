//! Shadow maps: which triangle each texel's ray meets first, and how deep.

use super::bins::{Bin, Cover};
use super::known::Known;
use super::lanes::{
    LANES, Simd, columns64, dispatch, each_row, f32x8, f64x8, level, narrow, numbers, splat, u32x8,
};
use super::linear_map::drawn_linear;
use super::pages::table::PageTable;
use super::rasterize::{Image, NONE, Painter};
use super::ray_bins::RayBins;
use super::rays::RayTable;
use super::receiver_tiles::ReceiverTiles;
use super::receivers::splat64;
use super::tessellate::Piece;
use super::texels::{EMPTY, Texels, drawn_by};
use super::tile_rays::{Taken, TileRays};
use super::tiles::{TILE, TILE_PIXELS};
use super::view::{Nearness, Place, Planes, View};
use super::warp_map::CpuWarp;
use crate::error::Result;
use crate::lanes::Each;
use crate::projection::Projection;
use crate::scene::Scene;
use crate::sides::Source;
use fearless_simd::prelude::*;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A layer's texels.
pub struct Map {
    /// What the light sees: one view, or the faces of a cube.
    pub views: Arc<[MapView]>,
    pub image: Image,
    /// In the projection's unit, in tiles as the image is.
    pub depths: Vec<f32>,
    /// Where the tiles are those of some pages, page after page.
    pub pages: Option<PageTable>,
}

/// A view, and where it sees the scene's vertices.
pub struct MapView {
    pub view: View,
    pub places: Vec<Place>,
}

impl Map {
    /// All of it, or what is looked at; what the rest holds is undefined.
    pub fn new(
        projection: &Projection,
        warp: Option<&CpuWarp>,
        scene: &Scene,
        light: Source,
        looked_at: Option<&ReceiverTiles>,
    ) -> Self {
        let table = RayTable::new(projection, warp, light);
        let views = views_of(projection, table.as_ref(), scene, light);
        let straightened = projection.kind.straightened(projection);
        let depths = Depths::new(straightened.as_ref().unwrap_or(projection));
        let (image, depths) = match table {
            None => drawn(&views[0], scene, &depths, looked_at),
            Some(table) => drawn_at_rays(&views, scene, &depths, &table, looked_at),
        };
        Self {
            views,
            image,
            depths,
            pages: None,
        }
    }

    /// As published: of pieces of triangles whose edges are straight in the map.
    pub fn linear(
        projection: &Projection,
        scene: &Scene,
        light: Source,
        pieces: &[Piece],
    ) -> Result<Self> {
        let table = RayTable::new(projection, None, light);
        let (image, depths) = drawn_linear(projection, pieces)?;
        Ok(Self {
            views: views_of(projection, table.as_ref(), scene, light),
            image,
            depths,
            pages: None,
        })
    }

    /// Stored depths row by row, page by page, 1 where nothing is seen that may shadow a receiver. What is nearer than the
    /// nearest depth is drawn at it.
    pub fn stored_depths(&self, projection: &Projection) -> Vec<f32> {
        let (offset, scale) = projection.depth_from_z();
        let unit = projection.unit();
        let stored = |depth: f32| {
            let z = f64::from(depth) / unit;
            match z <= projection.far {
                true => ((z.max(projection.near) - offset) * scale) as f32,
                false => 1.0,
            }
        };
        let tiling = self.image.tiling;
        let images = self.depths.chunks(tiling.tiles() * TILE_PIXELS);
        let depths = images.flat_map(|image| tiling.row_by_row(image));
        depths.map(stored).collect()
    }
}

fn views_of(
    projection: &Projection,
    table: Option<&RayTable>,
    scene: &Scene,
    light: Source,
) -> Arc<[MapView]> {
    let faces = table.and_then(|table| table.faces.clone());
    let straightened = projection.kind.straightened(projection);
    let seen_by = straightened.as_ref().unwrap_or(projection);
    let views = faces.unwrap_or_else(|| vec![view_of(seen_by, light)]);
    let seen = views.into_iter().map(|view| MapView::new(view, scene));
    seen.collect()
}

impl MapView {
    pub fn new(view: View, scene: &Scene) -> Self {
        Self {
            places: view.places(scene),
            view,
        }
    }
}

/// What a light matrix sees.
pub fn view_of(projection: &Projection, light: Source) -> View {
    let is_central = projection.kind.is_central();
    View {
        origin: projection.origin,
        rows: projection
            .homogeneous_rows()
            .expect("it has a light matrix"),
        nearness: match is_central {
            true => Nearness::Inverse,
            false => Nearness::Linear(-projection.z_axis.extend(0.0)),
        },
        width: projection.width as usize,
        height: projection.height as usize,
        // Nothing behind a light's position is seen; of parallel rays, whatever lies before the nearest depth is.
        seen: match is_central {
            true => (0.0, f64::INFINITY),
            false => (f64::NEG_INFINITY, f64::INFINITY),
        },
        light: Some(light),
    }
}

fn drawn(
    MapView { view, places }: &MapView,
    scene: &Scene,
    depths: &Depths,
    looked_at: Option<&ReceiverTiles>,
) -> Texels {
    let (painter, bins) = match looked_at {
        None => Painter::new(view, scene, places, Cover::Middles),
        Some(tiles) => Painter::of_tiles(view, scene, places, Cover::Middles, tiles),
    };
    drawn_by(
        (painter.tiling, looked_at),
        || (),
        |(), (tile, blocks), ids, texels| {
            let bins = bins.iter().map(|of_thread| &of_thread[tile]);
            depths.draw_tile(&painter, bins, (tile, blocks), (ids, texels));
        },
    )
}

fn drawn_at_rays(
    views: &[MapView],
    scene: &Scene,
    depths: &Depths,
    table: &RayTable,
    looked_at: Option<&ReceiverTiles>,
) -> Texels {
    let painters: Vec<(_, RayBins)> = views
        .iter()
        .map(|MapView { view, places }| Painter::new(view, scene, places, Cover::Whole))
        .collect();
    // Faces of a cube have a size of their own.
    let tiling = table.tiling();
    drawn_by(
        (tiling, looked_at),
        TileRays::new,
        |rays, (tile, blocks), ids, texels| {
            ids.fill(NONE);
            texels.fill(EMPTY);
            let draw = |view: usize, rays: &TileRays, taken: &Taken| {
                let (painter, bins) = &painters[view];
                let texels = (&mut *ids, &mut *texels);
                dispatch!(level(), simd => depths.draw_at_rays(simd, (painter, bins), rays, taken, texels));
            };
            let corner = tiling.corner(tile);
            dispatch!(level(), simd => table.for_each_view(simd, (corner, blocks), rays, draw));
        },
    )
}

/// The rays of a tile's texels.
#[derive(Clone, Copy)]
enum Rays<'a> {
    /// Through the middles of columns and rows from a corner on.
    Middles((usize, usize)),
    Table(&'a TileRays),
}

impl Rays<'_> {
    /// A place near all of them, and what eight are relative to it.
    #[inline(always)]
    fn eight<S: Simd>(&self, simd: S, first: usize) -> (DVec2, [f64x8<S>; 2]) {
        let wide = |v: [f32; LANES]| f64x8::simd_from(simd, v.map(f64::from));
        match self {
            Self::Middles((x, y)) => {
                let column = numbers(simd) + ((first % TILE) as f32 + 0.5);
                let row = [(first / TILE) as f32 + 0.5; LANES];
                (
                    DVec2::new(*x as f64, *y as f64),
                    [wide(column.into()), wide(row)],
                )
            }
            Self::Table(rays) => {
                let (x, y) = rays.eight(simd, first);
                (rays.origin(), [wide(x.into()), wide(y.into())])
            }
        }
    }
}

/// From the triangle that a texel's ray meets to how deep. It is found anew, in float64: how near the rasterizer holds
/// a triangle to be depends on the order in which it came upon others.
pub struct Depths {
    kind: DepthKind,
    unit: f64,
    /// That of the farthest receiver.
    far: f32,
}

enum DepthKind {
    /// One over how near.
    Central,
    /// The same along a face of a cube of so many columns, but distances.
    Distance(f64),
    /// Of rays that are nearly parallel: one over how wide they are where they cross the plane of places, as a function of
    /// (column, row, 1), and their convergence.
    Parallel { narrowness: DVec3, convergence: f64 },
}

/// Of triangles that were asked for before, how near each is: a function of (column, row, 1) relative to a place.
type KnownNearness = Known<[f64; 4], 64>;

impl Depths {
    pub fn new(projection: &Projection) -> Self {
        let kind = match projection.kind.matrices() {
            None => DepthKind::Distance(f64::from(projection.size().longer())),
            Some(_) if projection.kind.is_central() => DepthKind::Central,
            Some([_, from_texel]) => {
                let row = from_texel.row(2);
                let at_corner = row.z - row.truncate().dot(projection.centre);
                DepthKind::Parallel {
                    narrowness: row.truncate().extend(at_corner),
                    convergence: projection.kind.convergence(),
                }
            }
        };
        let unit = projection.unit();
        let far = (projection.far * unit) as f32;
        Self { kind, unit, far }
    }

    /// Draws blocks of a tile of a light matrix.
    pub fn draw_tile<'a>(
        &self,
        painter: &Painter,
        bins: impl Iterator<Item = &'a Bin>,
        (tile, blocks): (usize, u64),
        (ids, texels): (&mut [u32], &mut [f32; TILE_PIXELS]),
    ) {
        let rays = Rays::Middles(painter.tiling.corner(tile));
        dispatch!(level(), simd => {
            painter.draw_tile(simd, bins, (tile, blocks), ids, texels);
            self.store(simd, painter, rays, (ids, texels));
        });
    }

    /// Draws at rays into the texels of a tile that have them.
    #[inline(always)]
    fn draw_at_rays<S: Simd>(
        &self,
        simd: S,
        (painter, bins): (&Painter, &RayBins),
        rays: &TileRays,
        taken: &Taken,
        (ids, texels): (&mut [u32], &mut [f32; TILE_PIXELS]),
    ) {
        if taken.is_all() {
            texels.fill(f32::NEG_INFINITY);
            painter.draw_at_rays(simd, bins, rays, (&mut *ids, &mut *texels), false);
            self.store(simd, painter, Rays::Table(rays), (ids, texels));
            return;
        }
        let (mut own_ids, mut nearness) = ([NONE; TILE_PIXELS], [0.0; TILE_PIXELS]);
        let (open, closed) = (splat(simd, f32::NEG_INFINITY), splat(simd, f32::INFINITY));
        for (nearness, mask) in nearness.chunks_exact_mut(LANES).zip(taken.masks(simd)) {
            mask.select(open, closed).store_slice(nearness);
        }
        let own = (&mut own_ids[..], &mut nearness);
        painter.draw_at_rays(simd, bins, rays, own, true);
        self.store(
            simd,
            painter,
            Rays::Table(rays),
            (&mut own_ids, &mut nearness),
        );
        for (i, mask) in taken.masks(simd).enumerate() {
            let eight = i * LANES..(i + 1) * LANES;
            let [own, known] = [&own_ids[eight.clone()], &ids[eight.clone()]];
            let id = mask.select(u32x8::from_slice(simd, own), u32x8::from_slice(simd, known));
            id.store_slice(&mut ids[eight.clone()]);
            let [own, known] = [&nearness[eight.clone()], &texels[eight.clone()]];
            let depth = mask.select(f32x8::from_slice(simd, own), f32x8::from_slice(simd, known));
            depth.store_slice(&mut texels[eight]);
        }
    }

    /// Puts depths in place of how near the texels of a tile are. Behind every receiver nothing is seen that may shadow one.
    #[inline(always)]
    fn store<S: Simd>(
        &self,
        simd: S,
        painter: &Painter,
        rays: Rays,
        (ids, texels): (&mut [u32], &mut [f32; TILE_PIXELS]),
    ) {
        let mut known = KnownNearness::default();
        let pairs = ids
            .chunks_exact_mut(LANES)
            .zip(texels.chunks_exact_mut(LANES));
        for (i, (ids, texels)) in pairs.enumerate() {
            let ids: &mut [u32; LANES] = ids.try_into().expect("eight");
            if *ids == [NONE; LANES] {
                texels.fill(EMPTY);
                continue;
            }
            let (origin, [x, y]) = rays.eight(simd, i * LANES);
            let mut nearness_of = |id: u32| {
                *known.get(id, || {
                    let planes = Planes::even_edge_on(painter.view, painter.scene, id, origin);
                    let nearness = planes.map_or(DVec3::ZERO, |planes| planes.nearness);
                    nearness.extend(0.0).to_array()
                })
            };
            let [a, b, c, _] = match *ids == [ids[0]; LANES] {
                true => nearness_of(ids[0]).each(|v| splat64(simd, v)),
                false => {
                    let mut rows = [[0.0; 4]; LANES];
                    for (row, &id) in rows.iter_mut().zip(&*ids).filter(|(_, id)| **id != NONE) {
                        *row = nearness_of(id);
                    }
                    columns64(simd, each_row(&rows))
                }
            };
            let nearness = x.mul_add(a, y.mul_add(b, c));
            let depth = self.depth(simd, nearness, [x + origin.x, y + origin.y]);
            let depth: [f32; LANES] = narrow(depth).into();
            for (texel, (id, depth)) in texels.iter_mut().zip(ids.iter_mut().zip(depth)) {
                *id = if depth <= self.far { *id } else { NONE };
                *texel = if *id == NONE { EMPTY } else { depth };
            }
        }
    }

    #[inline(always)]
    fn depth<S: Simd>(
        &self,
        simd: S,
        nearness: f64x8<S>,
        [column, row]: [f64x8<S>; 2],
    ) -> f64x8<S> {
        match self.kind {
            DepthKind::Central => splat64(simd, self.unit) / nearness,
            DepthKind::Distance(columns) => {
                let (x, y) = (column * (2.0 / columns) - 1.0, row * (2.0 / columns) - 1.0);
                let length = (x * x + (y * y + 1.0)).sqrt();
                length * self.unit / nearness
            }
            DepthKind::Parallel {
                narrowness,
                convergence,
            } => {
                let narrow = column * narrowness.x + (row * narrowness.y + narrowness.z);
                nearness * -self.unit / (nearness * convergence + narrow)
            }
        }
    }
}
