//! Maps that are cut into pages, of which only those are drawn that receivers ask for: what is asked, and what was drawn.

pub mod footprint;
pub mod grid;

use crate::error::Result;

/// Texels along each side of a page: a power of two, at least this, which is a tile of the rasterizer.
pub const MIN_PAGE_SIZE: u32 = 64;

/// By how much the bias grows at least where too many pages are asked for.
const BIAS_STEP: f64 = 0.25;

/// How maps are cut into pages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paging {
    /// Texels along each side of a page.
    pub page_size: u32,
    /// Pages that are stored at most: there are no fewer than maps.
    pub max_pages: u32,
    /// By how many levels each receiver's is coarser than the one that matches its pixel.
    pub level_bias: f64,
    /// Whether the pages of the frame before are taken where they are the same.
    pub keeps: bool,
}

impl Paging {
    /// Texels along the sides of the levels of a map, the finest first. The last one is a single page.
    pub fn sides(&self, resolution: u32) -> Vec<u32> {
        let halves = std::iter::successors(Some(resolution), |side| Some(side / 2));
        let last = halves.clone().position(|side| side <= self.page_size);
        halves.take(last.expect("it shrinks") + 1).collect()
    }

    /// The bias, and of each level the pages that receivers ask for with it: it grows until there are no more than may be
    /// stored.
    pub fn bounded(
        &self,
        mut ask: impl FnMut(f64) -> Result<Vec<Places>>,
    ) -> Result<(f64, Vec<Places>)> {
        let most = f64::from(self.max_pages);
        let mut bias = self.level_bias;
        loop {
            let pages = ask(bias)?;
            let count = pages.iter().map(Vec::len).sum::<usize>() as f64;
            if count <= most {
                return Ok((bias, pages));
            }
            // A level coarser there are a quarter of the pages at least.
            let least = 0.5 * (count / most).log2();
            bias += (least / BIAS_STEP).floor().max(1.0) * BIAS_STEP;
        }
    }
}

/// Columns and rows of pages among those of a level.
pub type Places = Vec<[u32; 2]>;

/// Of a pixel, in texels of the finest level, the least area at which it looks into each coarser one: the coarsest whose
/// texels are no larger than the pixel, and coarser by the bias. `sides` are the levels' texels, the finest first.
pub fn least_texels(sides: &[u32], bias: f64) -> Vec<f32> {
    let finest = f64::from(sides[0]);
    let coarser = sides.iter().skip(1).map(|&side| {
        let width = finest / f64::from(side);
        (width * width / 4_f64.powf(bias)) as f32
    });
    coarser.collect()
}

/// No pixel is taken for a smaller one: so a bias reaches the coarsest level in the end.
pub const LEAST_TEXELS: f32 = 1e-12;

/// A page that was drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Page {
    /// The layer that it is of.
    pub layer: usize,
    /// Its column and row among the pages of the layer.
    pub place: [u32; 2],
    /// Whether it is one of the frame before.
    pub is_kept: bool,
}

/// What was drawn of maps in pages.
#[derive(Debug, Clone, Default)]
pub struct PagedMaps {
    pub page_size: u32,
    /// In the order in which they are stored.
    pub pages: Vec<Page>,
    /// Of each layer its map (the face of a cube, or the only one) and its level, 0 the finest.
    pub layers: Vec<[usize; 2]>,
    /// Of each pixel the layer that it looks into, row by row; `NO_LAYER` where it needs none.
    pub layer_of_pixel: Vec<u8>,
}

impl PagedMaps {
    pub fn new(paging: Paging) -> Self {
        Self {
            page_size: paging.page_size,
            ..Self::default()
        }
    }

    /// Adds the pages of a level, given by the numbers of its map and among that one's levels, as a layer, whose number
    /// this is.
    pub fn add(
        &mut self,
        level: [usize; 2],
        places: &[[u32; 2]],
        is_kept: impl Fn([u32; 2]) -> bool,
    ) -> u8 {
        let layer = self.layers.len();
        self.layers.push(level);
        self.pages.extend(places.iter().map(|&place| Page {
            layer,
            place,
            is_kept: is_kept(place),
        }));
        layer as u8
    }
}

/// Of a pixel that needs no map.
pub const NO_LAYER: u8 = u8::MAX;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn levels_halve_until_one_page_holds_all() {
        let paging = Paging {
            page_size: 128,
            max_pages: 1,
            level_bias: 0.0,
            keeps: false,
        };
        assert_eq!(paging.sides(1024), [1024, 512, 256, 128]);
        assert_eq!(paging.sides(1000), [1000, 500, 250, 125]);
        assert_eq!(paging.sides(128), [128]);
        assert_eq!(paging.sides(1), [1]);
    }
}
