//! The pages of a level of a map on the device, `shaders/paging/pages.wgsl`.

use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::paging::grid::PageGrid;

shader_struct! {
    pub struct PagesUniform is Pages in "paging/pages" {
        shift: u32,
        columns: u32,
        coarse_columns: u32,
        number: u32,
        first_bit: u32,
    }
}

/// A level among those of all maps.
#[derive(Debug, Clone, Copy)]
pub struct NumberedLevel {
    pub grid: PageGrid,
    /// From 1 on.
    pub number: u32,
    /// Of its pages among those of all levels.
    pub first_page: u32,
}

impl NumberedLevel {
    fn uniform(self, coarse_columns: u32) -> PagesUniform {
        PagesUniform {
            shift: self.grid.shift,
            columns: self.grid.columns,
            coarse_columns,
            number: self.number,
            first_bit: self.first_page,
        }
    }
}

/// What begins a page table: whether no texel is looked at, but its page is asked for.
const LOOKS: u32 = 0;
const ASKS: u32 = 1;

/// The table of lookups that ask for pages, which have none yet.
pub fn table_of_requests(frame: &Recording) -> Result<PooledBuffer> {
    frame.constants("page table", &[ASKS, 0])
}

/// Which pages of a level have texels, and where.
pub struct StoredPages {
    level: NumberedLevel,
    coarse_columns: u32,
    count: usize,
    table: PooledBuffer,
}

impl StoredPages {
    /// Of a level with so many texels along each side, whose coarse tiles have `1 << coarse` of them, by columns and
    /// rows.
    pub fn new(
        frame: &Recording,
        side: u32,
        coarse: u32,
        level: NumberedLevel,
        places: &[[u32; 2]],
    ) -> Result<Self> {
        let grid = level.grid;
        let columns = side.div_ceil(1 << coarse);
        let mut table = [&[LOOKS], &*grid.slots(places)].concat();
        let first = table.len();
        table.resize(first + columns.pow(2) as usize, 0);
        for &[x, y] in places {
            // The last page may reach beyond the map.
            let tiles = [x, y].map(|place| {
                let first = place << grid.shift;
                let last = (first + grid.page_size()).min(side) - 1;
                first >> coarse..=last >> coarse
            });
            let [of_columns, of_rows] = tiles;
            for row in of_rows {
                for column in of_columns.clone() {
                    table[first + (row * columns + column) as usize] = 1;
                }
            }
        }
        Ok(Self {
            level,
            coarse_columns: columns,
            count: places.len(),
            table: frame.constants("page table", &table)?,
        })
    }

    pub fn texel_count(&self) -> usize {
        self.count << (2 * self.level.grid.shift)
    }
}

/// What a lookup does in the pages of a level.
#[derive(Clone, Copy)]
pub enum PagesInput<'a> {
    /// Asks for them in place of looking: a bit for each of all levels, with a table that says so.
    Ask(NumberedLevel, [&'a wgpu::Buffer; 2]),
    Look(&'a StoredPages),
}

impl Kernel {
    /// The pages that the rasterizer draws.
    pub fn stored_pages(self, pages: &StoredPages) -> Self {
        self.fill("paging/pages")
            .uniform(26, &pages.level.uniform(pages.coarse_columns))
            .bind(9, &pages.table)
    }

    /// The pages of a lookup, and of each pixel the number of its level. `unused` stands for requests.
    pub fn pages_looked_at(
        self,
        pages: PagesInput,
        level_of_pixel: &wgpu::Buffer,
        unused: &wgpu::Buffer,
    ) -> Self {
        let kernel = match pages {
            PagesInput::Look(pages) => self.stored_pages(pages).bind(27, unused),
            PagesInput::Ask(level, [requests, table]) => self
                .fill("paging/pages")
                .uniform(26, &level.uniform(0))
                .bind(9, table)
                .bind(27, requests),
        };
        kernel.bind(28, level_of_pixel)
    }
}
