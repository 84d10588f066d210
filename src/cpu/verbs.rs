//! The verbs of methods on the CPU.

use super::blend_importance::blend_importance;
use super::boundary::boundary;
use super::depth_image::DepthImage;
use super::exact::exact;
use super::filtered_texels::FilteredTexels;
use super::forward_importance::forward_importance;
use super::frame::{
    BLEND_LABEL, BOUNDARY_LABEL, DrawnLayer, EDGES_LABEL, FORWARD_LABEL, Frame, HIERARCHY_LABEL,
    IMPORTANCE_LABEL, LIGHT_GRID_LABEL, LOOKUP_LABEL, MOMENTS_LABEL, OUTLINE_LABEL, PlannedLayer,
    RECEIVER_TILES_LABEL, RECEIVERS_LABEL, Recorded, SAMPLES_LABEL, SHADOW_EDGE_LABEL,
    SHADOW_MAP_LABEL, SHADOW_RAYS_LABEL, SHADOW_VOLUMES_LABEL, WARP_LABEL, check_map, check_map_of,
};
use super::importance_map::{Words, importance_map};
use super::lookup::{LookedUp, ask, lookup};
use super::map::Map;
use super::queries;
use super::rasterize::Image;
use super::receiver_tiles::ReceiverTiles;
use super::receivers::Receivers;
use super::shadow_edge::shadow_edge;
use super::shadow_rays::shadow_rays;
use super::shadow_volumes::shadow_volumes;
use super::tessellate::tessellate;
use super::warp_map::{CpuWarp, WarpMap};
use crate::camera::Camera;
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::fits::receivers::{Corners, OutlinePoints, ReceiverQueries, Setting};
use crate::fits::samples::{SampledReceivers, coarse_camera, first_sample, stride};
use crate::importance::{EdgeBias, Factors, Grid, Importance, ImportanceMap, OldImportance};
use crate::map_settings::{MapSettings, Rasterization};
use crate::map_size::MapSize;
use crate::moments::FilteredMap;
use crate::paging::Paging;
use crate::projection::Projection;
use crate::sides::Source;
use crate::stats::ReceiverCounts;
use crate::verbs::{FitQueries, Traversal, Verbs};
use crate::warp::samples::SampledWarp;
use crate::warp::tables::Table;
use crate::warp::{Axis, CountFit, Warp, Warping};
use glam::DVec2;
use std::sync::Arc;
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
        let image = self.timed(SAMPLES_LABEL, |frame| {
            let first = first_sample(frame.camera, stride) as usize;
            frame.image().sampled(&camera, first, stride as usize)
        });
        let triangles = image.triangle_ids();
        self.sampled = Some(image);
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
        samples: &SampledReceivers,
        map: MapSettings,
        layers: Vec<Layer>,
    ) -> Result<Vec<f32>> {
        let image = self.sampled.take().expect("samples were asked for");
        let layers = layers.into_iter().map(PlannedLayer::from).collect();
        let recorded = self.answer(&samples.camera, &image, map, layers)?;
        self.sampled = Some(image);
        Ok(recorded.visibility)
    }

    fn skip(&mut self, stage: &'static str) {
        self.stats.skipped.push(stage);
    }

    fn measure(&mut self, name: &'static str, value: f64) {
        self.stats.measures.push((name, value));
    }

    fn add_time(&mut self, label: &'static str, milliseconds: f64) {
        self.add_milliseconds(label, milliseconds);
    }
}

/// What the light sees of a layer.
pub struct Analysed {
    projection: Projection,
    image: DepthImage,
}

