//! What a receiver, or what the light sees, is worth to a warp: the analysis before `rtw` and `notw`.
//!
//! Rosen's functions (RTW, section 5), combined as a product; the boundaries of shadows as H. Chong and
//! S. Gortler sample them (Scene optimized shadow mapping, 2007), found in a first pass with a small map
//! that is not warped; and a user's own weights.

use super::arrays::{Array, OldMap};
use super::fit::WarpedMaps;
use super::prelude::*;
use super::schema::{MAX_RESOLUTION, Typed, Value, count_or_none};
use crate::importance::{EdgeBias, Factors, Grid, ImportanceMap, OldImportance};
use crate::map_settings::MapSettings;
use crate::warp::MAX_CELLS;
use glam::{DMat3, DVec3};
use std::borrow::Cow;
use std::sync::Arc;

/// Where importance comes from (Rosen, section 4.1).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the light's depth image.
    Forward,
    /// From the receivers.
    Backward,
    /// From the receivers, with factors from the light's depth image.
    Hybrid,
}

pub const DIRECTIONS: Choices<Direction> = &[
    ("backward", Direction::Backward),
    ("forward", Direction::Forward),
    ("hybrid", Direction::Hybrid),
];

/// The functions whose product is the importance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Functions {
    pub distance: bool,
    pub normal: bool,
    pub shadow_edge: bool,
    pub boundary: bool,
}

impl Typed for Functions {
    fn typed(value: &Value) -> Self {
        let product = Cow::typed(value);
        let has = |factor: &str| product.split('*').any(|known| known == factor);
        Self {
            distance: has("distance"),
            normal: has("normal"),
            shadow_edge: has("shadow_edge"),
            boundary: has("boundary"),
        }
    }
}

parameters! {
    /// Beside `importance`, of whose functions each method knows its own.
    pub struct AnalysisParameters {
        pub normal_bonus: f64 = number(Some(2.0), NON_NEGATIVE, ""),
        /// Side of the depth image, or of the map of the first pass.
        pub analysis_resolution: u32 = count(Some(512), MAX_RESOLUTION, "texels"),
        pub edge_bias: Option<f64> = number(None, NON_NEGATIVE, "world units"),
        pub edge_floor: f64 = number(Some(0.001), FRACTION, ""),
        pub boundary_weight: f64 = number(Some(20.0), NON_NEGATIVE, ""),
        pub pixel_weights: Option<Array> = optional(Rule::Weights),
        pub map_weights: Option<Array> = optional(Rule::Weights),
        /// Layers of the frame before, whose importance is blended in (Rosen, 5.5).
        pub previous: Arc<[OldMap]> = optional(Rule::Maps),
        /// Their part.
        pub blend: f64 = number(Some(0.5), FRACTION, ""),
        /// Along each side of the importance map; `None` for as many as the map has texels along its longer side.
        pub importance_resolution: Option<u32> = count_or_none(512, MAX_CELLS, "cells"),
        pub maps: WarpedMaps,
    }
}

impl AnalysisParameters {
    /// Along each side of the importance map of a map of that size.
    pub fn cells(&self, size: MapSize) -> u32 {
        self.importance_resolution
            .unwrap_or(size.longer().min(MAX_CELLS))
    }
}

/// The functions with what the layers of a frame share.
pub struct Analysis<'p, 'a, V: Verbs<'a>> {
    importance: Functions,
    given: &'p AnalysisParameters,
    boundary: Option<Grid<V::Values>>,
    pixel_weights: Option<Grid<V::Values>>,
    map_weights: Option<Grid<V::Values>>,
}

