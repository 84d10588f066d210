//! The verbs of methods as passes of the GPU.

use super::{Analysed, Pixels, PlannedLayer, Recorded, View};
use crate::error::{Error, Result};
use crate::fits::layer::Layer;
use crate::fits::samples::SampledReceivers;
use crate::gpu::passes::blend_importance::blend_importance;
use crate::gpu::passes::boundary::boundary;
use crate::gpu::passes::forward_importance::forward_importance;
use crate::gpu::passes::importance_map::{ImportanceMap, importance_map};
use crate::gpu::passes::rasterize::RasterJob;
use crate::gpu::passes::shadow_edge::shadow_edge;
use crate::gpu::passes::shadow_map;
use crate::gpu::passes::warp_map::WarpMap;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Source;
use crate::importance::{EdgeBias, Factors, Grid, Importance, OldImportance};
use crate::map_settings::MapSettings;
use crate::map_size::MapSize;
use crate::paging::Paging;
use crate::verbs::{FitQueries, Traversal, Verbs};
use crate::warp::tables::Table;
use crate::warp::{Axis, CountFit, Warp};

impl<'a> FitQueries<'a> for View<'a> {
    /// Submits what was recorded so far.
    fn sampled_visibility(
        &mut self,
        samples: &SampledReceivers,
        map: MapSettings,
        layers: Vec<Layer>,
    ) -> Result<Vec<f32>> {
        let plans = layers.into_iter().map(PlannedLayer::from).collect();
        let (camera, keys) = self.sampled.take().expect("samples were asked for");
        assert_eq!(camera, samples.camera, "the last samples");
        let recorded = self.answer(Pixels::Samples(&camera, &keys), map, plans)?;
        let taken = Source::Taken(recorded.visibility);
        let read = self.frame.read::<f32>(taken, camera.pixel_count())?;
        self.sampled = Some((camera, keys));
        self.submit()?.take(&read)
    }

    fn skip(&mut self, stage: &'static str) {
        self.stats.skipped.push(stage);
    }

    fn measure(&mut self, name: &'static str, value: f64) {
        self.stats.measures.push((name, value));
    }

    fn add_time(&mut self, label: &'static str, milliseconds: f64) {
        self.frame.add_time(label, milliseconds);
    }
}

