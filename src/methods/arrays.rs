//! Arrays as values of parameters: what each holds, and which ones are refused.

use crate::error::Result;
use crate::warp::MAX_CELLS;
use crate::warp::tables::{MAX_SAMPLES, Table};
use glam::DMat4;
use std::sync::Arc;

/// Why a value is refused.
#[derive(Debug, Clone, PartialEq)]
pub enum Fault {
    /// It is of the wrong kind.
    Kind,
    /// It is of the right kind and out of range.
    Range,
    /// This part of it is.
    RangeOf(String),
}

impl Fault {
    pub(super) fn unless(holds: bool) -> Result<(), Self> {
        if holds { Ok(()) } else { Err(Self::Range) }
    }
}

/// Functions of warps along x, one for each band of rows, and along y, one for each band of columns: values at the
/// boundaries of cells, from 0 to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct WarpFunctions {
    /// `None`: the same for every layer.
    pub layers: Option<usize>,
    /// Along each axis.
    pub functions: usize,
    pub boundaries: usize,
    pub values: Arc<[f32]>,
}

/// Where the rays of a map's texels are before its warp.
#[derive(Debug, Clone, PartialEq)]
pub struct WarpSamples {
    /// Whether there is one for each layer, or one for all.
    pub is_of_layers: bool,
    pub tables: Arc<[Table]>,
}

/// What a layer of the frame before leaves to the next one.
#[derive(Debug, Clone, PartialEq)]
pub struct OldMap {
    pub importance: Array,
    /// (x, y, depth, w) from a point in the world, x and y from 0 to 1 in the map.
    pub map_from_world: DMat4,
}

/// Numbers in rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    pub rows: usize,
    pub columns: usize,
    pub values: Arc<[f32]>,
}

impl WarpFunctions {
    /// Refuses what is no warp.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let cells = self.boundaries.saturating_sub(1);
        if !(1..=cells).contains(&self.functions) || cells > MAX_CELLS as usize {
            let (functions, boundaries) = (self.functions, self.boundaries);
            return Err(Fault::RangeOf(format!(
                "{functions} functions of {boundaries} values"
            )));
        }
        for (i, values) in self.values.chunks_exact(self.boundaries).enumerate() {
            let fault = |what: String| {
                let (layer, axis) = (i / (2 * self.functions), i / self.functions % 2);
                let (axis, function) = (["x", "y"][axis], i % self.functions);
                Err(Fault::RangeOf(format!(
                    "{what} in function {function} along {axis} of layer {layer}"
                )))
            };
            // Written so that NaN falls, too.
            if let Some(pair) = values
                .windows(2)
                .find(|pair| !matches!(pair, [a, b] if a <= b))
            {
                return fault(format!("{} after {}", pair[1], pair[0]));
            }
            let (first, last) = (values[0], values[cells]);
            if first != 0.0 || last != 1.0 {
                return fault(format!("values from {first} to {last}"));
            }
        }
        Ok(())
    }
}

impl WarpSamples {
    /// `None`: the same for every layer.
    pub fn layers(&self) -> Option<usize> {
        self.is_of_layers.then_some(self.tables.len())
    }

    /// Refuses what has no inverse.
    pub(super) fn check(&self) -> Result<(), Fault> {
        for (layer, table) in self.tables.iter().enumerate() {
            let sides = [table.columns, table.rows];
            if !sides.iter().all(|side| (2..=MAX_SAMPLES).contains(side)) {
                let [columns, rows] = sides;
                return Err(Fault::RangeOf(format!("{rows} rows of {columns} places")));
            }
            if let Some(fault) = table.fault() {
                return Err(Fault::RangeOf(format!("{fault} of layer {layer}")));
            }
        }
        Ok(())
    }
}

impl Array {
    /// Refuses what is no array of weights.
    pub(super) fn check(&self) -> Result<(), Fault> {
        if self.values.is_empty() {
            let (rows, columns) = (self.rows, self.columns);
            return Err(Fault::RangeOf(format!("shape ({rows}, {columns})")));
        }
        let is_weight = |value: &&f32| value.is_finite() && **value >= 0.0;
        match self.values.iter().find(|value| !is_weight(value)) {
            Some(wrong) => Err(Fault::RangeOf(wrong.to_string())),
            None => Ok(()),
        }
    }
}