impl<'p, 'a, V: Verbs<'a>> Analysis<'p, 'a, V> {
    /// Uploads and first passes, once for all layers.
    pub fn new(
        importance: Functions,
        given: &'p AnalysisParameters,
        view: &mut V,
        map: MapSettings,
        layers: &[Layer],
    ) -> Result<Self> {
        let camera = view.setting().camera;
        if let Some(weights) = &given.pixel_weights {
            let (rows, columns) = (camera.height as usize, camera.width as usize);
            ensure_value!(
                (weights.rows, weights.columns) == (rows, columns),
                "pixel_weights must have the shape of the image, ({rows}, {columns}), got ({}, {})",
                weights.rows,
                weights.columns
            );
        }
        let mut upload = |what, weights: &Option<Array>| {
            let uploaded = weights.as_ref().map(|weights| {
                let size = [weights.columns as u32, weights.rows as u32];
                view.weights(what, &weights.values, size)
            });
            uploaded.transpose()
        };
        let pixel_weights = upload("pixel weights", &given.pixel_weights)?;
        let map_weights = upload("map weights", &given.map_weights)?;
        let mut boundary = None;
        if importance.boundary && !layers.is_empty() {
            let small = layers
                .iter()
                .map(|layer| layer.with_resolution(given.analysis_resolution));
            let (map, small) = (map.without_filter(), small.collect());
            boundary = Some(view.boundary(map, small, given.boundary_weight)?);
        }
        Ok(Self {
            importance,
            given,
            boundary,
            pixel_weights,
            map_weights,
        })
    }

    /// What a weight of one counts, so that no cell can overflow 32 bits however the receivers fall.
    /// Exactly one receiver where there is no weight and nothing to blend in.
    pub fn count_unit(&self, pixels: usize) -> f64 {
        let greatest = |weights: &Option<Array>| {
            let values = weights.iter().flat_map(|array| array.values.iter());
            values.fold(None, |most: Option<f32>, &w| {
                Some(most.unwrap_or(0.0).max(w))
            })
        };
        let factors = [
            self.importance
                .normal
                .then_some(1.0 + self.given.normal_bonus),
            self.importance.shadow_edge.then_some(1.0),
            self.importance
                .boundary
                .then_some(self.given.boundary_weight.max(1.0)),
            greatest(&self.given.pixel_weights).map(f64::from),
            greatest(&self.given.map_weights).map(f64::from),
        ];
        let old = self.given.previous.iter().map(|map| {
            let values = map.importance.values.iter();
            values.map(|&weight| f64::from(weight)).sum::<f64>()
        });
        // A part of half of what fits: blending may gather what lies in the old map.
        let limit = 0.1 * f64::from(u32::MAX) / old.fold(f64::MIN_POSITIVE, f64::max);
        if factors.iter().all(Option::is_none) && self.given.previous.is_empty() {
            return 1.0;
        }
        let most: f64 = factors.into_iter().flatten().product();
        let sum = most.max(f64::MIN_POSITIVE) * pixels as f64;
        // Half of what fits: a float32 may round a count up.
        let limit = limit.min(0.5 * f64::from(u32::MAX) / sum);
        limit.min(256.0 / most.clamp(1e-30, 1.0))
    }

    /// Blends in the importance of the frame before, of the layer that was where this one is; see
    /// `blend_importance`.
    pub fn blend(
        &self,
        view: &mut V,
        layer: &Layer,
        map: &mut ImportanceMap<V::Values>,
        warp: Option<&V::Warp>,
    ) -> Result<()> {
        if self.given.previous.is_empty() || self.given.blend == 0.0 {
            return Ok(());
        }
        let projection = &layer.projection;
        // Only where the light moves does the depth matter: that of the receivers, or halfway to them.
        let depth = match projection.kind.is_central() {
            false => 0.0,
            true => 0.5 * projection.far,
        };
        let world = projection.world_from_texel(depth).ok_or_else(|| {
            Error::Value(
                "previous must come with a fit whose layers have a light matrix, not with paraboloids or \
                 logarithms"
                    .to_string(),
            )
        })?;
        let sides = projection.size().texels();
        let placed = self.given.previous.iter().filter_map(|old| {
            let columns = world.map(|column| {
                let place = old.map_from_world * column;
                DVec3::new(place.x, place.y, place.w)
            });
            let [x, y, origin] = columns;
            let old_from_new = DMat3::from_cols(x, y, origin) * DMat3::from_scale(sides);
            let middle = old_from_new * DVec3::new(0.5, 0.5, 1.0);
            let distance = (middle.truncate() / middle.z - 0.5).length();
            (middle.z > 0.0 && distance.is_finite()).then_some((distance, old, old_from_new))
        });
        let Some((_, old, old_from_new)) = placed.min_by(|a, b| a.0.total_cmp(&b.0)) else {
            return Ok(());
        };
        let old = OldImportance {
            values: &old.importance.values,
            columns: old.importance.columns as u32,
            rows: old.importance.rows as u32,
            old_from_new,
            share: self.given.blend,
        };
        view.blend_importance(map, old, warp)
    }

    /// What the light sees of a layer, where a factor or the direction asks for it, and its shadow edges.
    pub fn look(
        &self,
        view: &mut V,
        layer: &Layer,
        direction: Direction,
    ) -> Result<Seen<V::Analysed, V::Values>> {
        if direction == Direction::Backward {
            return Ok(Seen::default());
        }
        let analysed = view.depth_image(layer.with_resolution(self.given.analysis_resolution))?;
        // A light's image of a slope has steps of about a texel; what is beyond them is an edge.
        let bias = self
            .given
            .edge_bias
            .map_or(EdgeBias::Texels(2.0), EdgeBias::Constant);
        let has_edges = self.importance.shadow_edge;
        let edges = has_edges.then(|| view.shadow_edges(&analysed, bias, self.given.edge_floor));
        Ok(Seen {
            edges: edges.transpose()?,
            analysed: Some(analysed),
        })
    }

    pub fn factors<'f>(&'f self, seen: &'f Seen<V::Analysed, V::Values>) -> Factors<'f, V::Values> {
        Factors {
            distance: self.importance.distance,
            normal: self.importance.normal.then_some(self.given.normal_bonus),
            shadow_edge: seen.edges.as_ref(),
            boundary: self.boundary.as_ref(),
            pixel_weights: self.pixel_weights.as_ref(),
            map_weights: self.map_weights.as_ref(),
        }
    }
}

/// What the light sees of a layer.
pub struct Seen<Analysed, Values> {
    pub analysed: Option<Analysed>,
    edges: Option<Grid<Values>>,
}

impl<Analysed, Values> Default for Seen<Analysed, Values> {
    fn default() -> Self {
        Self {
            analysed: None,
            edges: None,
        }
    }
}
