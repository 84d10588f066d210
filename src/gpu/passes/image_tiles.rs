//! Pass "image tiles": the visibility image before any caster, and its tiles that may hold receivers of a layer,
//! which the passes over them look at alone.

use super::inputs::{BYTES_OF_CHOICE, CHOICES, IMAGE_TILE, ImageTiles, Receivers};
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::unsure::UnsureTests;
use crate::region::Region;
use crate::stats::Fact;
use std::sync::Arc;

pub const LABEL: &str = "image tiles";

/// An image that was begun, on the device.
pub struct InitialImage {
    /// Per pixel, float32: 1 where it faces the light, else 0, NaN where no surface is seen. Whoever answers
    /// takes it.
    pub visibility: Option<PooledBuffer>,
    /// How many pixels see a surface.
    pub seen: PooledBuffer,
    /// Nearest and farthest receiver of each tile that faces the light.
    depth_ranges: PooledBuffer,
    /// Of each region that was asked for.
    listed: Vec<(Region, Arc<ImageTiles>)>,
}

/// Columns and rows of tiles.
fn grid(seen: &Receivers) -> [u32; 2] {
    [
        seen.camera.width.div_ceil(IMAGE_TILE[0]),
        seen.camera.height.div_ceil(IMAGE_TILE[1]),
    ]
}

/// Records the first step, and lists the pixels at the rim of the light's cone. `seen` has all receivers of the light.
pub fn begin(frame: &mut Recording, seen: Receivers, unsure: &UnsureTests) -> Result<InitialImage> {
    let [columns, rows] = grid(&seen);
    let depth_ranges = frame.storage("depth ranges", 8 * u64::from(columns) * u64::from(rows))?;
    let count = frame.storage("pixels that see a surface", 4)?;
    let visibility = frame.storage("visibility image", 4 * seen.camera.pixel_count() as u64)?;
    frame.clear(&depth_ranges);
    frame.clear(&count);
    let kernel = Kernel::new("image_tiles")
        .entry("begin")
        .receivers(seen, &seen.camera_uniform())
        .bind(0, &depth_ranges)
        .bind(4, &count)
        .bind(6, &visibility)
        .bind(19, &unsure.list);
    frame.pass(LABEL, &[kernel.dispatch(Groups::Grid(columns, rows))]);
    Ok(InitialImage {
        visibility: Some(visibility),
        seen: count,
        depth_ranges,
        listed: Vec::new(),
    })
}

impl InitialImage {
    /// Those of the layer's region; `None`: the device takes no workgroup for each of so many.
    pub fn tiles(
        &mut self,
        frame: &mut Recording,
        seen: Receivers,
    ) -> Result<Option<Arc<ImageTiles>>> {
        if let Some((_, tiles)) = self.listed.iter().find(|(of, _)| of == seen.region) {
            return Ok(Some(tiles.clone()));
        }
        let [columns, rows] = grid(&seen);
        let count = u64::from(columns) * u64::from(rows);
        if count > u64::from(frame.gpu.limits.max_compute_workgroups_per_dimension) {
            return Ok(None);
        }
        let tiles = Arc::new(self.list(frame, seen, count)?);
        self.listed.push((seen.region.clone(), tiles.clone()));
        Ok(Some(tiles))
    }

    fn list(&self, frame: &mut Recording, seen: Receivers, count: u64) -> Result<ImageTiles> {
        let counters = frame.storage("counters", 8)?;
        let tiles = ImageTiles {
            listed: frame.storage(LABEL, 4 * count)?,
            groups: frame.storage("groups of tiles", BYTES_OF_CHOICE * CHOICES)?,
        };
        let mut receivers = seen.camera_uniform();
        receivers.rounding = seen.slack() as f32;
        let kernel = Kernel::new("image_tiles")
            .entry("list")
            .receivers_uniform(seen, &receivers)
            .bind(1, &self.depth_ranges)
            .bind(2, &tiles.listed)
            .bind(3, &tiles.groups)
            .bind(5, &counters);
        frame.pass(LABEL, &[kernel.dispatch(Groups::ONE)]);
        frame.count(LABEL, counters, 2, |_, counters| {
            let (looked_at, tiles) = (counters[0], counters[1]);
            Ok(vec![
                Fact::sum("looked_at", looked_at),
                Fact::sum("tiles", tiles),
            ])
        })?;
        Ok(tiles)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu;
    use crate::gpu::passes::inputs::ReceiversUniform;
    use crate::gpu::recording::Source;
    use bytemuck::Zeroable;

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn the_list_ends_with_the_numbers_of_workgroups() {
        const ROOM: usize = 1024;
        const UNTOUCHED: u32 = 0xaaaa_aaaa;
        let gpu = gpu::gpu("").unwrap();
        let mut frame = Recording::together(&gpu, 1, true).remove(0);
        let buffer = |bytes| frame.storage("list of no tiles", bytes).unwrap();
        let (ranges, listed, counters, groups) =
            (buffer(8), buffer(4), buffer(8), buffer(4 * ROOM as u64));
        let marks = [UNTOUCHED; ROOM];
        gpu.queue
            .write_buffer(&groups, 0, bytemuck::cast_slice(&marks));
        // An image without pixels.
        let kernel = Kernel::new("image_tiles").entry("list");
        let kernel = kernel.uniform(20, &ReceiversUniform::zeroed());
        let kernel = kernel.constant("is_orthographic", false).bind(1, &ranges);
        let kernel = kernel.bind(2, &listed).bind(3, &groups).bind(5, &counters);
        frame.pass(LABEL, &[kernel.dispatch(Groups::ONE)]);
        let read = frame.read::<u32>(Source::Taken(groups), ROOM).unwrap();
        let found = frame.submit().unwrap().take(&read).unwrap();
        let expected = [32, 16, 8, 4, 2, 1].map(|rows| [0, rows, 1]);
        let end = (CHOICES * BYTES_OF_CHOICE) as usize / 4;
        assert_eq!(found[..end], *expected.as_flattened());
        assert!(found[end..].iter().all(|&word| word == UNTOUCHED));
    }
}
