//! A layer of a shadow map: what a fit makes.

use crate::map_size::MapSize;
use crate::projection::Projection;
use crate::region::Region;

/// Where a layer of a shadow map lies: which receivers it is for, and where it takes them.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    pub projection: Projection,
    pub region: Region,
}

impl Layer {
    /// A layer for every receiver.
    pub fn everywhere(projection: Projection) -> Self {
        Self {
            projection,
            region: Region::EVERYWHERE,
        }
    }

    /// The same layer in a square of texels.
    pub fn with_resolution(&self, side: u32) -> Self {
        self.with_size(MapSize::square(side))
    }

    /// The same layer in another number of texels.
    pub fn with_size(&self, size: MapSize) -> Self {
        Self {
            projection: self.projection.with_size(size),
            region: self.region.clone(),
        }
    }
}