impl Frame<'_> {
    fn draw(
        &mut self,
        plan: &PlannedLayer,
        rasterization: Rasterization,
        looked_at: Option<&ReceiverTiles>,
    ) -> Result<Map> {
        let (projection, warp) = (&plan.layer.projection, plan.warp.as_ref());
        check_map(projection)?;
        let (scene, light) = (self.scene, Source::of(self.light));
        let (map, pieces) = self.timed(SHADOW_MAP_LABEL, |_| match rasterization {
            Rasterization::Exact => {
                let map = Map::new(projection, warp, scene, light, looked_at);
                Ok((map, None))
            }
            Rasterization::Linear { longest_edge } => {
                let functions = warp.and_then(Warping::functions);
                let pieces = tessellate(projection, functions, scene, longest_edge)?;
                let map = Map::linear(projection, scene, light, &pieces)?;
                Ok((map, Some(pieces.len())))
            }
        })?;
        if let Some(pieces) = pieces {
            self.count(SHADOW_MAP_LABEL, "rasterized", pieces as u64);
        }
        Ok(map)
    }

    /// Of each layer the tiles that receivers look at. Empty where maps are drawn whole: because somebody wants to see
    /// them, the lookup may go anywhere, they are so small that finding the tiles takes longer, or a warp has drawn texels
    /// to the receivers, so that few are left.
    fn looked_at(
        &mut self,
        (image, camera): (&Image, &Camera),
        settings: MapSettings,
        plans: &[PlannedLayer],
    ) -> Vec<ReceiverTiles> {
        let texels: usize = plans
            .iter()
            .map(|plan| plan.layer.projection.texel_count())
            .sum();
        let is_whole = settings.rasterization != Rasterization::Exact;
        if is_whole
            || settings.lookup.looks_far()
            || plans.iter().any(|plan| plan.warp.is_some())
            || texels < camera.pixel_count()
            || !self.draws_parts_of_maps()
        {
            return vec![];
        }
        let tiles = self.timed(RECEIVER_TILES_LABEL, |frame| {
            let receivers = Receivers::new(frame.scene, image, camera, frame.light);
            let sizes = plans.iter().map(|plan| plan.layer.projection.size());
            let tiles: Vec<_> = sizes.map(ReceiverTiles::new).collect();
            let nothing = Map::nothing();
            let pairs = plans.iter().zip(&tiles);
            let looked: Vec<_> = pairs
                .map(|(plan, tiles)| {
                    let map = (&nothing, None);
                    LookedUp::new(&receivers, &plan.layer, map, None, settings).marking(tiles)
                })
                .collect();
            ask(&receivers, &looked);
            tiles
        });
        let skipped: usize = tiles.iter().map(ReceiverTiles::skipped).sum();
        self.count(SHADOW_MAP_LABEL, "skipped_tiles", skipped as u64);
        tiles
    }

    /// The moments of a layer's texels, blurred.
    fn filtered(
        &mut self,
        plan: &PlannedLayer,
        map: &Map,
        filter: FilteredMap,
    ) -> Result<FilteredTexels> {
        let (projection, warp) = (&plan.layer.projection, plan.warp.as_ref());
        let functions = warp.and_then(Warping::functions);
        filter.check_warp(functions.map_or(1, |map| map.warp.functions))?;
        check_map_of(projection, FilteredTexels::bytes_of_texel(filter))?;
        Ok(self.timed(MOMENTS_LABEL, |_| {
            FilteredTexels::new(projection, functions, map, filter)
        }))
    }

    /// Casters into each layer, and the receivers of an image against it.
    fn answer(
        &mut self,
        camera: &Camera,
        image: &Image,
        settings: MapSettings,
        plans: Vec<PlannedLayer>,
    ) -> Result<Recorded> {
        camera.check_float32(self.scene.bounds())?;
        let mut looked_at = self
            .looked_at((image, camera), settings, &plans)
            .into_iter();
        let mut layers = Vec::new();
        for plan in plans {
            let map = self.draw(&plan, settings.rasterization, looked_at.next().as_ref())?;
            let moments = match settings.lookup.moments {
                None => None,
                Some(filter) => Some(self.filtered(&plan, &map, filter)?),
            };
            let map = Arc::new(map);
            layers.push(DrawnLayer { plan, map, moments });
        }
        let visibility = self.timed(LOOKUP_LABEL, |frame| {
            let receivers = Receivers::new(frame.scene, image, camera, frame.light);
            let looked = layers.iter();
            let looked: Vec<_> = looked
                .map(|DrawnLayer { plan, map, moments }| {
                    let map = (&**map, plan.warp.as_ref());
                    LookedUp::new(&receivers, &plan.layer, map, moments.as_ref(), settings)
                })
                .collect();
            lookup(&receivers, &looked)
        });
        self.stats.layers = layers.len();
        Ok(Recorded {
            visibility,
            layers,
            pages: None,
        })
    }
}

