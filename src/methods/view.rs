//! What a method sees of a frame, and what it gives back.

use super::parameters::{MapParameters, position_rounding};
use crate::camera::Camera;
use crate::error::Result;
use crate::gpu::frame::{Frame, Read, ReadResults};
use crate::gpu::pool::PooledBuffer;
use crate::light::Light;
use crate::passes::importance_map::{self, Importance, ImportanceMap};
use crate::passes::lookup::{self, Comparison, DepthBias};
use crate::passes::outline::{self, Points};
use crate::passes::rasterize::Counters;
use crate::passes::receivers::{self, Bounds};
use crate::passes::warp_map::WarpMap;
use crate::passes::{Facts, Inputs, PendingFacts, Receivers, shadow_map, shadow_rays};
use crate::projection::Projection;
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use std::time::Instant;

/// A frame in the making: the passes, bound to the scene, camera and light.
pub struct View<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub light: &'a Light,
    frame: Frame,
    inputs: Inputs<'a>,
    visibility_buffer: &'a wgpu::Buffer,
    /// Counters of rasterized maps that the next submission brings.
    pending: Vec<(&'static str, Read<Counters>)>,
    counters: Vec<(&'static str, Counters)>,
    pending_facts: Vec<PendingFacts>,
    facts: Vec<(&'static str, Facts)>,
    bounds: Option<Bounds>,
    skipped: Vec<&'static str>,
}

/// A layer of a shadow map.
pub struct Layer {
    pub projection: Projection,
    pub warp: Option<WarpMap>,
    /// What the warp was made from.
    pub importance: Option<ImportanceMap>,
    pub comparison: Comparison,
    pub texels: PooledBuffer,
}

/// What a method recorded: the visibility image and the layers it was looked up in. A layer that no
/// receiver needs is not there.
pub struct Recorded {
    pub visibility: PooledBuffer,
    pub layers: Vec<Layer>,
}

/// What a submitted frame knows about itself.
pub struct Finished {
    pub frame: Frame,
    pub counters: Vec<(&'static str, Counters)>,
    pub facts: Vec<(&'static str, Facts)>,
    pub bounds: Option<Bounds>,
    pub skipped: Vec<&'static str>,
}

impl<'a> View<'a> {
    pub fn new(
        frame: Frame,
        inputs: Inputs<'a>,
        scene: &'a Scene,
        light: &'a Light,
        visibility_buffer: &'a wgpu::Buffer,
    ) -> Self {
        Self {
            scene,
            camera: inputs.camera,
            light,
            frame,
            inputs,
            visibility_buffer,
            pending: Vec::new(),
            counters: Vec::new(),
            pending_facts: Vec::new(),
            facts: Vec::new(),
            bounds: None,
            skipped: Vec::new(),
        }
    }

    /// The box around the receivers that face the light, in the axes of the projection. Submits what
    /// was recorded so far.
    pub fn receiver_bounds(&mut self, projection: &Projection) -> Result<Option<(DVec3, DVec3)>> {
        let seen = self.receivers();
        let bounds = receivers::receivers(&mut self.frame, seen, projection)?;
        let results = self.submit()?;
        let bounds = results.take(&bounds)?[0];
        self.bounds = Some(bounds);
        Ok(bounds.corners())
    }

    /// Points of the receivers that face the light, in the axes of the projection. Submits what was
    /// recorded so far.
    pub fn outline(&mut self, projection: &Projection, points: Points) -> Result<Vec<DVec2>> {
        let seen = self.receivers();
        let points = outline::outline(&mut self.frame, seen, projection, points)?;
        let results = self.submit()?;
        Ok(outline::found(results.take(&points)?))
    }

    /// A layer of a shadow map through the projection and the warp.
    pub fn shadow_map(
        &mut self,
        projection: Projection,
        warp: Option<WarpMap>,
        comparison: Comparison,
    ) -> Result<Layer> {
        let rasterized = shadow_map::shadow_map(
            &mut self.frame,
            self.inputs,
            &projection,
            warp.as_ref(),
            comparison.target(),
        )?;
        self.keep_counters(shadow_map::LABEL, rasterized.counters);
        Ok(Layer {
            projection,
            warp,
            importance: None,
            comparison,
            texels: rasterized.texels,
        })
    }

    /// The last two steps of every method with one map: casters into it, receivers against it.
    pub fn shadows(
        &mut self,
        map: &MapParameters,
        projection: Projection,
        warp: Option<WarpMap>,
        importance: Option<ImportanceMap>,
    ) -> Result<Recorded> {
        let rounding = position_rounding(&projection, self.camera.eye);
        let bias = map.depth_bias(&projection, rounding);
        let mut layer = self.shadow_map(projection, warp, map.lookup)?;
        layer.importance = importance;
        let visibility = self.lookup(&layer, bias)?;
        Ok(Recorded {
            visibility,
            layers: vec![layer],
        })
    }

    /// The importance of the cells of the map.
    pub fn importance_map(
        &mut self,
        projection: &Projection,
        cells: u32,
        importance: Importance,
        warp: Option<&WarpMap>,
    ) -> Result<ImportanceMap> {
        let seen = self.receivers();
        importance_map::importance_map(&mut self.frame, seen, projection, cells, importance, warp)
    }

    /// The visibility image.
    pub fn lookup(&mut self, layer: &Layer, bias: DepthBias) -> Result<PooledBuffer> {
        let seen = self.receivers();
        lookup::lookup(
            &mut self.frame,
            seen,
            &layer.projection,
            layer.warp.as_ref(),
            &layer.texels,
            layer.comparison,
            bias,
        )
    }

    /// The visibility image by rays through the scene's hierarchy, which is built where it is missing.
    pub fn shadow_rays(&mut self) -> Result<PooledBuffer> {
        let start = Instant::now();
        let gpu = self.frame.gpu.clone();
        let (hierarchy, is_new) = self.inputs.scene.hierarchy(&gpu, self.scene)?;
        if is_new {
            let milliseconds = start.elapsed().as_secs_f64() * 1e3;
            self.frame.add_time("hierarchy (CPU)", milliseconds);
        } else {
            self.skip("hierarchy (CPU)");
        }
        let seen = self.receivers();
        let (visibility, facts) =
            shadow_rays::shadow_rays(&mut self.frame, seen, self.light, &hierarchy)?;
        self.pending_facts.push(facts);
        Ok(visibility)
    }

    /// The frame where whatever is seen faces away from the light: there is nothing to look up.
    pub fn all_in_shadow(&mut self) -> Result<Recorded> {
        self.skip(shadow_map::LABEL);
        let seen = self.receivers();
        let visibility = lookup::all_in_shadow(&mut self.frame, seen)?;
        Ok(Recorded {
            visibility,
            layers: vec![],
        })
    }

    fn receivers(&self) -> Receivers<'a> {
        let Light::Directional { direction } = *self.light;
        Receivers {
            scene: self.inputs.scene,
            camera: self.inputs.camera,
            visibility_buffer: self.visibility_buffer,
            light_direction: direction,
        }
    }

    /// Names a stage that this frame does not need.
    pub fn skip(&mut self, stage: &'static str) {
        self.skipped.push(stage);
    }

    /// Counters to be taken after the next submission.
    pub(crate) fn keep_counters(&mut self, label: &'static str, counters: Read<Counters>) {
        self.pending.push((label, counters));
    }

    /// The frame that is being recorded.
    pub(crate) fn frame(&mut self) -> &mut Frame {
        &mut self.frame
    }

    pub(crate) fn submit(&mut self) -> Result<ReadResults> {
        let results = self.frame.submit()?;
        for (label, read) in self.pending.drain(..) {
            self.counters.push((label, results.take(&read)?[0]));
        }
        for pending in self.pending_facts.drain(..) {
            let counters = results.take(&pending.counters)?;
            let facts = (pending.describe)(&self.frame.gpu, &counters)?;
            self.facts.push((pending.label, facts));
        }
        Ok(results)
    }

    pub(crate) fn finish(self) -> Finished {
        Finished {
            frame: self.frame,
            counters: self.counters,
            facts: self.facts,
            bounds: self.bounds,
            skipped: self.skipped,
        }
    }
}
