//! The smoothing of a non-orthogonal warp: a number that somebody sets, or the one that suits the view.
//!
//! The papers set it by hand for each scene, and leave open how to find it (J. Navrátil's thesis, 5.4.1): with little
//! smoothing, straight edges between warped corners miss their places; with much, the texels are not where the receivers
//! are. Of a few the one is taken by which an estimate says that the fewest pixels are wrong.

use super::prelude::*;
use super::schema::{Parameter, Typed, Value, number_or_word};
use crate::gpu::passes::warp_map;
use crate::importance::{Factors, Importance};
use crate::map_size::Axis;
use crate::warp::smoothing::{SHARES, estimate};
use glam::DVec2;
use std::time::Instant;

/// Receivers that the estimate is made from, along the longer side of the image.
const SAMPLES: u32 = 200;

/// What is measured by it.
const MEASURE: &str = "smoothing";

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Smoothing {
    /// A standard deviation.
    Cells(f64),
    Automatic,
}

pub const SMOOTHING: Parameter = number_or_word(NON_NEGATIVE, &["automatic"], "cells");

impl Typed for Smoothing {
    fn typed(value: &Value) -> Self {
        match value {
            Value::Text(_) => Self::Automatic,
            number => Self::Cells(f64::typed(number)),
        }
    }
}

/// The standard deviation that suits the view, in cells; `warp_of` fits the functions of a layer with one.
pub fn automatic<'a, V: Verbs<'a>>(
    view: &mut V,
    layers: &[Layer],
    cells: u32,
    mut warp_of: impl FnMut(&mut V, &Layer, usize, f64) -> Result<V::Warp>,
) -> Result<f64> {
    let tried = SHARES.map(|share| share * f64::from(cells));
    let mut errors = [0.0; SHARES.len()];
    let samples = match layers.is_empty() {
        true => None,
        false => Some(view.samples(SAMPLES)?),
    };
    for (i, layer) in layers.iter().enumerate() {
        let places = places_in(layer, samples.iter().flat_map(|s| s.points_in_light()));
        if places.is_empty() {
            continue;
        }
        let counted = Importance::Count {
            along: Axis::X,
            unit: 1.0,
        };
        let counts = view.importance_map(layer, cells, counted, Factors::NONE, None)?;
        let counts = view.read_importance(&counts)?;
        for (error, smoothing) in errors.iter_mut().zip(tried) {
            let warp = warp_of(view, layer, i, smoothing)?;
            let warp = view.read_functions(&warp)?;
            let start = Instant::now();
            *error += estimate(&warp, &counts, &places, layer.projection.size().texels());
            view.add_time(warp_map::LABEL, start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let pairs = tried.into_iter().zip(errors);
    let best = pairs.min_by(|a, b| a.1.total_cmp(&b.1));
    let best = best.expect("some are tried").0;
    view.measure(MEASURE, best);
    Ok(best)
}

/// Where a layer has the points that it is for, from 0 to 1 in its map before any warp.
fn places_in(layer: &Layer, points: impl Iterator<Item = glam::DVec3>) -> Vec<DVec2> {
    let projection = &layer.projection;
    let side = projection.size().texels();
    let own = points.filter(|point| layer.region.contains(*point));
    let places = own.map(|point| projection.texel_from_point(point).truncate() / side);
    // Rounding may leave one at the border.
    let inside = places.filter(|place| (place - 0.5).abs().max_element() < 0.501);
    inside
        .map(|place| place.clamp(DVec2::ZERO, DVec2::ONE))
        .collect()
}
