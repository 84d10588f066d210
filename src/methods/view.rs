//! What a method sees of a frame, and what it gives back.

use super::parameters::{MapParameters, position_rounding};
use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::gpu::acceleration::{self, AccelerationStructure};
use crate::gpu::frame::{Frame, ReadResults, Source};
use crate::gpu::passes::boundary::{self, BoundaryWeights};
use crate::gpu::passes::image_tiles::{self, InitialImage};
use crate::gpu::passes::importance_map::{self, Factors, Importance, ImportanceMap};
use crate::gpu::passes::inputs::ImageTiles;
use crate::gpu::passes::light_grid::LightGrid;
use crate::gpu::passes::lookup::{self, Comparison, LookupInput};
use crate::gpu::passes::outline::{self, Points};
use crate::gpu::passes::rasterize::{RasterJob, Rasterization, Target};
use crate::gpu::passes::receiver_lists::RECEIVER_BYTES;
use crate::gpu::passes::receivers::{self, Bounds};
use crate::gpu::passes::shadow_edge::EdgeBias;
use crate::gpu::passes::warp_map::WarpMap;
use crate::gpu::passes::work_items::{Counters, HadRoom, PendingWork};
use crate::gpu::passes::{
    FactsOfPasses, Inputs, PendingFacts, Receivers, caster_tests, forward_importance, ray_queries,
    receiver_lists, receiver_tiles, samples, shadow_edge, shadow_map, shadow_rays, shadow_volumes,
    visibility,
};
use crate::gpu::pool::PooledBuffer;
use crate::light::Light;
use crate::projection::Projection;
use crate::reference::surface;
use crate::region::Region;
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use std::sync::Arc;
use std::time::Instant;

/// Texels along each side of the map that settles receivers before they are listed, at most.
const MAX_MAP_TEXELS: u32 = 1024;

/// A frame in the making: the passes, bound to the scene, camera and light.
pub struct View<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub light: &'a Light,
    frame: Frame,
    inputs: Inputs<'a>,
    visibility_buffer: &'a wgpu::Buffer,
    /// Whether texels that no receiver looks at are wanted, too.
    draws_whole_maps: bool,
    /// What the next submission counts.
    pending_work: Vec<PendingWork>,
    pending_facts: Vec<PendingFacts>,
    counters: Vec<(HadRoom, Counters)>,
    stats: Stats,
    begun: Option<InitialImage>,
}

/// Pixels, where a method counts them.
#[derive(Debug, Clone, Copy, Default)]
pub struct ReceiverCounts {
    /// Those that see a surface.
    pub seen: u32,
    /// Those whose surface faces the light; one at the border of two layers is counted in both.
    pub facing: u32,
}

/// Where a layer of a shadow map lies: which receivers it is for, and where it takes them.
#[derive(Debug, Clone, PartialEq)]
pub struct Fitted {
    pub projection: Projection,
    pub region: Region,
}

impl Fitted {
    /// A layer for every receiver.
    pub fn everywhere(projection: Projection) -> Self {
        Self {
            projection,
            region: Region::EVERYWHERE,
        }
    }

    /// The same layer in another number of texels along each side.
    pub fn with_resolution(&self, resolution: u32) -> Self {
        Self {
            projection: self.projection.with_resolution(resolution),
            region: self.region.clone(),
        }
    }
}

/// What the light sees of a layer: depths and triangles, and a factor for each texel.
pub struct Analysed {
    pub fitted: Fitted,
    texels: PooledBuffer,
    pub edges: Option<PooledBuffer>,
}

/// What makes a layer, before it has texels.
pub struct Plan {
    pub fitted: Fitted,
    pub warp: Option<WarpMap>,
    /// What the warp was made from.
    pub importance: Option<ImportanceMap>,
}

impl From<Fitted> for Plan {
    fn from(fitted: Fitted) -> Self {
        Self {
            fitted,
            warp: None,
            importance: None,
        }
    }
}

/// A layer of a shadow map.
pub struct Layer {
    pub plan: Plan,
    pub comparison: Comparison,
    pub texels: PooledBuffer,
}

