//! How many texels a shadow map has along its rows and its columns.

use glam::DVec2;
use std::fmt;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
}

/// Texels of a shadow map: how many columns and how many rows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct MapSize {
    pub width: u32,
    pub height: u32,
}

impl MapSize {
    /// As many rows as columns.
    pub const fn square(side: u32) -> Self {
        Self {
            width: side,
            height: side,
        }
    }

    pub fn is_square(self) -> bool {
        self.width == self.height
    }

    /// As many columns as this has rows.
    pub fn transposed(self) -> Self {
        Self {
            width: self.height,
            height: self.width,
        }
    }

    /// Columns and rows, for arithmetic.
    pub fn texels(self) -> DVec2 {
        DVec2::new(f64::from(self.width), f64::from(self.height))
    }

    /// The place in the middle, in texels.
    pub fn middle(self) -> DVec2 {
        0.5 * self.texels()
    }

    /// Texels along an axis.
    pub fn along(self, axis: Axis) -> u32 {
        match axis {
            Axis::X => self.width,
            Axis::Y => self.height,
        }
    }

    /// Texels along the longer side.
    pub fn longer(self) -> u32 {
        self.width.max(self.height)
    }

    /// Columns for one row.
    pub fn aspect(self) -> f64 {
        f64::from(self.width) / f64::from(self.height)
    }

    /// Whether what is so wide and so high had better be turned by a quarter: its longer side lies along the fewer
    /// texels. Never in a square.
    pub fn lies_across(self, sides: DVec2) -> bool {
        match self.width.cmp(&self.height) {
            std::cmp::Ordering::Less => sides.x > sides.y,
            std::cmp::Ordering::Equal => false,
            std::cmp::Ordering::Greater => sides.x < sides.y,
        }
    }
}

/// As a user writes it: one number of a square.
impl fmt::Display for MapSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.is_square() {
            true => write!(f, "{}", self.width),
            false => write!(f, "{} x {}", self.width, self.height),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_long_lies_along_the_more_texels() {
        let wide = MapSize {
            width: 8,
            height: 2,
        };
        let high = wide.transposed();
        let (long, even) = (DVec2::new(3.0, 1.0), DVec2::ONE);
        assert!(!wide.lies_across(long) && wide.lies_across(long.perp().abs()));
        assert!(high.lies_across(long) && !high.lies_across(long.perp().abs()));
        for size in [wide, high, MapSize::square(4)] {
            assert!(!size.lies_across(even));
        }
        assert!(!MapSize::square(4).lies_across(long));
        assert_eq!(wide.to_string(), "8 x 2");
        assert_eq!(MapSize::square(4).to_string(), "4");
        assert_eq!([Axis::X, Axis::Y].map(|axis| wide.along(axis)), [8, 2]);
    }
}
