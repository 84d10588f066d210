//! The texels of a map, tile by tile.

use super::rasterize::Image;
use super::receiver_tiles::{ALL_BLOCKS, ReceiverTiles};
use super::tiles::{TILE_PIXELS, Tiling};
use rayon::prelude::*;

/// Deeper than anything: of a texel that is empty.
pub const EMPTY: f32 = 3e38;

/// Triangles and depths of the texels, in tiles.
pub type Texels = (Image, Vec<f32>);

/// Has each tile drawn, or those that are looked at: its number and its blocks that are; each thread has its own state.
pub fn drawn_by<T>(
    (tiling, looked_at): (Tiling, Option<&ReceiverTiles>),
    state: impl Fn() -> T + Sync + Send,
    draw: impl Fn(&mut T, (usize, u64), &mut [u32], &mut [f32; TILE_PIXELS]) + Sync + Send,
) -> Texels {
    let mut triangles = vec![0; tiling.tiles() * TILE_PIXELS];
    let mut texels = vec![0.0; triangles.len()];
    let tiles = triangles.par_chunks_mut(TILE_PIXELS);
    let tiles = tiles.zip(texels.par_chunks_mut(TILE_PIXELS)).enumerate();
    tiles.for_each_init(state, |state, (tile, (ids, texels))| {
        let blocks = looked_at.map_or(ALL_BLOCKS, |tiles| tiles.blocks(tile));
        if blocks != 0 {
            draw(
                state,
                (tile, blocks),
                ids,
                texels.try_into().expect("a tile"),
            );
        }
    });
    (Image { tiling, triangles }, texels)
}