/// What a method recorded: the visibility image and the layers it was looked up in. A layer that no
/// receiver needs is not there.
pub struct Recorded {
    pub visibility: PooledBuffer,
    pub layers: Vec<Layer>,
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

impl<'a> View<'a> {
    pub fn new(
        frame: Frame,
        inputs: Inputs<'a>,
        scene: &'a Scene,
        light: &'a Light,
        visibility_buffer: &'a wgpu::Buffer,
        draws_whole_maps: bool,
    ) -> Self {
        Self {
            scene,
            camera: inputs.camera,
            light,
            frame,
            inputs,
            visibility_buffer,
            draws_whole_maps,
            pending_work: Vec::new(),
            pending_facts: Vec::new(),
            counters: Vec::new(),
            stats: Stats {
                triangles: scene.triangles().len(),
                degenerate_triangles: scene.degenerate_count(),
                ..Stats::default()
            },
            begun: None,
        }
    }

    /// The visibility image before any caster, and its tiles.
    fn begun(&mut self) -> Result<&mut InitialImage> {
        let begun = match self.begun.take() {
            Some(begun) => begun,
            None => {
                let region = &Region::EVERYWHERE;
                let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
                image_tiles::begin(&mut self.frame, seen)?
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
        self.begun()?;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (begun, frame) = (&mut self.begun, &mut self.frame);
        let begun = begun.as_mut().expect("just begun");
        begun.tiles(frame, seen, &mut self.pending_facts)
    }

    /// The light's position; an error where it is at infinity, which the method is not made for.
    pub fn light_position(&self, method: &str) -> Result<DVec3> {
        self.light.position().ok_or_else(|| {
            Error::Value(format!(
                "method {method:?} needs a light with a position, got a {} light",
                self.light.kind()
            ))
        })
    }

    /// The boxes around the receivers of each layer that face the light: least and greatest corner, (x, y)
    /// in texels from the projection's axis and depth in world units. `None` where there are none. Submits
    /// what was recorded so far.
    pub fn receiver_bounds(&mut self, layers: &[Fitted]) -> Result<Vec<Option<(DVec3, DVec3)>>> {
        let mut reads = Vec::new();
        for Fitted { projection, region } in layers {
            let tiles = self.image_tiles(region)?;
            let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region)
                .within(tiles.as_deref());
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
        for (read, Fitted { projection, .. }) in reads.iter().zip(layers) {
            let bounds: Bounds = results.take(read)?[0];
            counts.facing += bounds.facing;
            let in_world = DVec3::new(1.0, 1.0, projection.unit().recip());
            let corners = bounds.corners();
            boxes.push(corners.map(|(low, high)| (low * in_world, high * in_world)));
        }
        self.stats.receivers = Some(counts);
        Ok(boxes)
    }

    /// Points of the receivers of a layer that face the light, in texels from the projection's axis.
    /// Submits what was recorded so far.
    pub fn outline(&mut self, layer: &Fitted, points: Points) -> Result<Vec<DVec2>> {
        let Fitted { projection, region } = layer;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let points = outline::outline(&mut self.frame, seen, projection, points)?;
        let results = self.submit()?;
        Ok(outline::found(results.take(&points)?))
    }

    /// The importance of the cells of a layer's map.
    pub fn importance_map(
        &mut self,
        layer: &Fitted,
        cells: u32,
        importance: Importance,
        factors: Factors,
        warp: Option<&WarpMap>,
    ) -> Result<ImportanceMap> {
        let Fitted { projection, region } = layer;
        let tiles = self.image_tiles(region)?;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region)
            .within(tiles.as_deref());
        let frame = &mut self.frame;
        importance_map::importance_map(frame, seen, projection, cells, importance, factors, warp)
    }

    /// What the light sees of a layer.
    pub fn depth_image(&mut self, fitted: Fitted) -> Result<Analysed> {
        let projection = &fitted.projection;
        let drawn = plain_map(projection);
        let rasterized = shadow_map::shadow_map(&mut self.frame, self.inputs, drawn)?;
        self.pending_work.push(rasterized.work);
        Ok(Analysed {
            fitted,
            texels: rasterized.texels,
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
        let projection = &analysed.fitted.projection;
        let (frame, texels) = (&mut self.frame, &analysed.texels);
        let edges = shadow_edge::shadow_edge(frame, self.inputs, projection, texels, bias, floor)?;
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
        let Analysed { fitted, texels, .. } = analysed;
        let Fitted { projection, region } = fitted;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let frame = &mut self.frame;
        forward_importance::forward_importance(frame, seen, projection, texels, cells, factors)
    }

    /// Weights of the receivers near the boundaries of shadows.
    pub fn boundary(&mut self, visibility: &wgpu::Buffer, weight: f64) -> Result<BoundaryWeights> {
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        boundary::boundary(&mut self.frame, seen, visibility, weight)
    }

    /// The last two steps of every method with maps: casters into each layer, receivers against it.
    /// Without a layer nothing is lit.
    pub fn shadows<P: Into<Plan>>(
        &mut self,
        map: &MapParameters,
        layers: impl IntoIterator<Item = P>,
    ) -> Result<Recorded> {
        let plans: Vec<_> = layers.into_iter().map(P::into).collect();
        if plans.is_empty() {
            return self.all_in_shadow();
        }
        self.answer(self.inputs, self.visibility_buffer, map, plans)
    }

    /// The same for the receivers of any visibility buffer; there is a layer.
    fn answer(
        &mut self,
        inputs: Inputs,
        visibility_buffer: &wgpu::Buffer,
        map: &MapParameters,
        plans: Vec<Plan>,
    ) -> Result<Recorded> {
        let is_image = std::ptr::eq(visibility_buffer, self.visibility_buffer);
        // Receivers of no layer, which a method left out because no sample needed them, are lit.
        let visibility = match is_image {
            true => self.begun_image()?,
            false => {
                let region = &Region::EVERYWHERE;
                let seen = receivers_in(&inputs, visibility_buffer, self.light, region);
                let begun = image_tiles::begin(&mut self.frame, seen)?;
                begun.visibility.expect("nobody took it yet")
            }
        };
        let mut layers = Vec::new();
        for plan in plans {
            let Fitted { projection, region } = &plan.fitted;
            let tiles = match is_image {
                true => self.image_tiles(region)?,
                false => None,
            };
            let seen = receivers_in(&inputs, visibility_buffer, self.light, region)
                .within(tiles.as_deref());
            let whole = RasterJob {
                projection,
                warp: plan.warp.as_ref(),
                target: map.lookup.target(),
                rasterization: map.rasterization,
                receiver_tiles: None,
            };
            let tiles = self.receiver_tiles(seen, whole, map.lookup)?;
            let drawn = RasterJob {
                receiver_tiles: tiles.as_deref(),
                ..whole
            };
            let rasterized = shadow_map::shadow_map(&mut self.frame, inputs, drawn)?;
            self.pending_work.push(rasterized.work);
            let rounding = position_rounding(projection, self.camera.eye);
            let looked = LookupInput {
                projection,
                warp: plan.warp.as_ref(),
                texels: &rasterized.texels,
                comparison: map.lookup,
                bias: map.depth_bias(projection, rounding),
            };
            lookup::lookup(&mut self.frame, seen, looked, &visibility);
            layers.push(Layer {
                comparison: map.lookup,
                texels: rasterized.texels,
                plan,
            });
        }
        Ok(Recorded { visibility, layers })
    }

    /// The tiles of a map that need to be drawn; `None`: all of it, because somebody wants to see it or it is
    /// so small that finding them takes longer.
    fn receiver_tiles(
        &mut self,
        seen: Receivers,
        map: RasterJob,
        lookup: Comparison,
    ) -> Result<Option<PooledBuffer>> {
        let is_small = map.projection.texel_count() < seen.camera.pixel_count();
        // A disc may be of any size.
        if self.draws_whole_maps || is_small || lookup.filter.is_some() || !self.culls() {
            return Ok(None);
        }
        let (frame, reach) = (&mut self.frame, lookup.reach);
        receiver_tiles::receiver_tiles(frame, seen, map.projection, map.warp, reach).map(Some)
    }

    /// The visibility image by testing casters against receivers that are listed in the texels of each
    /// layer. Without a layer nothing is lit.
    pub fn listed_shadows(&mut self, plans: &[Plan]) -> Result<Recorded> {
        if plans.is_empty() {
            return self.all_in_shadow();
        }
        let visibility = self.begun_image()?;
        // As many rows of the image as one binding has room for.
        let row_bytes = RECEIVER_BYTES * u64::from(self.camera.width);
        let rows = (self.frame.gpu.largest_storage() / row_bytes).max(1);
        let rows = rows.min(u64::from(self.camera.height)) as u32;
        for plan in plans {
            let Fitted { projection, region } = &plan.fitted;
            let warp = plan.warp.as_ref();
            // Pieces of the image have none.
            let tiles = match rows == self.camera.height {
                true => self.image_tiles(region)?,
                false => None,
            };
            let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region)
                .within(tiles.as_deref());
            // The nearest casters, which settle most receivers that are in shadow.
            let map = projection.with_resolution(projection.width.min(MAX_MAP_TEXELS));
            let drawn = plain_map(&map);
            let rasterized = shadow_map::shadow_map(&mut self.frame, self.inputs, drawn)?;
            self.pending_work.push(rasterized.work);
            let mut grid = LightGrid::new(self.inputs.scene, self.camera, projection, map.width);
            for first_row in (0..self.camera.height).step_by(rows as usize) {
                grid.first_row = first_row;
                grid.row_count = rows.min(self.camera.height - first_row);
                let frame = &mut self.frame;
                let (lists, facts) = receiver_lists::receiver_lists(
                    frame,
                    seen,
                    &grid,
                    warp,
                    &rasterized.texels,
                    &visibility,
                )?;
                self.pending_facts.push(facts);
                let (work, facts) =
                    caster_tests::caster_tests(frame, seen, &grid, warp, &lists, &visibility)?;
                self.pending_work.push(work);
                self.pending_facts.push(facts);
            }
        }
        Ok(Recorded {
            visibility,
            layers: vec![],
        })
    }

    /// The visibility image by rays through the scene's hierarchy, which is built where it is missing.
    pub fn shadow_rays(&mut self) -> Result<PooledBuffer> {
        let start = Instant::now();
        let (hierarchy, is_new) = self.inputs.scene.hierarchy(&self.frame, self.scene)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame
                .add_time(shadow_rays::HIERARCHY_LABEL, milliseconds);
        } else {
            self.skip(shadow_rays::HIERARCHY_LABEL);
        }
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (visibility, facts) = shadow_rays::shadow_rays(&mut self.frame, seen, &hierarchy)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }

    /// What ray queries search; built where it is missing.
    pub fn acceleration_structure(&mut self) -> Result<Arc<AccelerationStructure>> {
        let start = Instant::now();
        let kept = &self.inputs.scene.acceleration;
        let (structure, is_new) = kept.get(&self.frame, self.scene, self.camera.eye)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame.add_time(acceleration::LABEL, milliseconds);
        } else {
            self.skip(acceleration::LABEL);
        }
        Ok(structure)
    }

