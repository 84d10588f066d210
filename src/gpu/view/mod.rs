//! What a method sees of a frame, and what it gives back.

mod pages;
mod rays;
mod shadows;
mod verbs;

use crate::camera::Camera;
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::fits::receivers::{Corners, OutlinePoints, ReceiverQueries, Setting};
use crate::fits::samples::{SampledReceivers, stride};
use crate::gpu::passes::image_tiles::{self, InitialImage};
use crate::gpu::passes::inputs::{ImageTiles, Receivers};
use crate::gpu::passes::outline;
use crate::gpu::passes::receivers::{self, Bounds};
use crate::gpu::passes::warp_map::WarpMap;
use crate::gpu::passes::{samples, visibility};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{ReadResults, Recording, Source};
use crate::gpu::unsure::{UnsureRead, UnsureTests};
use crate::light::Light;
use crate::map_settings::Comparison;
use crate::paging::PagedMaps;
use crate::region::Region;
use crate::scene::Scene;
use crate::stats::{ReceiverCounts, Stats};
use crate::verbs::WarpedLayer;
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// A frame in the making: the passes, bound to the scene, camera and light.
pub struct View<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub light: &'a Light,
    frame: Recording,
    /// What the camera sees, wherever it is.
    seen: Receivers<'a>,
    /// Whether texels that no receiver looks at are wanted, too.
    draws_whole_maps: bool,
    stats: Stats,
    begun: Option<InitialImage>,
    /// What float32 left open, once something asked.
    unsure: Option<UnsureTests>,
    /// Whether the method leaves open what float32 does not know.
    leaves_open: bool,
    /// The last samples' camera, and what it sees.
    sampled: Option<(Camera, PooledBuffer)>,
}

/// What the light sees of a layer: depths and triangles.
pub struct Analysed {
    layer: Layer,
    texels: PooledBuffer,
}

/// A layer before it has texels.
pub type PlannedLayer = WarpedLayer<WarpMap, PooledBuffer>;

/// A layer that has texels.
pub struct RasterizedLayer {
    pub plan: PlannedLayer,
    pub comparison: Comparison,
    pub texels: PooledBuffer,
    pub texel_count: usize,
}

/// What was drawn of maps in pages, and what pixels look at.
pub struct RecordedPages {
    /// But for what each pixel looks into.
    pub maps: PagedMaps,
    /// Of each pixel the number of its level, from 1 on; zero where it needs none.
    pub level_of_pixel: PooledBuffer,
    /// The layer of each level.
    pub layer_of_level: Vec<u8>,
}

/// What a method recorded: the visibility image and the layers it was looked up in. A layer that no
/// receiver needs is not there.
pub struct Recorded {
    pub visibility: PooledBuffer,
    pub layers: Vec<RasterizedLayer>,
    pub pages: Option<RecordedPages>,
}

impl Recorded {
    pub fn without_layers(visibility: PooledBuffer) -> Self {
        Self {
            visibility,
            layers: vec![],
            pages: None,
        }
    }
}

impl<'a> View<'a> {
    pub fn new(
        frame: Recording,
        seen: Receivers<'a>,
        scene: &'a Scene,
        draws_whole_maps: bool,
    ) -> Self {
        Self {
            scene,
            camera: seen.camera,
            light: seen.light,
            frame,
            seen,
            draws_whole_maps,
            stats: Stats::new(scene),
            begun: None,
            unsure: None,
            leaves_open: false,
            sampled: None,
        }
    }

    /// The visibility image before any caster, and its tiles.
    fn begun(&mut self) -> Result<&mut InitialImage> {
        let begun = match self.begun.take() {
            Some(begun) => begun,
            None => {
                let unsure = self.take_unsure()?;
                let begun = image_tiles::begin(&mut self.frame, self.seen, &unsure)?;
                self.unsure = Some(unsure);
                begun
            }
        };
        Ok(self.begun.insert(begun))
    }

    /// The image itself, once for each time that it is answered.
    fn begun_image(&mut self) -> Result<PooledBuffer> {
        if let Some(image) = self.begun()?.visibility.take() {
            return Ok(image);
        }
        self.begun = None;
        let image = self.begun()?.visibility.take();
        Ok(image.expect("nobody took it yet"))
    }

    /// The tiles of the image that may hold receivers of a region; `None`: all of them.
    fn image_tiles(&mut self, region: &Region) -> Result<Option<Arc<ImageTiles>>> {
        if !self.culls() {
            return Ok(None);
        }
        let seen = self.seen.within(region, None);
        self.begun()?;
        let begun = self.begun.as_mut().expect("just begun");
        begun.tiles(&mut self.frame, seen)
    }

