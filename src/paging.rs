//! Maps that are cut into pages, of which only those are drawn that receivers ask for: what is asked, and what was drawn.

/// Texels along each side of a page: a power of two, at least this, which is a tile of the rasterizer.
pub const MIN_PAGE_SIZE: u32 = 64;

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
}

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