    /// That, where ray queries are likely to be faster and the device can build it.
    pub fn preferred_structure(&mut self) -> Option<Arc<AccelerationStructure>> {
        let is_preferred = self.frame.gpu.prefers_ray_queries();
        is_preferred.then(|| self.acceleration_structure().ok())?
    }

    /// The visibility image by the device's ray queries.
    pub fn ray_queries(&mut self, structure: &AccelerationStructure) -> Result<PooledBuffer> {
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (visibility, facts) = ray_queries::ray_queries(&mut self.frame, seen, structure)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }

    /// The visibility image by shadow volumes; the scene's edges are found where they are not known.
    pub fn shadow_volumes(&mut self) -> Result<PooledBuffer> {
        let start = Instant::now();
        let (edges, is_new) = self.inputs.scene.edges(&self.frame, self.scene)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame
                .add_time(shadow_volumes::EDGES_LABEL, milliseconds);
        } else {
            self.skip(shadow_volumes::EDGES_LABEL);
        }
        let region = &Region::EVERYWHERE;
        let seen = receivers_in(&self.inputs, self.visibility_buffer, self.light, region);
        let (visibility, facts) = shadow_volumes::shadow_volumes(&mut self.frame, seen, &edges)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }

    /// Receivers of about `resolution` pixels along the longer side of the image. Submits what was
    /// recorded so far.
    pub fn sampled_receivers(&mut self, resolution: u32) -> Result<SampledReceivers> {
        let side = self.camera.width.max(self.camera.height);
        let stride = ((side + resolution / 2) / resolution).max(1);
        let buffer = self.visibility_buffer;
        let (camera, keys) = samples::samples(&mut self.frame, self.camera, buffer, stride)?;
        let read = self
            .frame
            .read::<u64>(Source::Kept(&keys), camera.pixel_count())?;
        let triangles = self.submit()?.take(&read)?;
        let triangles: Vec<_> = triangles
            .into_iter()
            .map(visibility::triangle_from_key)
            .collect();
        Ok(SampledReceivers::new(
            self.scene, self.light, camera, triangles, keys,
        ))
    }

