//! What a receiver is worth to a warp, in words that both engines know.

use crate::projection::Projection;
use crate::warp::Axis;
use glam::{DMat3, DVec2};

/// Numbers in rows, in the memory of an engine.
#[derive(Debug, Clone)]
pub struct Grid<V> {
    pub values: V,
    pub columns: u32,
    pub rows: u32,
}

/// What a cell is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Importance {
    /// How much the receivers in it weigh, where a weight of one counts `unit`: in rows of cells along x,
    /// or in columns of cells along y once the receivers went through the warp's functions along x.
    Count { along: Axis, unit: f64 },
    /// The greatest importance of a receiver in it.
    Maximum,
}

/// The factors of a receiver's importance (Rosen, section 5); every receiver is in the desired view.
pub struct Factors<'a, V> {
    /// One over the distance along the viewing direction (5.2).
    pub distance: bool,
    /// The surface normal (5.4), with its bonus beta.
    pub normal: Option<f64>,
    /// A factor for each texel of an image from the light (5.3).
    pub shadow_edge: Option<&'a Grid<V>>,
    /// A factor for each [`BOUNDARY_BLOCK`] of pixels.
    pub boundary: Option<&'a Grid<V>>,
    /// A factor for each pixel.
    pub pixel_weights: Option<&'a Grid<V>>,
    /// A factor for each cell of a grid over the light's map.
    pub map_weights: Option<&'a Grid<V>>,
}

impl<V> Factors<'_, V> {
    /// Every receiver is worth the same.
    pub const NONE: Self = Self {
        distance: false,
        normal: None,
        shadow_edge: None,
        boundary: None,
        pixel_weights: None,
        map_weights: None,
    };

    /// Whether there is one beside the distance.
    pub fn has_more_than_distance(&self) -> bool {
        let weights = [
            self.shadow_edge,
            self.boundary,
            self.pixel_weights,
            self.map_weights,
        ];
        self.normal.is_some() || weights.iter().any(Option::is_some)
    }
}

impl<V> Clone for Factors<'_, V> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<V> Copy for Factors<'_, V> {}

/// Pixels along each side of a block that is near the boundary of a shadow or is not, as in `shaders/boundary.wgsl`.
pub const BOUNDARY_BLOCK: u32 = 4;

/// Importance of the cells of a square, row by row or, as counts along y, column by column.
pub struct ImportanceMap<V> {
    /// Words of 32 bits.
    pub values: V,
    /// Along each side.
    pub cells: u32,
    /// What a weight of one counts where a cell holds a count; else it holds the bits of a float32.
    pub count_unit: Option<f64>,
}

impl<V> ImportanceMap<V> {
    pub fn value_from_bits(&self, bits: u32) -> f32 {
        match self.count_unit {
            Some(unit) => (f64::from(bits) / unit) as f32,
            None => f32::from_bits(bits),
        }
    }
}

/// By how much the depths of neighbours differ at an edge.
#[derive(Debug, Clone, Copy)]
pub enum EdgeBias {
    /// World units.
    Constant(f64),
    /// Widths of a texel.
    Texels(f64),
}

impl EdgeBias {
    /// Depth, with `unit` to the world's: a constant, and what it is per growth of a texel's beam.
    pub fn depths(self, projection: &Projection, unit: f64) -> [f64; 2] {
        match self {
            Self::Constant(length) => [length * unit, 0.0],
            Self::Texels(count) => [0.0, count * projection.kind.beam_width(projection)],
        }
    }
}

/// The importance map of the frame before.
#[derive(Clone, Copy)]
pub struct OldImportance<'a> {
    pub values: &'a [f32],
    pub columns: u32,
    pub rows: u32,
    /// Its sides from those of the new map, both from 0 to 1, homogeneous.
    pub old_from_new: DMat3,
    /// Its part of the blended map.
    pub share: f64,
}

impl OldImportance<'_> {
    /// The same from cells to cells.
    pub fn old_from_new_cells(&self, cells: u32) -> DMat3 {
        let sides = |columns: u32, rows: u32| DVec2::new(f64::from(columns), f64::from(rows));
        let to_old = DMat3::from_scale(sides(self.columns, self.rows));
        let from_new = DMat3::from_scale(sides(cells, cells).recip());
        to_old * self.old_from_new * from_new
    }
}