impl<'a> Verbs<'a> for View<'a> {
    type Recorded = Recorded;
    type Warp = WarpMap;
    type Values = PooledBuffer;
    type Analysed = Analysed;

    fn shadows(&mut self, map: MapSettings, layers: Vec<PlannedLayer>) -> Result<Recorded> {
        self.mapped_shadows(map, layers)
    }

    fn paged_shadows(
        &mut self,
        map: MapSettings,
        maps: Vec<Layer>,
        paging: Paging,
    ) -> Result<Recorded> {
        match maps.is_empty() {
            true => self.all_in_shadow(),
            false => self.shadows_in_pages(map, &maps, paging),
        }
    }

    fn facing_count(&self) -> u32 {
        self.stats.receivers.map_or(0, |counts| counts.facing)
    }

    fn exact(
        &mut self,
        layers: impl FnOnce(&mut Self) -> Result<Vec<PlannedLayer>>,
    ) -> Result<Recorded> {
        let layers = layers(self)?;
        self.listed_shadows(&layers)
    }

    fn shadow_rays(&mut self, traversal: Traversal) -> Result<Recorded> {
        let structure = match traversal {
            Traversal::Auto => self.preferred_structure(),
            Traversal::Compute => None,
            Traversal::Hardware => {
                Some(self.acceleration_structure().map_err(|error| match error {
                    Error::Device(reason) => traversal.is_missing(&reason),
                    other => other,
                })?)
            }
        };
        let visibility = match structure {
            Some(structure) => self.rays_of_hardware(&structure)?,
            None => self.rays_of_compute()?,
        };
        Ok(Recorded::without_layers(visibility))
    }

    fn shadow_volumes(&mut self) -> Result<Recorded> {
        Ok(Recorded::without_layers(self.volumes()?))
    }

    fn weights(
        &mut self,
        what: &str,
        values: &[f32],
        [columns, rows]: [u32; 2],
    ) -> Result<Grid<PooledBuffer>> {
        Ok(Grid {
            values: self.frame.constants(what, values)?,
            columns,
            rows,
        })
    }

    fn boundary(
        &mut self,
        map: MapSettings,
        layers: Vec<Layer>,
        weight: f64,
    ) -> Result<Grid<PooledBuffer>> {
        let layers = layers.into_iter().map(PlannedLayer::from).collect();
        let plain = self.mapped_shadows(map, layers)?;
        boundary(&mut self.frame, self.seen, &plain.visibility, weight)
    }

    fn depth_image(&mut self, layer: Layer) -> Result<Analysed> {
        let job = RasterJob::plain(&layer.projection);
        let texels = shadow_map::shadow_map(&mut self.frame, self.seen.scene, job)?;
        Ok(Analysed { layer, texels })
    }

    fn shadow_edges(
        &mut self,
        analysed: &Analysed,
        bias: EdgeBias,
        floor: f64,
    ) -> Result<Grid<PooledBuffer>> {
        let projection = &analysed.layer.projection;
        let (frame, scene, texels) = (&mut self.frame, self.seen.scene, &analysed.texels);
        shadow_edge(frame, scene, projection, texels, bias, floor)
    }

    fn importance_map(
        &mut self,
        layer: &Layer,
        cells: u32,
        importance: Importance,
        factors: Factors<PooledBuffer>,
        warp: Option<&WarpMap>,
    ) -> Result<ImportanceMap> {
        let Layer { projection, region } = layer;
        let tiles = self.image_tiles(region)?;
        let seen = self.seen.within(region, tiles.as_deref());
        let frame = &mut self.frame;
        importance_map(frame, seen, projection, cells, importance, factors, warp)
    }

    fn forward_importance(
        &mut self,
        analysed: &Analysed,
        cells: u32,
        factors: Factors<PooledBuffer>,
    ) -> Result<ImportanceMap> {
        let Analysed { layer, texels, .. } = analysed;
        let Layer { projection, region } = layer;
        let seen = self.seen.within(region, None);
        let frame = &mut self.frame;
        forward_importance(frame, seen, projection, texels, cells, factors)
    }

    fn blend_importance(
        &mut self,
        importance: &mut ImportanceMap,
        old: OldImportance,
        warp: Option<&WarpMap>,
    ) -> Result<()> {
        blend_importance(&mut self.frame, importance, old, warp)
    }

    fn warp(&mut self, functions: u32, cells: u32, size: MapSize) -> Result<WarpMap> {
        WarpMap::new(&self.frame, functions, cells, size)
    }

    fn fit_counts(
        &mut self,
        warp: &mut WarpMap,
        axis: Axis,
        size: MapSize,
        counts: &ImportanceMap,
        fit: CountFit,
    ) -> Result<()> {
        warp.fit_counts(&mut self.frame, axis, size, &counts.values, fit)
    }

    fn fit_maxima(
        &mut self,
        warp: &mut WarpMap,
        axis: Axis,
        size: MapSize,
        importance: &ImportanceMap,
        sigma: f64,
    ) -> Result<()> {
        warp.fit_maxima(&mut self.frame, axis, size, &importance.values, sigma)
    }

    fn set_functions(&mut self, warp: &mut WarpMap, values: &[f32]) {
        warp.set(&mut self.frame, values);
    }

    fn sampled_warp(&mut self, _: &Table, _: MapSize) -> Result<WarpMap> {
        Err(Error::Device(
            "warps by samples have no form on the GPU engine; take device='cpu'".to_string(),
        ))
    }

    /// Submits what was recorded so far.
    fn read_importance(&mut self, importance: &ImportanceMap) -> Result<Vec<u32>> {
        let count = (importance.cells as usize).pow(2);
        let read = self.frame.read(Source::Kept(&importance.values), count)?;
        self.submit()?.take(&read)
    }

    /// Submits what was recorded so far.
    fn read_functions(&mut self, warp: &WarpMap) -> Result<Warp> {
        let read = warp.read(&mut self.frame)?;
        let values = self.submit()?.take(&read)?;
        Ok(warp.layout.functions_of(values))
    }

    fn finish_warp(&mut self, warp: &mut WarpMap, size: MapSize) {
        warp.finish(&mut self.frame, size);
    }
}
