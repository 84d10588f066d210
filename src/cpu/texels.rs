//! The texels of a map, tile by tile.

use super::rasterize::Image;
use super::tiles::{TILE_PIXELS, Tiling};
use rayon::prelude::*;

/// Deeper than anything: of a texel that is empty.
pub const EMPTY: f32 = 3e38;

/// Triangles and depths of the texels, in tiles.
pub type Texels = (Image, Vec<f32>);

/// Has each tile drawn; each thread has its own state.
pub fn drawn_by<T>(
    tiling: Tiling,
    state: impl Fn() -> T + Sync + Send,
    draw: impl Fn(&mut T, usize, &mut [u32], &mut [f32; TILE_PIXELS]) + Sync + Send,
) -> Texels {
    let mut triangles = vec![0; tiling.tiles() * TILE_PIXELS];
    let mut texels = vec![0.0; triangles.len()];
    let tiles = triangles.par_chunks_mut(TILE_PIXELS);
    let tiles = tiles.zip(texels.par_chunks_mut(TILE_PIXELS)).enumerate();
    tiles.for_each_init(state, |state, (tile, (ids, texels))| {
        draw(state, tile, ids, texels.try_into().expect("a tile"));
    });
    (Image { tiling, triangles }, texels)
}
