//! The verbs of methods on the CPU.

use super::exact::exact;
use super::frame::{
    CASTER_TESTS_LABEL, Frame, HIERARCHY_LABEL, OUTLINE_LABEL, PlannedLayer, RECEIVERS_LABEL,
    Recorded, SAMPLES_LABEL, SHADOW_RAYS_LABEL,
};
use super::queries;
use super::shadow_rays::shadow_rays;
use crate::error::{Error, Result};
use crate::fits::layer::Layer;
use crate::fits::receivers::{Corners, OutlinePoints, ReceiverQueries, Setting};
use crate::fits::samples::{SampledReceivers, coarse_camera, first_sample, stride};
use crate::importance::{EdgeBias, Factors, Grid, Importance, ImportanceMap, OldImportance};
use crate::map_settings::MapSettings;
use crate::stats::ReceiverCounts;
use crate::verbs::{FitQueries, Traversal, Verbs};
use crate::warp::{Axis, CountFit, Warp};
use glam::DVec2;
use std::time::Instant;

impl<'a> ReceiverQueries<'a> for Frame<'a> {
    fn setting(&self) -> Setting<'a> {
        Setting {
            scene: self.scene,
            camera: self.camera,
            light: self.light,
        }
    }

    fn bounds(&mut self, layers: &[Layer]) -> Result<Vec<Option<Corners>>> {
        let (bounds, facing) = self.timed(RECEIVERS_LABEL, |frame| {
            queries::bounds(&frame.receivers(), layers)
        });
        let seen = self.image().seen_count();
        self.stats.receivers = Some(ReceiverCounts { seen, facing });
        Ok(bounds)
    }

    fn outline(&mut self, layer: &Layer, points: OutlinePoints) -> Result<Vec<DVec2>> {
        Ok(self.timed(OUTLINE_LABEL, |frame| {
            queries::outline(&frame.receivers(), layer, points)
        }))
    }

    fn samples(&mut self, resolution: u32) -> Result<SampledReceivers> {
        let stride = stride(self.camera, resolution);
        let camera = coarse_camera(self.camera, stride);
        let triangles = self.timed(SAMPLES_LABEL, |frame| {
            let first = first_sample(frame.camera, stride);
            frame
                .image()
                .sampled(&camera, first as usize, stride as usize)
                .triangle_ids()
        });
        Ok(SampledReceivers::new(
            self.scene, self.light, camera, &triangles,
        ))
    }

    fn leaves_out_empty_layers(&self) -> bool {
        self.culls
    }

    fn skip_layer(&mut self) {
        self.stats.skipped_layers += 1;
    }
}

impl<'a> FitQueries<'a> for Frame<'a> {
    fn sampled_visibility(
        &mut self,
        _: &SampledReceivers,
        _: MapSettings,
        _: Vec<Layer>,
    ) -> Result<Vec<f32>> {
        is_missing("maps")
    }

    fn skip(&mut self, stage: &'static str) {
        self.stats.skipped.push(stage);
    }

    fn measure(&mut self, name: &'static str, value: f64) {
        self.stats.measures.push((name, value));
    }

    fn add_time(&mut self, label: &'static str, milliseconds: f64) {
        self.timings.push((label, milliseconds));
    }
}

impl Recorded {
    fn without_layers(visibility: Vec<f32>) -> Self {
        Self {
            visibility,
            layers: vec![],
        }
    }
}

/// A method that has not all of its verbs here is given to the other engine.
fn is_missing<T>(verb: &str) -> Result<T> {
    Err(Error::Device(format!(
        "{verb} have no form on the CPU engine yet; take device='gpu'"
    )))
}

impl<'a> Verbs<'a> for Frame<'a> {
    type Recorded = Recorded;
    type Warp = Warp;
    type Values = Vec<f32>;
    type Analysed = ();

    fn shadows(&mut self, _: MapSettings, _: Vec<PlannedLayer>) -> Result<Recorded> {
        is_missing("maps")
    }

    fn facing_count(&self) -> u32 {
        self.stats.receivers.map_or(0, |counts| counts.facing)
    }

    /// Here triangles are listed in the cells of the light's grid, and each receiver is tested against those in its cell.
    fn exact(
        &mut self,
        _: impl FnOnce(&mut Self) -> Result<Vec<PlannedLayer>>,
    ) -> Result<Recorded> {
        let visibility = self.timed(CASTER_TESTS_LABEL, |frame| {
            exact(frame.scene, frame.image(), frame.camera, frame.light)
        });
        Ok(Recorded::without_layers(visibility))
    }

    fn shadow_rays(&mut self, traversal: Traversal) -> Result<Recorded> {
        if traversal == Traversal::Hardware {
            return Err(traversal.is_missing("the CPU engine has no ray queries"));
        }
        let start = Instant::now();
        let (hierarchy, is_new) = self.kept.hierarchy(self.scene)?;
        self.add_kept(HIERARCHY_LABEL, start, is_new);
        let (visibility, rays) = self.timed(SHADOW_RAYS_LABEL, |frame| {
            let (camera, light) = (frame.camera, frame.light);
            shadow_rays(frame.scene, frame.image(), camera, light, &hierarchy.bvh)
        });
        self.count(SHADOW_RAYS_LABEL, "rays", rays);
        Ok(Recorded::without_layers(visibility))
    }

    fn shadow_volumes(&mut self) -> Result<Recorded> {
        is_missing("shadow volumes")
    }

    fn weights(&mut self, _: &str, _: &[f32], _: [u32; 2]) -> Result<Grid<Vec<f32>>> {
        is_missing("weights")
    }

    fn boundary(&mut self, _: MapSettings, _: Vec<Layer>, _: f64) -> Result<Grid<Vec<f32>>> {
        is_missing("boundaries")
    }

    fn depth_image(&mut self, _: Layer) -> Result<()> {
        is_missing("depth images")
    }

    fn shadow_edges(&mut self, _: &(), _: EdgeBias, _: f64) -> Result<Grid<Vec<f32>>> {
        is_missing("shadow edges")
    }

    fn importance_map(
        &mut self,
        _: &Layer,
        _: u32,
        _: Importance,
        _: Factors<Vec<f32>>,
        _: Option<&Warp>,
    ) -> Result<ImportanceMap<Vec<f32>>> {
        is_missing("importance maps")
    }

    fn forward_importance(
        &mut self,
        _: &(),
        _: u32,
        _: Factors<Vec<f32>>,
    ) -> Result<ImportanceMap<Vec<f32>>> {
        is_missing("importance maps")
    }

    fn blend_importance(
        &mut self,
        _: &mut ImportanceMap<Vec<f32>>,
        _: OldImportance,
        _: Option<&Warp>,
    ) -> Result<()> {
        is_missing("importance maps")
    }

    fn warp(&mut self, _: u32, _: u32, _: u32) -> Result<Warp> {
        is_missing("warps")
    }

    fn fit_counts(
        &mut self,
        _: &mut Warp,
        _: Axis,
        _: u32,
        _: &ImportanceMap<Vec<f32>>,
        _: CountFit,
    ) -> Result<()> {
        is_missing("warps")
    }

    fn fit_maxima(
        &mut self,
        _: &mut Warp,
        _: Axis,
        _: u32,
        _: &ImportanceMap<Vec<f32>>,
        _: f64,
    ) -> Result<()> {
        is_missing("warps")
    }

    fn finish_warp(&mut self, _: &mut Warp, _: u32) {}
}
