//! Where the pages of a map lie, and which of them are stored.

/// How a map is cut into pages, whose sides are powers of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PageGrid {
    /// The logarithm of the texels along a page's side.
    pub shift: u32,
    /// Along each side of the map.
    pub columns: u32,
}

/// In place of where a page is stored that is not.
pub const ABSENT: u32 = u32::MAX;

impl PageGrid {
    pub fn new(side: u32, page_size: u32) -> Self {
        Self {
            shift: page_size.ilog2(),
            columns: side.div_ceil(page_size),
        }
    }

    pub fn page_size(&self) -> u32 {
        1 << self.shift
    }

    /// Pages of the whole map.
    pub fn count(&self) -> usize {
        self.columns.pow(2) as usize
    }

    /// The page of a texel among all, row by row.
    #[inline(always)]
    pub fn page_of(&self, x: u32, y: u32) -> usize {
        ((y >> self.shift) * self.columns + (x >> self.shift)) as usize
    }

    /// Column and row of a page.
    pub fn place(&self, page: usize) -> [u32; 2] {
        let page = page as u32;
        [page % self.columns, page / self.columns]
    }

    /// Columns and rows of those pages that are asked for, of which there is a word of each of the whole map.
    pub fn places(&self, is_asked: impl Iterator<Item = bool>) -> Vec<[u32; 2]> {
        let asked = is_asked.enumerate().filter(|(_, is_asked)| *is_asked);
        asked.map(|(page, _)| self.place(page)).collect()
    }

    /// Of each page of the whole map the place among those that are stored, `ABSENT` if it is not.
    pub fn slots(&self, stored: &[[u32; 2]]) -> Vec<u32> {
        let mut slots = vec![ABSENT; self.count()];
        for (slot, [x, y]) in stored.iter().enumerate() {
            slots[(y * self.columns + x) as usize] = slot as u32;
        }
        slots
    }
}