    /// What maps answer for the samples, as in a visibility image. Submits what was recorded so far.
    pub fn sampled_visibility(
        &mut self,
        samples: &SampledReceivers,
        map: &MapParameters,
        plans: Vec<Plan>,
    ) -> Result<Vec<f32>> {
        let inputs = Inputs {
            scene: self.inputs.scene,
            camera: &samples.camera,
        };
        let recorded = self.answer(inputs, &samples.keys, map, plans)?;
        let count = samples.camera.pixel_count();
        let read = self
            .frame
            .read::<f32>(Source::Taken(recorded.visibility), count)?;
        self.submit()?.take(&read)
    }

    /// The frame where whatever is seen faces away from the light: there is nothing to look up.
    fn all_in_shadow(&mut self) -> Result<Recorded> {
        self.skip(shadow_map::LABEL);
        let visibility = self.begun_image()?;
        Ok(Recorded {
            visibility,
            layers: vec![],
        })
    }

    /// Names a stage that this frame does not need.
    pub fn skip(&mut self, stage: &'static str) {
        self.stats.skipped.push(stage);
    }

    /// Counts a layer that no receiver falls in.
    pub fn skip_layer(&mut self) {
        self.stats.skipped_layers += 1;
    }

    /// Keeps a number that the method found, by its name in the statistics.
    pub fn measure(&mut self, name: &'static str, value: f64) {
        self.stats.measures.push((name, value));
    }

