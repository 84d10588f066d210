//! Shadows by maps in pages.

use super::{RasterizedLayer, Recorded, RecordedPages, View};
use crate::error::{Error, Result};
use crate::fits::layer::Layer;
use crate::fits::pages::{Level, levels_of};
use crate::gpu::passes::inputs::{ImageTiles, Receivers};
use crate::gpu::passes::lookup::{LevelInput, LookupInput, lookup};
use crate::gpu::passes::page_requests::{PageRequests, page_levels, requested};
use crate::gpu::passes::rasterize::{RasterJob, coarse_shift};
use crate::gpu::passes::shadow_map;
use crate::gpu::passes::stored_pages::{NumberedLevel, PagesInput, StoredPages};
use crate::gpu::pool::PooledBuffer;
use crate::map_settings::{MapSettings, position_rounding};
use crate::paging::{NO_LAYER, PagedMaps, Paging, Places, least_texels};
use crate::stats::Fact;
use std::sync::Arc;

/// What the requests and the lookups of pages share.
struct PagedLookups {
    settings: MapSettings,
    /// Of each map the tiles of the image that may hold its receivers.
    tiles: Vec<Option<Arc<ImageTiles>>>,
    levels: Vec<Level>,
    numbered: Vec<NumberedLevel>,
    level_of_pixel: PooledBuffer,
    unused: PooledBuffer,
    visibility: PooledBuffer,
}

/// Each level with its number and that of its first page.
fn numbered(levels: &[Level]) -> Vec<NumberedLevel> {
    let mut first_page = 0;
    let levels = levels.iter().zip(1..).map(|(level, number)| {
        let numbered = NumberedLevel {
            grid: level.grid,
            number,
            first_page,
        };
        first_page += level.grid.count() as u32;
        numbered
    });
    levels.collect()
}

impl PagedLookups {
    /// A lookup in a level, and its receivers: of all that are seen those that chose it, which knew the map's region.
    fn input<'a>(
        &'a self,
        seen: Receivers<'a>,
        number: usize,
        pages: PagesInput<'a>,
        texels: &'a PooledBuffer,
    ) -> (Receivers<'a>, LookupInput<'a>) {
        let level = &self.levels[number];
        let projection = &level.layer.projection;
        let rounding = position_rounding(projection, seen.camera.eye);
        let input = LookupInput {
            projection,
            warp: None,
            texels,
            comparison: self.settings.lookup,
            bias: self.settings.bias.depth_bias(projection, rounding),
            rounding,
            pages: Some(LevelInput {
                pages,
                level_of_pixel: &self.level_of_pixel,
                unused: &self.unused,
            }),
        };
        let tiles = self.tiles[level.map].as_deref();
        (Receivers { tiles, ..seen }, input)
    }
}

impl View<'_> {
    /// Looks receivers up in pages of maps, whose resolution is that of their finest level. There is a map. All pages are
    /// drawn anew.
    pub(super) fn shadows_in_pages(
        &mut self,
        settings: MapSettings,
        maps: &[Layer],
        paging: Paging,
    ) -> Result<Recorded> {
        let sides = paging.sides(maps[0].projection.width);
        let levels = levels_of(maps, &sides, paging.page_size);
        let tiles = maps.iter().map(|map| self.image_tiles(&map.region));
        let tiles = tiles.collect::<Result<_>>()?;
        let visibility = self.begun_image()?;
        let pixels = self.camera.pixel_count() as u64;
        let lookups = PagedLookups {
            settings,
            tiles,
            numbered: numbered(&levels),
            levels,
            level_of_pixel: self.frame.storage("levels of pixels", 4 * pixels)?,
            unused: self.frame.storage("unused", 16)?,
            visibility,
        };
        let (bias, asked) = paging.bounded(|bias| {
            let least = least_texels(&sides, bias);
            self.asked(maps, &least, &lookups)
        })?;
        let mut record = PagedMaps::new(paging);
        let mut layer_of_level = vec![NO_LAYER; lookups.levels.len()];
        let mut layers = Vec::new();
        for (number, places) in asked.iter().enumerate() {
            if places.is_empty() {
                continue;
            }
            let Level { map, level, .. } = lookups.levels[number];
            layer_of_level[number] = record.add([map, level], places, |_| false);
            layers.push(self.draw_and_look(&lookups, number, places)?);
        }
        let facts = vec![
            Fact::sum("pages", record.pages.len() as u32),
            Fact::sum("kept_pages", 0),
        ];
        self.frame.facts.add(shadow_map::LABEL, facts);
        self.stats.measures.push(("level_bias", bias));
        Ok(Recorded {
            visibility: lookups.visibility,
            layers,
            pages: Some(RecordedPages {
                maps: record,
                level_of_pixel: lookups.level_of_pixel,
                layer_of_level,
            }),
        })
    }

    /// Of each level the pages that the lookups of its receivers touch. Submits what was recorded so far.
    fn asked(
        &mut self,
        maps: &[Layer],
        least: &[f32],
        lookups: &PagedLookups,
    ) -> Result<Vec<Places>> {
        let (frame, seen) = (&mut self.frame, self.seen);
        let of_maps = maps.iter().zip(&lookups.tiles);
        let of_maps = of_maps.map(|(map, tiles)| {
            let seen = seen.within(&map.region, tiles.as_deref());
            (seen, &map.projection)
        });
        let of_maps: Vec<_> = of_maps.collect();
        page_levels(frame, &of_maps, least, &lookups.level_of_pixel);
        let requests = PageRequests::new(frame, &lookups.numbered)?;
        let inputs = lookups.numbered.iter().enumerate();
        let inputs = inputs.map(|(number, level)| {
            lookups.input(seen, number, requests.of(*level), &lookups.unused)
        });
        let inputs: Vec<_> = inputs.collect();
        requests.ask(frame, &inputs, &lookups.visibility);
        let read = requests.read(frame)?;
        let words = self.submit()?.take(&read)?;
        Ok(requested(&lookups.numbered, &words))
    }

    /// Casters into the pages of a level, and its receivers against them.
    fn draw_and_look(
        &mut self,
        lookups: &PagedLookups,
        number: usize,
        places: &[[u32; 2]],
    ) -> Result<RasterizedLayer> {
        let (layer, lookup_of) = (&lookups.levels[number].layer, lookups.settings.lookup);
        let frame = &mut self.frame;
        let projection = &layer.projection;
        let (side, coarse) = (projection.width, coarse_shift(projection));
        let pages = StoredPages::new(frame, side, coarse, lookups.numbered[number], places)?;
        let target = lookup_of.target();
        let bytes = (pages.texel_count() * target.texel_bytes()) as u64;
        let most = frame.gpu.largest_storage();
        if bytes > most {
            let of_page = bytes / places.len() as u64;
            return Err(Error::Device(format!(
                "the {} pages of one level need {bytes} bytes in one buffer, the device {} allows {most}: store no more                  than {} pages, or take device='cpu'",
                places.len(),
                frame.gpu.adapter.name,
                most / of_page
            )));
        }
        let job = RasterJob {
            target,
            pages: Some(&pages),
            ..RasterJob::plain(projection)
        };
        let texels = shadow_map::shadow_map(frame, self.seen.scene, job)?;
        let (seen, input) = lookups.input(self.seen, number, PagesInput::Look(&pages), &texels);
        lookup(frame, seen, input, &lookups.visibility);
        Ok(RasterizedLayer {
            plan: layer.clone().into(),
            comparison: lookup_of,
            texel_count: pages.texel_count(),
            texels,
        })
    }
}
