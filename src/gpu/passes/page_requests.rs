//! Pass "page requests": of each receiver the level that matches its pixel, and the pages that its lookup touches.
//!
//! What is touched is found by the lookup's own pipeline, which then looks at nothing: so it rounds as the lookup does, and
//! no texel is missed. The requests are read back, because which levels fit into the bound on pages is for the same code to
//! say as on the CPU engine, and because only then is it known how much memory the pages take.

use super::inputs::Receivers;
use super::lookup::{LookupInput, lookup_dispatch};
use super::stored_pages::{NumberedLevel, PagesInput, table_of_requests};
use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{Read, Recording, Source};
use crate::gpu::shader_struct::shader_struct;
use crate::paging::footprint::Density;
use crate::paging::{LEAST_TEXELS, Places};
use crate::projection::Projection;

pub const LABEL: &str = "page requests";

/// Coarser levels of a map that a shader can tell apart, at most.
const MAX_COARSER: usize = 12;

shader_struct! {
    pub struct DensityUniform is Density in "lib/footprint" {
        constant: [f32; 3],
        growth: f32,
        width: [f32; 4],
    }
}

shader_struct! {
    pub struct PageLevelsUniform is PageLevels in "page_levels" {
        image: DensityUniform,
        map: DensityUniform,
        first_number: u32,
        least_texels: f32,
        padding: [f32; 2],
        least: [f32; MAX_COARSER],
    }
}

impl DensityUniform {
    fn new(density: &Density<f64>) -> Self {
        let Density {
            constant,
            growth,
            width,
            least_width,
        } = density;
        Self {
            constant: [constant.x, constant.y, constant.z].map(|v| v as f32),
            growth: *growth as f32,
            width: [width.x, width.y, width.z, *least_width].map(|v| v as f32),
        }
    }
}

/// Records which level each receiver of each map looks into: numbers from 1 on, one map after the other. `least` are
/// those of `least_texels`; `level_of_pixel` has a word for each pixel.
pub fn page_levels(
    frame: &mut Recording,
    maps: &[(Receivers, &Projection)],
    least: &[f32],
    level_of_pixel: &wgpu::Buffer,
) {
    frame.clear(level_of_pixel);
    let rows = frame.gpu.work_per_invocation(1, 32);
    let mut coarser = [f32::MAX; MAX_COARSER];
    coarser[..least.len()].copy_from_slice(least);
    let maps = maps.iter().enumerate();
    let dispatches = maps.map(|(number, (seen, projection))| {
        let (camera, eye) = (seen.camera, seen.camera.eye);
        let of_map = projection.homogeneous_rows();
        let of_map = of_map.expect("it has a light matrix");
        let uniform = PageLevelsUniform {
            image: DensityUniform::new(&Density::new(camera.image_rows())),
            map: DensityUniform::new(&Density::moved(of_map, eye - projection.origin)),
            first_number: 1 + (number * (least.len() + 1)) as u32,
            least_texels: LEAST_TEXELS,
            padding: [0.0; 2],
            least: coarser,
        };
        let kernel = Kernel::new("page_levels")
            .receivers(*seen, &seen.uniform(projection))
            .tiles(*seen, rows)
            .uniform(0, &uniform)
            .bind(1, level_of_pixel);
        kernel.dispatch(seen.groups(rows))
    });
    let dispatches: Vec<_> = dispatches.collect();
    frame.pass(LABEL, &dispatches);
}

/// A bit for each page of all levels.
pub struct PageRequests {
    bits: PooledBuffer,
    table: PooledBuffer,
    words: usize,
}

impl PageRequests {
    pub fn new(frame: &mut Recording, levels: &[NumberedLevel]) -> Result<Self> {
        let last = levels.last().expect("a map has a level");
        let words = (last.first_page as usize + last.grid.count()).div_ceil(32);
        let bits = frame.storage(LABEL, 4 * words as u64)?;
        frame.clear(&bits);
        let table = table_of_requests(frame)?;
        Ok(Self { bits, table, words })
    }

    /// For lookups that ask for a level's.
    pub fn of(&self, level: NumberedLevel) -> PagesInput<'_> {
        PagesInput::Ask(level, [&self.bits, &self.table])
    }

    /// Records what lookups ask for.
    pub fn ask(
        &self,
        frame: &mut Recording,
        lookups: &[(Receivers, LookupInput)],
        visibility: &wgpu::Buffer,
    ) {
        let dispatches = lookups.iter();
        let dispatches =
            dispatches.map(|(seen, map)| lookup_dispatch(frame, *seen, *map, visibility));
        let dispatches: Vec<_> = dispatches.collect();
        frame.pass(LABEL, &dispatches);
    }

    pub fn read(self, frame: &mut Recording) -> Result<Read<u32>> {
        frame.read(Source::Taken(self.bits), self.words)
    }
}

/// Of each level the pages that are asked for, by the bits that were read.
pub fn requested(levels: &[NumberedLevel], words: &[u32]) -> Vec<Places> {
    let is_asked = |page: usize| words[page / 32] >> (page % 32) & 1 != 0;
    let levels = levels.iter().map(|level| {
        let first = level.first_page as usize;
        let pages = first..first + level.grid.count();
        level.grid.places(pages.map(is_asked))
    });
    levels.collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paging::grid::PageGrid;

    #[test]
    fn bits_are_those_of_pages_level_by_level() {
        let grids = [PageGrid::new(640, 128), PageGrid::new(320, 128)];
        let levels = [0, 25].map(|first_page| NumberedLevel {
            grid: grids[usize::from(first_page > 0)],
            number: 1,
            first_page,
        });
        let mut words = [0; 2];
        for page in [0, 7, 24, 25, 31, 32, 33] {
            words[page / 32] |= 1 << (page % 32);
        }
        let found = requested(&levels, &words);
        assert_eq!(found[0], [[0, 0], [2, 1], [4, 4]]);
        assert_eq!(found[1], [[0, 0], [0, 2], [1, 2], [2, 2]]);
    }
}