    /// Counters to be taken after the next submission.
    pub(crate) fn keep_work(&mut self, work: PendingWork) {
        self.pending_work.push(work);
    }

    /// Whether what cannot change the picture is left out.
    pub(crate) fn culls(&self) -> bool {
        self.frame.culls
    }

    /// The frame that is being recorded.
    pub(crate) fn frame(&mut self) -> &mut Frame {
        &mut self.frame
    }

    pub(crate) fn submit(&mut self) -> Result<ReadResults> {
        let results = self.frame.submit()?;
        for work in self.pending_work.drain(..) {
            let parts = work.counters.iter().map(|read| Ok(results.take(read)?[0]));
            let counters = Counters::joined(&parts.collect::<Result<Vec<_>>>()?);
            let facts = (work.describe)(self.inputs.scene, &counters);
            self.stats.facts.add(work.label, facts);
            self.counters.push((work.had_room, counters));
        }
        for pending in self.pending_facts.drain(..) {
            let counters = results.take(&pending.counters)?;
            let facts = (pending.describe)(&self.frame.gpu, &counters)?;
            self.stats.facts.add(pending.label, facts);
        }
        Ok(results)
    }

    /// Receivers that face the light in all layers, once their bounds were asked for.
    pub fn facing_count(&self) -> u32 {
        self.stats.receivers.map_or(0, |counts| counts.facing)
    }