impl Recorded {
    fn without_layers(visibility: Vec<f32>) -> Self {
        Self {
            visibility,
            layers: vec![],
            pages: None,
        }
    }
}

impl<'a> Verbs<'a> for Frame<'a> {
    type Recorded = Recorded;
    type Warp = CpuWarp;
    type Values = Words;
    type Analysed = Analysed;

    fn shadows(&mut self, map: MapSettings, layers: Vec<PlannedLayer>) -> Result<Recorded> {
        let seen = self.seen.clone();
        if layers.is_empty() {
            self.skip(SHADOW_MAP_LABEL);
            let dark = |id: i32| if id < 0 { f32::NAN } else { 0.0 };
            let visibility = seen.image.triangle_ids().into_iter().map(dark);
            return Ok(Recorded::without_layers(visibility.collect()));
        }
        self.answer(self.camera, &seen.image, map, layers)
    }

    fn paged_shadows(
        &mut self,
        settings: MapSettings,
        maps: Vec<Layer>,
        paging: Paging,
    ) -> Result<Recorded> {
        match maps.is_empty() {
            true => self.shadows(settings, vec![]),
            false => self.answer_in_pages(settings, &maps, paging),
        }
    }

    fn facing_count(&self) -> u32 {
        self.stats.receivers.map_or(0, |counts| counts.facing)
    }

    /// Here triangles are listed in the cells of the light's grid, and each receiver is tested against those in its cell.
    fn exact(
        &mut self,
        _: impl FnOnce(&mut Self) -> Result<Vec<PlannedLayer>>,
    ) -> Result<Recorded> {
        let known = self.culls.then(|| self.kept.grids.known()).flatten();
        let found = exact(self.scene, self.image(), self.camera, self.light, known);
        for (label, milliseconds) in found.timings {
            match label == LIGHT_GRID_LABEL && !found.has_new_grids {
                true => self.skip(label),
                false => self.add_milliseconds(label, milliseconds),
            }
        }
        self.kept.grids.keep(found.grids);
        Ok(Recorded::without_layers(found.visibility))
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
            shadow_rays(frame.scene, frame.image(), camera, light, &hierarchy.made)
        });
        self.count(SHADOW_RAYS_LABEL, "rays", rays);
        Ok(Recorded::without_layers(visibility))
    }

    fn shadow_volumes(&mut self) -> Result<Recorded> {
        let start = Instant::now();
        let (edges, is_new) = self.kept.edges(self.scene)?;
        self.add_kept(EDGES_LABEL, start, is_new);
        let (visibility, sides) = self.timed(SHADOW_VOLUMES_LABEL, |frame| {
            shadow_volumes(&frame.receivers(), &edges.made)
        });
        self.count(SHADOW_VOLUMES_LABEL, "sides", sides);
        Ok(Recorded::without_layers(visibility))
    }

    fn weights(&mut self, _: &str, values: &[f32], size: [u32; 2]) -> Result<Grid<Words>> {
        let [columns, rows] = size;
        Ok(Grid {
            values: values.iter().map(|value| value.to_bits()).collect(),
            columns,
            rows,
        })
    }

    fn boundary(
        &mut self,
        map: MapSettings,
        layers: Vec<Layer>,
        weight: f64,
    ) -> Result<Grid<Words>> {
        let layers = layers.into_iter().map(PlannedLayer::from).collect();
        let plain = self.shadows(map, layers)?;
        Ok(self.timed(BOUNDARY_LABEL, |frame| {
            boundary(&frame.receivers(), &plain.visibility, weight)
        }))
    }

    fn depth_image(&mut self, layer: Layer) -> Result<Analysed> {
        check_map(&layer.projection)?;
        let light = Source::of(self.light);
        let image = self.timed(SHADOW_MAP_LABEL, |frame| {
            let projection = &layer.projection;
            let map = Map::new(projection, None, frame.scene, light, None);
            DepthImage::new(&map, projection)
        });
        Ok(Analysed {
            projection: layer.projection,
            image,
        })
    }

    fn shadow_edges(
        &mut self,
        analysed: &Analysed,
        bias: EdgeBias,
        floor: f64,
    ) -> Result<Grid<Words>> {
        Ok(self.timed(SHADOW_EDGE_LABEL, |_| {
            shadow_edge(&analysed.projection, &analysed.image, bias, floor)
        }))
    }

    fn importance_map(
        &mut self,
        layer: &Layer,
        cells: u32,
        importance: Importance,
        factors: Factors<Words>,
        warp: Option<&CpuWarp>,
    ) -> Result<ImportanceMap<Words>> {
        self.camera.check_float32(self.scene.bounds())?;
        let from = (functions_of(warp), self.placed.take());
        let (map, placed) = self.timed(IMPORTANCE_LABEL, |frame| {
            importance_map(&frame.receivers(), layer, cells, importance, factors, from)
        });
        self.placed = placed;
        Ok(map)
    }

    fn forward_importance(
        &mut self,
        analysed: &Analysed,
        cells: u32,
        factors: Factors<Words>,
    ) -> Result<ImportanceMap<Words>> {
        let Analysed { projection, image } = analysed;
        Ok(self.timed(FORWARD_LABEL, |frame| {
            forward_importance(frame.scene, frame.camera, projection, image, cells, factors)
        }))
    }

    fn blend_importance(
        &mut self,
        importance: &mut ImportanceMap<Words>,
        old: OldImportance,
        warp: Option<&CpuWarp>,
    ) -> Result<()> {
        self.timed(BLEND_LABEL, |_| {
            blend_importance(importance, old, functions_of(warp));
        });
        Ok(())
    }

    fn warp(&mut self, functions: u32, cells: u32, _: MapSize) -> Result<CpuWarp> {
        Ok(Warping::Functions(WarpMap::new(functions, cells)))
    }

    fn fit_counts(
        &mut self,
        warp: &mut CpuWarp,
        axis: Axis,
        _: MapSize,
        counts: &ImportanceMap<Words>,
        fit: CountFit,
    ) -> Result<()> {
        self.timed(WARP_LABEL, |_| fitted(warp).fit_counts(axis, counts, fit));
        Ok(())
    }

    fn fit_maxima(
        &mut self,
        warp: &mut CpuWarp,
        axis: Axis,
        _: MapSize,
        importance: &ImportanceMap<Words>,
        sigma: f64,
    ) -> Result<()> {
        self.timed(WARP_LABEL, |_| {
            fitted(warp).fit_maxima(axis, importance, sigma)
        });
        Ok(())
    }

    fn set_functions(&mut self, warp: &mut CpuWarp, values: &[f32]) {
        fitted(warp).warp.values.copy_from_slice(values);
    }

    fn sampled_warp(&mut self, table: &Table, size: MapSize) -> Result<CpuWarp> {
        Ok(self.timed(WARP_LABEL, |_| {
            Warping::Samples(SampledWarp::new(table, size))
        }))
    }

    fn read_importance(&mut self, importance: &ImportanceMap<Words>) -> Result<Vec<u32>> {
        Ok(importance.values.clone())
    }

    fn read_functions(&mut self, warp: &CpuWarp) -> Result<Warp> {
        Ok(functions_of(Some(warp)).expect("no table").clone())
    }

    fn finish_warp(&mut self, warp: &mut CpuWarp, size: MapSize) {
        self.timed(WARP_LABEL, |_| fitted(warp).finish(size));
    }
}

fn functions_of(warp: Option<&CpuWarp>) -> Option<&Warp> {
    let functions = warp.and_then(Warping::functions);
    functions.map(|map| &map.warp)
}

/// The functions of a warp in the making.
fn fitted(warp: &mut CpuWarp) -> &mut WarpMap {
    match warp {
        Warping::Functions(functions) => functions,
        Warping::Samples(_) => unreachable!("a table is finished as it is made"),
    }
}
