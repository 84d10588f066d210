//! Maps in pages: each receiver asks for the pages that its lookup touches, of the level that matches its pixel, and only
//! those are drawn. What is asked for is found by the lookup itself, which then looks at nothing, so that no texel is
//! missed.

mod draw;
mod footprints;
pub mod kept;
pub mod table;
mod tree;

use super::frame::{
    DrawnLayer, Frame, LOOKUP_LABEL, PAGE_REQUESTS_LABEL, PlannedLayer, Recorded, SHADOW_MAP_LABEL,
    check_pages,
};
use super::lookup::{LookedUp, lookup};
use super::map::Map;
use super::receivers::Receivers;
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::map_settings::MapSettings;
use crate::paging::{NO_LAYER, Page, PagedMaps, Paging};
use crate::sides::Source;
use footprints::footprints;
use kept::KeptPages;
use std::sync::Arc;
use table::{PageGrid, PageTable, Requests};

/// By how much the bias grows at least where too many pages are asked for.
const BIAS_STEP: f64 = 0.25;

/// A level of a map.
struct Level {
    layer: Layer,
    grid: PageGrid,
    map: usize,
    level: usize,
}

fn levels_of(maps: &[Layer], sides: &[u32], page_size: u32) -> Vec<Level> {
    let maps = maps.iter().enumerate();
    let levels = maps.flat_map(|(map, layer)| {
        sides.iter().enumerate().map(move |(level, &side)| Level {
            layer: layer.with_resolution(side),
            grid: PageGrid::new(side, page_size),
            map,
            level,
        })
    });
    levels.collect()
}

/// What the receivers ask for.
struct Asked {
    bias: f64,
    /// Of each pixel, in tiles, the number of its level.
    numbers: Vec<u8>,
    /// Of each level.
    pages: Vec<Vec<[u32; 2]>>,
}

/// Asks with a bias that grows until there are no more pages than may be stored.
fn asked(
    receivers: &Receivers,
    (maps, levels): (&[Layer], &[Level]),
    sides: &[u32],
    settings: MapSettings,
    paging: Paging,
) -> Asked {
    let footprints = footprints(receivers, maps);
    let most = f64::from(paging.max_pages);
    let mut bias = paging.level_bias;
    loop {
        let numbers = footprints.levels(sides, bias);
        let pages = pages_of(receivers, levels, &numbers, settings);
        let count = pages.iter().map(Vec::len).sum::<usize>() as f64;
        if count <= most {
            return Asked {
                bias,
                numbers,
                pages,
            };
        }
        // A level coarser there are a quarter of the pages at least.
        let least = 0.5 * (count / most).log2();
        bias += (least / BIAS_STEP).floor().max(1.0) * BIAS_STEP;
    }
}

/// Of each level the pages that the lookups of its receivers touch.
fn pages_of(
    receivers: &Receivers,
    levels: &[Level],
    numbers: &[u8],
    settings: MapSettings,
) -> Vec<Vec<[u32; 2]>> {
    let mut is_asked = [false; NO_LAYER as usize + 1];
    for &number in numbers {
        is_asked[usize::from(number)] = true;
    }
    let nothing = Map::nothing();
    let all = levels.iter().zip(0..NO_LAYER);
    let asked: Vec<_> = all
        .filter(|(_, number)| is_asked[usize::from(*number)])
        .map(|(level, number)| (level, number, Requests::new(level.grid)))
        .collect();
    let looked: Vec<_> = asked
        .iter()
        .map(|(level, number, requests)| {
            LookedUp::new(receivers, &level.layer, (&nothing, None), None, settings)
                .of_pixels(numbers, *number)
                .asking(requests)
        })
        .collect();
    lookup(receivers, &looked);
    let mut pages = vec![Vec::new(); levels.len()];
    for (_, number, requests) in &asked {
        pages[usize::from(*number)] = requests.pages();
    }
    pages
}