    /// Whether every list of work was long enough; else there is room for the next try.
    pub(crate) fn had_room(&self) -> Result<bool> {
        for (had_room, counters) in &self.counters {
            if !had_room(&self.frame.gpu, self.inputs.scene, counters)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    pub(crate) fn finish(self) -> (Frame, Stats) {
        (self.frame, self.stats)
    }
}

/// An exact map of depths and triangles, not warped.
fn plain_map(projection: &Projection) -> RasterJob<'_> {
    RasterJob {
        projection,
        warp: None,
        target: Target::DepthTriangle,
        rasterization: Rasterization::Exact,
        receiver_tiles: None,
    }
}

/// Second difference of one over the depth, as a share of it, that still is smooth.
const MAX_BEND: f64 = 0.02;

/// Some pixels of the image, seen by the CPU: rows of a coarse camera's image.
pub struct SampledReceivers {
    pub camera: Camera,
    keys: PooledBuffer,
    /// Not a number where nothing is seen.
    pub points: Vec<DVec3>,
    /// Towards the camera.
    pub normals: Vec<DVec3>,
    /// Along the viewing direction; not a number where nothing is seen.
    pub depths: Vec<f64>,
    is_facing: Vec<bool>,
}

impl SampledReceivers {
    fn new(
        scene: &Scene,
        light: &Light,
        camera: Camera,
        triangles: Vec<i32>,
        keys: PooledBuffer,
    ) -> Self {
        let (points, normals, depths) = surface(scene, &camera, &triangles);
        let points: Vec<_> = points.into_iter().map(DVec3::from).collect();
        let normals: Vec<_> = normals
            .into_iter()
            .map(|normal| DVec3::from(normal.map(f64::from)))
            .collect();
        let faces = |(point, normal): (&DVec3, &DVec3)| {
            let to_light = light.vector_from_point(*point);
            let is_reached = light
                .cone()
                .is_none_or(|cone| -to_light.dot(cone.axis) >= cone.cosine * to_light.length());
            normal.dot(to_light) > 0.0 && is_reached
        };
        Self {
            is_facing: points.iter().zip(&normals).map(faces).collect(),
            camera,
            keys,
            points,
            normals,
            depths,
        }
    }

    /// Points and normals of those that see a surface.
    pub fn seen(&self) -> (Vec<DVec3>, Vec<DVec3>) {
        let samples = self.points.iter().zip(&self.normals);
        samples.filter(|(point, _)| !point.is_nan()).unzip()
    }

    /// Indices of the samples that the light could reach.
    pub fn facing_the_light(&self) -> Vec<usize> {
        (0..self.points.len())
            .filter(|&i| self.is_facing[i])
            .collect()
    }

    pub fn is_facing(&self, index: usize) -> bool {
        self.is_facing[index]
    }

    /// The samples to the left and right, above and below.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> {
        self.neighbours_across(index)
            .into_iter()
            .flatten()
            .flatten()
    }

    /// Those to the left and right, then those above and below.
    fn neighbours_across(&self, index: usize) -> [[Option<usize>; 2]; 2] {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let (row, column) = (index / width, index % width);
        [
            [
                (column > 0).then(|| index - 1),
                (column + 1 < width).then_some(index + 1),
            ],
            [
                (row > 0).then(|| index - width),
                (row + 1 < height).then_some(index + width),
            ],
        ]
    }

    /// Whether the depth changes as a plane's does, so that its derivatives tell of the neighbourhood:
    /// one over it is linear in the image (the paper thresholds its second difference).
    pub fn is_smooth(&self, index: usize) -> bool {
        let here = 1.0 / self.depths[index];
        self.neighbours_across(index).into_iter().all(|pair| {
            let [Some(before), Some(after)] = pair else {
                return true;
            };
            let bend = 1.0 / self.depths[before] + 1.0 / self.depths[after] - 2.0 * here;
            bend.abs() < MAX_BEND * here
        })
    }
}

/// What the camera sees, for one layer of one light.
fn receivers_in<'a>(
    inputs: &Inputs<'a>,
    visibility_buffer: &'a wgpu::Buffer,
    light: &'a Light,
    region: &'a Region,
) -> Receivers<'a> {
    Receivers {
        scene: inputs.scene,
        camera: inputs.camera,
        visibility_buffer,
        light,
        region,
        tiles: None,
    }
}
