//! The holes of a masked triangle as an image or a map sees them.

use super::lanes::{EPSILON, bits};
use super::view::{Planes, View};
use crate::masks::{Mask, Solidity};
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// Column and row in the alpha image and the factor of alpha, each times the last: linear functions of (column, row, 1),
/// relative to a place of the view. The edges' values are the corners' shares of the point that is seen.
#[derive(Debug, Clone, Copy)]
pub struct Holes<'a> {
    mask: Mask<'a>,
    values: [DVec3; 3],
    sum: DVec3,
}

impl<'a> Holes<'a> {
    /// `None` where the triangle has none.
    #[inline]
    pub fn new(view: &View, scene: &'a Scene, triangle: u32, origin: DVec2) -> Option<Self> {
        let mask = scene.mask_of(triangle)?;
        Self::of_mask(mask, view, scene, triangle, origin)
    }

    fn of_mask(
        mask: Mask<'a>,
        view: &View,
        scene: &Scene,
        triangle: u32,
        origin: DVec2,
    ) -> Option<Self> {
        let edges = Planes::new(view, scene, triangle, origin)?.edges;
        let [a, b, c] = *mask.corners;
        let value = |k: usize| edges[0] * a[k] + edges[1] * b[k] + edges[2] * c[k];
        Some(Self {
            mask,
            values: [value(0), value(1), value(2)],
            sum: edges[0] + edges[1] + edges[2],
        })
    }

    pub fn has_at(&self, place: DVec2) -> bool {
        !self.mask.is_solid_at(self.at(place))
    }

    /// Column, row and factor in the alpha image.
    fn at(&self, place: DVec2) -> DVec3 {
        let place = place.extend(1.0);
        DVec3::from_array(self.values.map(|value| value.dot(place))) / self.sum.dot(place)
    }

    /// Of receivers that float32 finds to be certainly, and maybe, behind the triangle: those that are so with its holes,
    /// too. Places are relative to the origin, and may be off by as much as rounding moves a corner.
    pub fn sort(
        &self,
        (hit, maybe): (u32, u32),
        places: (&[f32], &[f32]),
        rounding: f32,
    ) -> (u32, u32) {
        let (mut hit, mut maybe) = (hit, maybe | hit);
        for i in bits(maybe) {
            let place = DVec2::new(f64::from(places.0[i]), f64::from(places.1[i]));
            let off = f64::from(rounding) + f64::from(EPSILON) * place.abs().element_sum();
            match self.solidity(place, off) {
                Solidity::Solid => {}
                Solidity::Hole => (hit, maybe) = (hit & !(1 << i), maybe & !(1 << i)),
                Solidity::Open(_) => hit &= !(1 << i),
            }
        }
        (hit, maybe)
    }

    /// Whether the triangle is there at a place that may be off.
    fn solidity(&self, place: DVec2, off: f64) -> Solidity {
        let steepness = |plane: DVec3| plane.x.abs() + plane.y.abs();
        let sum = self.sum.dot(place.extend(1.0)).abs();
        let at = self.at(place);
        // Twice, for what a quotient adds while its divisor moves by no more than half.
        let of_sum = 2.0 * off * steepness(self.sum) / sum;
        if of_sum > 1.0 {
            return Solidity::Open(false);
        }
        let of_values = self.values.map(|value| 2.0 * off * steepness(value) / sum);
        let reach = DVec3::from_array(of_values) + at.abs() * of_sum;
        self.mask.solidity_at(at, reach)
    }
}
