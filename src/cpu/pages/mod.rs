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
use super::lookup::{LookedUp, ask, lookup};
use super::map::Map;
use super::receivers::Receivers;
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::fits::pages::{Level, levels_of};
use crate::map_settings::MapSettings;
use crate::paging::{NO_LAYER, PagedMaps, Paging, Places};
use crate::sides::Source;
use footprints::footprints;
use kept::KeptPages;
use std::sync::Arc;
use table::{PageTable, Requests};

/// Of each level the pages that the lookups of its receivers touch.
fn pages_of(
    receivers: &Receivers,
    levels: &[Level],
    numbers: &[u8],
    settings: MapSettings,
) -> Vec<Places> {
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
    ask(receivers, &looked);
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
        let (numbers, bias, asked) = self.timed(PAGE_REQUESTS_LABEL, |frame| {
            let receivers = frame.receivers();
            let footprints = footprints(&receivers, maps);
            let mut numbers = Vec::new();
            let (bias, asked) = paging.bounded(|bias| {
                numbers = footprints.levels(&sides, bias);
                Ok(pages_of(&receivers, &levels, &numbers, settings))
            })?;
            Ok((numbers, bias, asked))
        })?;
        let count: usize = asked.iter().map(Vec::len).sum();
        check_pages(count, paging.page_size)?;
        let kept = (self.culls && paging.keeps).then(|| self.kept.pages.known());
        let kept = kept.flatten();
        let kept = kept.filter(|kept| kept.are_of(self.scene, self.light));
        let mut record = PagedMaps::new(paging);
        let mut layers = Vec::new();
        let mut layer_of_number = [NO_LAYER; NO_LAYER as usize + 1];
        for (number, (level, pages)) in levels.into_iter().zip(asked).enumerate() {
            if pages.is_empty() {
                continue;
            }
            let before = kept.as_ref();
            let before = before.and_then(|kept| kept.map(&level.layer.projection));
            let is_kept = |place| before.is_some_and(|before| before.has_page(place));
            layer_of_number[number] = record.add([level.map, level.level], &pages, is_kept);
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
        let numbers: Vec<_> = numbers.into_iter().map(of_pixel).collect();
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
        self.note(&record, bias);
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
