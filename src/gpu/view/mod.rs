//! What a method sees of a frame, and what it gives back.

mod rays;
mod shadows;

use crate::camera::Camera;
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::fits::receivers::{Corners, OutlinePoints, ReceiverQueries, Setting};
use crate::fits::samples::SampledReceivers;
use crate::gpu::facts::FactsOfPasses;
use crate::gpu::passes::bias::BiasRule;
use crate::gpu::passes::boundary;
use crate::gpu::passes::image_tiles::{self, InitialImage};
use crate::gpu::passes::importance_map::{self, Factors, ImportanceMap};
use crate::gpu::passes::inputs::{ImageTiles, Receivers};
use crate::gpu::passes::lookup::Comparison;
use crate::gpu::passes::outline;
use crate::gpu::passes::rasterize::{RasterJob, Rasterization};
use crate::gpu::passes::receivers::{self, Bounds};
use crate::gpu::passes::warp_map::WarpMap;
use crate::gpu::passes::{forward_importance, samples, shadow_edge, shadow_map, visibility};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{ReadResults, Recording, Source};
use crate::gpu::unsure::{UnsureRead, UnsureTests};
use crate::importance::{EdgeBias, Grid, Importance};
use crate::light::Light;
use crate::region::Region;
use crate::scene::Scene;
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
}

/// Pixels, where a method counts them.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReceiverCounts {
    /// Those that see a surface.
    pub seen: u32,
    /// Those whose surface faces the light; one at the border of two layers is counted in both.
    pub facing: u32,
}

/// What the light sees of a layer: depths and triangles, and a factor for each texel.
pub struct Analysed {
    pub layer: Layer,
    texels: PooledBuffer,
    pub edges: Option<Grid<PooledBuffer>>,
}

/// A layer and its warp, before it has texels.
pub struct WarpedLayer {
    pub layer: Layer,
    pub warp: Option<WarpMap>,
    /// What the warp was made from.
    pub importance: Option<ImportanceMap>,
}

impl From<Layer> for WarpedLayer {
    fn from(layer: Layer) -> Self {
        Self {
            layer,
            warp: None,
            importance: None,
        }
    }
}

/// How a shadow map is rasterized and looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSettings {
    pub rasterization: Rasterization,
    pub lookup: Comparison,
    pub bias: BiasRule,
}

impl MapSettings {
    /// For a first pass that asks where shadows are: each receiver lit or not.
    pub fn without_filter(self) -> Self {
        Self {
            lookup: Comparison {
                filter: None,
                ..self.lookup
            },
            ..self
        }
    }
}

/// A layer that has texels.
pub struct RasterizedLayer {
    pub plan: WarpedLayer,
    pub comparison: Comparison,
    pub texels: PooledBuffer,
}

/// What a method recorded: the visibility image and the layers it was looked up in. A layer that no
/// receiver needs is not there.
pub struct Recorded {
    pub visibility: PooledBuffer,
    pub layers: Vec<RasterizedLayer>,
}