impl Frame<'_> {
    /// Looks receivers up in pages of maps, whose resolution is that of their finest level.
    pub(super) fn answer_in_pages(
        &mut self,
        settings: MapSettings,
        maps: &[Layer],
        paging: Paging,
    ) -> Result<Recorded> {
        self.camera.check_float32(self.scene.bounds())?;
        let sides = paging.sides(maps[0].projection.width);
        let levels = levels_of(maps, &sides, paging.page_size);
        let asked = self.timed(PAGE_REQUESTS_LABEL, |frame| {
            let maps = (maps, &levels[..]);
            asked(&frame.receivers(), maps, &sides, settings, paging)
        });
        let count: usize = asked.pages.iter().map(Vec::len).sum();
        check_pages(count, paging.page_size)?;
        let kept = (self.culls && paging.keeps).then(|| self.kept.pages.known());
        let kept = kept.flatten();
        let kept = kept.filter(|kept| kept.are_of(self.scene, self.light));
        let mut record = PagedMaps {
            page_size: paging.page_size,
            ..PagedMaps::default()
        };
        let mut layers = Vec::new();
        let mut layer_of_number = [NO_LAYER; NO_LAYER as usize + 1];
        for (number, (level, pages)) in levels.into_iter().zip(asked.pages).enumerate() {
            if pages.is_empty() {
                continue;
            }
            layer_of_number[number] = layers.len() as u8;
            record.layers.push([level.map, level.level]);
            let before = kept.as_ref();
            let before = before.and_then(|kept| kept.map(&level.layer.projection));
            record.pages.extend(pages.iter().map(|&place| Page {
                layer: layers.len(),
                place,
                is_kept: before.is_some_and(|before| before.has_page(place)),
            }));
            let table = PageTable::new(level.grid, pages);
            let map = self.timed(SHADOW_MAP_LABEL, |frame| {
                let (projection, light) = (&level.layer.projection, Source::of(frame.light));
                Map::of_pages(projection, frame.scene, light, table, before)
            });
            layers.push(DrawnLayer {
                plan: PlannedLayer::from(level.layer),
                map: Arc::new(map),
                moments: None,
            });
        }
        let tiling = self.image().tiling;
        let of_pixel = |number: u8| layer_of_number[usize::from(number)];
        let numbers: Vec<_> = asked.numbers.into_iter().map(of_pixel).collect();
        record.layer_of_pixel = tiling.row_by_row(&numbers);
        let visibility = self.timed(LOOKUP_LABEL, |frame| {
            let receivers = frame.receivers();
            let looked = layers.iter().zip(0..NO_LAYER);
            let looked: Vec<_> = looked
                .map(|(DrawnLayer { plan, map, .. }, number)| {
                    LookedUp::new(&receivers, &plan.layer, (map, None), None, settings)
                        .of_pixels(&numbers, number)
                })
                .collect();
            lookup(&receivers, &looked)
        });
        self.note(&record, asked.bias);
        if paging.keeps {
            self.keep_pages(&layers);
        }
        self.stats.layers = layers.len();
        Ok(Recorded {
            visibility,
            layers,
            pages: Some(record),
        })
    }

    fn note(&mut self, record: &PagedMaps, bias: f64) {
        let kept = record.pages.iter().filter(|page| page.is_kept).count();
        self.count(SHADOW_MAP_LABEL, "pages", record.pages.len() as u64);
        self.count(SHADOW_MAP_LABEL, "kept_pages", kept as u64);
        self.stats.measures.push(("level_bias", bias));
    }

    fn keep_pages(&self, layers: &[DrawnLayer]) {
        let maps = layers.iter();
        let maps = maps.map(|layer| (layer.plan.layer.projection.clone(), layer.map.clone()));
        let kept = KeptPages::new(self.scene, self.light, maps.collect());
        self.kept.pages.keep(kept);
    }
}