    fn receiver_bounds(&mut self, layers: &[Layer]) -> Result<Vec<Option<Corners>>> {
        let mut reads = Vec::new();
        for Layer { projection, region } in layers {
            let tiles = self.image_tiles(region)?;
            let seen = self.seen.within(region, tiles.as_deref());
            reads.push(receivers::receivers(&mut self.frame, seen, projection)?);
        }
        let seen = self.begun()?.seen.clone();
        let seen = self.frame.read(Source::Kept(&seen), 1)?;
        let results = self.submit()?;
        let mut counts = ReceiverCounts {
            seen: results.take(&seen)?[0],
            facing: 0,
        };
        let mut boxes = Vec::new();
        for (read, Layer { projection, .. }) in reads.iter().zip(layers) {
            let bounds: Bounds = results.take(read)?[0];
            counts.facing += bounds.facing;
            let in_world = DVec3::new(1.0, 1.0, projection.unit().recip());
            let corners = bounds.corners();
            boxes.push(corners.map(|(low, high)| (low * in_world, high * in_world)));
        }
        self.stats.receivers = Some(counts);
        Ok(boxes)
    }

    /// Receivers of about `resolution` pixels along the longer side of the image. Submits what was
    /// recorded so far.
    fn sampled_image(&mut self, resolution: u32) -> Result<SampledReceivers> {
        let stride = stride(self.camera, resolution);
        let buffer = self.seen.visibility_buffer;
        let (camera, keys) = samples::samples(&mut self.frame, self.camera, buffer, stride)?;
        let read = self
            .frame
            .read::<u64>(Source::Kept(&keys), camera.pixel_count())?;
        let triangles = self.submit()?.take(&read)?;
        let triangles: Vec<_> = triangles
            .into_iter()
            .map(visibility::triangle_from_key)
            .collect();
        self.sampled = Some((camera.clone(), keys));
        Ok(SampledReceivers::new(
            self.scene, self.light, camera, &triangles,
        ))
    }

    /// Names a stage that this frame does not need.
    pub fn skip(&mut self, stage: &'static str) {
        self.stats.skipped.push(stage);
    }

    /// Whether what cannot change the picture is left out.
    pub(crate) fn culls(&self) -> bool {
        self.frame.culls
    }

    /// The frame that is being recorded.
    pub(crate) fn frame(&mut self) -> &mut Recording {
        &mut self.frame
    }

    pub(crate) fn submit(&mut self) -> Result<ReadResults> {
        self.frame.submit()
    }

    /// The list of what float32 leaves open, to be given back.
    fn take_unsure(&mut self) -> Result<UnsureTests> {
        match self.unsure.take() {
            Some(unsure) => Ok(unsure),
            None => UnsureTests::new(&mut self.frame, &self.seen.scene.room),
        }
    }

    /// Reads what float32 left open.
    pub(crate) fn read_unsure(&mut self) -> Result<Option<UnsureRead>> {
        let has_rim = self.light.cone().is_some();
        let unsure = self.unsure.take().filter(|_| has_rim || self.leaves_open);
        let read = unsure.map(|unsure| unsure.read(&mut self.frame));
        read.transpose()
    }

    /// The triangles that the light is at, where the method does not know of them.
    pub(crate) fn casters_at_light(&self) -> &'a [u32] {
        match self.leaves_open {
            true => &[],
            false => &self.seen.light_sides.at_light,
        }
    }

    pub(crate) fn finish(self) -> (Recording, Stats) {
        (self.frame, self.stats)
    }
}

impl<'a> ReceiverQueries<'a> for View<'a> {
    fn setting(&self) -> Setting<'a> {
        Setting {
            scene: self.scene,
            camera: self.camera,
            light: self.light,
        }
    }

    fn bounds(&mut self, layers: &[Layer]) -> Result<Vec<Option<Corners>>> {
        self.receiver_bounds(layers)
    }

    fn outline(&mut self, layer: &Layer, points: OutlinePoints) -> Result<Vec<DVec2>> {
        let Layer { projection, region } = layer;
        let seen = self.seen.within(region, None);
        let points = outline::outline(&mut self.frame, seen, projection, points)?;
        let results = self.submit()?;
        Ok(outline::found(results.take(&points)?))
    }

    fn samples(&mut self, resolution: u32) -> Result<SampledReceivers> {
        self.sampled_image(resolution)
    }

    fn leaves_out_empty_layers(&self) -> bool {
        self.culls()
    }

    fn skip_layer(&mut self) {
        self.stats.skipped_layers += 1;
    }
}

/// Which pixels are answered.
#[derive(Clone, Copy)]
enum Pixels<'a> {
    All,
    /// A coarse camera's, and its visibility buffer.
    Samples(&'a Camera, &'a PooledBuffer),
}