/// What a frame counts.
#[derive(Debug, Clone, Default)]
pub struct Stats {
    pub triangles: usize,
    pub degenerate_triangles: usize,
    /// Of passes, by their labels.
    pub facts: FactsOfPasses,
    /// Where a method counts them.
    pub receivers: Option<ReceiverCounts>,
    /// Stages that this frame did not need.
    pub skipped: Vec<&'static str>,
    pub layers: usize,
    /// Layers that no receiver fell in.
    pub skipped_layers: usize,
    /// What the method measured, by name.
    pub measures: Vec<(&'static str, f64)>,
}

impl Stats {
    pub fn new(scene: &Scene) -> Self {
        Self {
            triangles: scene.triangles().len(),
            degenerate_triangles: scene.degenerate_count(),
            ..Self::default()
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

    /// The importance of the cells of a layer's map.
    pub fn importance_map(
        &mut self,
        layer: &Layer,
        cells: u32,
        importance: Importance,
        factors: Factors,
        warp: Option<&WarpMap>,
    ) -> Result<ImportanceMap> {
        let Layer { projection, region } = layer;
        let tiles = self.image_tiles(region)?;
        let seen = self.seen.within(region, tiles.as_deref());
        let frame = &mut self.frame;
        importance_map::importance_map(frame, seen, projection, cells, importance, factors, warp)
    }

    /// What the light sees of a layer.
    pub fn depth_image(&mut self, layer: Layer) -> Result<Analysed> {
        let texels = shadow_map::shadow_map(
            &mut self.frame,
            self.seen.scene,
            RasterJob::plain(&layer.projection),
        )?;
        Ok(Analysed {
            layer,
            texels,
            edges: None,
        })
    }

    /// Finds the shadow edges of a depth image.
    pub fn shadow_edges(
        &mut self,
        analysed: &mut Analysed,
        bias: EdgeBias,
        floor: f64,
    ) -> Result<()> {
        let projection = &analysed.layer.projection;
        let (frame, scene, texels) = (&mut self.frame, self.seen.scene, &analysed.texels);
        let edges = shadow_edge::shadow_edge(frame, scene, projection, texels, bias, floor)?;
        analysed.edges = Some(edges);
        Ok(())
    }

    /// The importance of the cells of a layer's map, from what the light sees.
    pub fn forward_importance(
        &mut self,
        analysed: &Analysed,
        cells: u32,
        factors: Factors,
    ) -> Result<ImportanceMap> {
        let Analysed { layer, texels, .. } = analysed;
        let Layer { projection, region } = layer;
        let seen = self.seen.within(region, None);
        let frame = &mut self.frame;
        forward_importance::forward_importance(frame, seen, projection, texels, cells, factors)
    }

    /// Weights of the receivers near the boundaries of shadows.
    pub fn boundary(
        &mut self,
        visibility: &wgpu::Buffer,
        weight: f64,
    ) -> Result<Grid<PooledBuffer>> {
        boundary::boundary(&mut self.frame, self.seen, visibility, weight)
    }

    /// Receivers of about `resolution` pixels along the longer side of the image. Submits what was
    /// recorded so far.
    pub fn sampled_image(&mut self, resolution: u32) -> Result<SampledImage> {
        let side = self.camera.width.max(self.camera.height);
        let stride = ((side + resolution / 2) / resolution).max(1);
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
        Ok(SampledImage {
            receivers: SampledReceivers::new(self.scene, self.light, camera, &triangles),
            keys,
        })
    }

    /// What maps answer for the samples, as in a visibility image. Submits what was recorded so far.
    pub fn sampled_visibility(
        &mut self,
        samples: &SampledImage,
        map: MapSettings,
        layers: Vec<Layer>,
    ) -> Result<Vec<f32>> {
        let plans = layers.into_iter().map(WarpedLayer::from).collect();
        let recorded = self.answer(Pixels::Samples(samples), map, plans)?;
        let count = samples.receivers.camera.pixel_count();
        let read = self
            .frame
            .read::<f32>(Source::Taken(recorded.visibility), count)?;
        self.submit()?.take(&read)
    }

    /// Names a stage that this frame does not need.
    pub fn skip(&mut self, stage: &'static str) {
        self.stats.skipped.push(stage);
    }

    /// Adds a number that the method found to the statistics, by its name.
    pub fn measure(&mut self, name: &'static str, value: f64) {
        self.stats.measures.push((name, value));
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

    /// Receivers that face the light in all layers, once their bounds were asked for.
    pub fn facing_count(&self) -> u32 {
        self.stats.receivers.map_or(0, |counts| counts.facing)
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
        Ok(self.sampled_image(resolution)?.receivers)
    }

    fn leaves_out_empty_layers(&self) -> bool {
        self.culls()
    }

    fn skip_layer(&mut self) {
        self.stats.skipped_layers += 1;
    }
}

/// Some pixels of the image, on the device and on the CPU: a coarse camera's image.
pub struct SampledImage {
    pub receivers: SampledReceivers,
    keys: PooledBuffer,
}

/// Which pixels are answered.
#[derive(Clone, Copy)]
enum Pixels<'a> {
    All,
    Samples(&'a SampledImage),
}
