//! Shadows by maps, and by lists of receivers.

use super::{Pixels, PlannedLayer, RasterizedLayer, Recorded, View};
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::gpu::passes::inputs::Receivers;
use crate::gpu::passes::light_grid::LightGrid;
use crate::gpu::passes::lookup::{self, LookupInput};
use crate::gpu::passes::rasterize::RasterJob;
use crate::gpu::passes::receiver_lists::RECEIVER_BYTES;
use crate::gpu::passes::{
    caster_tests, image_tiles, moments, receiver_lists, receiver_tiles, shadow_map,
};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::unsure::UnsureTests;
use crate::map_settings::{Comparison, MapSettings, position_rounding};
use crate::map_size::MapSize;

/// Texels along each side of the map that settles receivers before they are listed, at most.
const MAX_MAP_TEXELS: u32 = 1024;

impl View<'_> {
    /// The last two steps of every method with maps: casters into each layer, receivers against it.
    /// Without a layer nothing is lit.
    pub(super) fn mapped_shadows(
        &mut self,
        map: MapSettings,
        plans: Vec<PlannedLayer>,
    ) -> Result<Recorded> {
        if plans.is_empty() {
            return self.all_in_shadow();
        }
        self.answer(Pixels::All, map, plans)
    }

    /// The same for some of the pixels; there is a layer.
    pub(super) fn answer(
        &mut self,
        pixels: Pixels,
        map: MapSettings,
        plans: Vec<PlannedLayer>,
    ) -> Result<Recorded> {
        let seen = match pixels {
            Pixels::All => self.seen,
            Pixels::Samples(camera, visibility_buffer) => Receivers {
                camera,
                visibility_buffer,
                ..self.seen
            },
        };
        // Receivers of no layer, which a method left out because no sample needed them, are lit.
        let visibility = match pixels {
            Pixels::All => self.begun_image()?,
            Pixels::Samples(..) => {
                // The rim of a cone in a few samples is nobody's concern.
                let unsure = UnsureTests::new(&mut self.frame, &self.seen.scene.room)?;
                let begun = image_tiles::begin(&mut self.frame, seen, &unsure)?;
                begun.visibility.expect("nobody took it yet")
            }
        };
        let mut layers = Vec::new();
        for plan in plans {
            let Layer { projection, region } = &plan.layer;
            let tiles = match pixels {
                Pixels::All => self.image_tiles(region)?,
                Pixels::Samples(..) => None,
            };
            let seen = seen.within(region, tiles.as_deref());
            let whole = RasterJob {
                warp: plan.warp.as_ref(),
                target: map.lookup.target(),
                rasterization: map.rasterization,
                ..RasterJob::plain(projection)
            };
            let rounding = position_rounding(projection, self.camera.eye);
            let tiles = self.receiver_tiles(seen, whole, map.lookup, rounding)?;
            let drawn = RasterJob {
                receiver_tiles: tiles.as_deref(),
                ..whole
            };
            let texels = shadow_map::shadow_map(&mut self.frame, self.seen.scene, drawn)?;
            let looked = LookupInput {
                projection,
                warp: plan.warp.as_ref(),
                texels: &texels,
                comparison: map.lookup,
                bias: map.bias.depth_bias(projection, rounding),
                rounding,
                pages: None,
            };
            let frame = &mut self.frame;
            match map.lookup.moments {
                None => lookup::lookup(frame, seen, looked, &visibility),
                Some(filter) => {
                    let warp = plan.warp.as_ref();
                    let moments =
                        moments::moments(frame, seen.scene, projection, warp, &texels, filter)?;
                    lookup::lookup_moments(frame, seen, looked, &moments, &visibility);
                }
            }
            layers.push(RasterizedLayer {
                comparison: map.lookup,
                texels,
                texel_count: plan.layer.projection.texel_count(),
                plan,
            });
        }
        Ok(Recorded {
            visibility,
            layers,
            pages: None,
        })
    }

    /// The tiles of a map that need to be drawn; `None`: all of it, because somebody wants to see it or it is
    /// so small that finding them takes longer.
    fn receiver_tiles(
        &mut self,
        seen: Receivers,
        map: RasterJob,
        lookup: Comparison,
        rounding: f64,
    ) -> Result<Option<PooledBuffer>> {
        let is_small = map.projection.texel_count() < seen.camera.pixel_count();
        let looks_far = lookup.looks_far();
        if self.draws_whole_maps || is_small || looks_far || !self.culls() {
            return Ok(None);
        }
        let (frame, reach) = (&mut self.frame, lookup.reach);
        receiver_tiles::receiver_tiles(frame, seen, map.projection, map.warp, reach, rounding)
            .map(Some)
    }

    /// The visibility image by testing casters against receivers that are listed in the texels of each
    /// layer. Without a layer nothing is lit.
    pub(super) fn listed_shadows(&mut self, plans: &[PlannedLayer]) -> Result<Recorded> {
        if plans.is_empty() {
            return self.all_in_shadow();
        }
        let visibility = self.begun_image()?;
        let unsure = self.take_unsure()?;
        // As many rows of the image as one binding has room for.
        let row_bytes = RECEIVER_BYTES * u64::from(self.camera.width);
        let rows = (self.frame.gpu.largest_storage() / row_bytes).max(1);
        let rows = rows.min(u64::from(self.camera.height)) as u32;
        for plan in plans {
            let Layer { projection, region } = &plan.layer;
            let warp = plan.warp.as_ref();
            // Pieces of the image have none.
            let tiles = match rows == self.camera.height {
                true => self.image_tiles(region)?,
                false => None,
            };
            let seen = self.seen.within(region, tiles.as_deref());
            // The nearest casters, which settle most receivers that are in shadow.
            let map = projection.with_size(MapSize::square(projection.width.min(MAX_MAP_TEXELS)));
            let texels =
                shadow_map::shadow_map(&mut self.frame, self.seen.scene, RasterJob::plain(&map))?;
            let grid = LightGrid::new(seen.scene, self.camera, projection, map.width);
            for first_row in (0..self.camera.height).step_by(rows as usize) {
                let grid = grid.of_rows(first_row..self.camera.height.min(first_row + rows));
                let frame = &mut self.frame;
                let lists =
                    receiver_lists::receiver_lists(frame, seen, &grid, warp, &texels, &visibility)?;
                caster_tests::caster_tests(frame, seen, &grid, warp, &lists, &visibility, &unsure)?;
            }
        }
        self.unsure = Some(unsure);
        self.leaves_open = true;
        Ok(Recorded::without_layers(visibility))
    }

    /// The frame where whatever is seen faces away from the light: there is nothing to look up.
    pub(super) fn all_in_shadow(&mut self) -> Result<Recorded> {
        self.skip(shadow_map::LABEL);
        let visibility = self.begun_image()?;
        Ok(Recorded::without_layers(visibility))
    }
}
