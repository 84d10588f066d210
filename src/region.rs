//! Regions: which receivers a layer of a map is for.

use glam::{DVec3, DVec4};

/// A half-space of the world: points with `normal * (point - origin) >= 0`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    pub origin: DVec3,
    pub normal: DVec3,
}

/// At most this many half-spaces: the sides of a pyramid, and one that parts it.
pub const MAX_HALF_SPACES: usize = 5;

/// Where some half-spaces meet; everywhere, if there are none.
#[derive(Debug, Clone, PartialEq)]
pub struct Region(Vec<HalfSpace>);

impl HalfSpace {
    /// Where a function `(n, d)` of homogeneous points is not negative; `None` where it is the same everywhere.
    pub fn of_function(function: DVec4) -> Option<Self> {
        let length = function.truncate().length();
        let normal = function.truncate() / length;
        let origin = -normal * (function.w / length);
        origin.is_finite().then_some(Self { origin, normal })
    }

    /// Of a point above its border, in lengths of the normal; not negative inside.
    pub fn height(&self, point: DVec3) -> f64 {
        self.normal.dot(point - self.origin)
    }

    /// The other side of its border.
    pub fn opposite(self) -> Self {
        Self {
            normal: -self.normal,
            ..self
        }
    }
}

impl Region {
    pub const EVERYWHERE: Self = Self(Vec::new());

    /// # Panics
    /// If there are more than [`MAX_HALF_SPACES`].
    pub fn new(half_spaces: Vec<HalfSpace>) -> Self {
        assert!(half_spaces.len() <= MAX_HALF_SPACES);
        Self(half_spaces)
    }

    pub fn half_spaces(&self) -> &[HalfSpace] {
        &self.0
    }

    pub fn is_everywhere(&self) -> bool {
        self.0.is_empty()
    }

    pub fn contains(&self, point: DVec3) -> bool {
        self.0.iter().all(|half| half.height(point) >= 0.0)
    }

    /// The part of it that is in a half-space, too.
    pub fn with(&self, half: HalfSpace) -> Self {
        Self::new(self.0.iter().copied().chain([half]).collect())
    }

    /// The greatest distance of its half-spaces' origins from a point.
    pub fn farthest_origin(&self, point: DVec3) -> f64 {
        let distances = self.0.iter().map(|half| half.origin.distance(point));
        distances.fold(0.0, f64::max)
    }

    /// Planes for the shaders, (normal, offset) relative to the eye. Each is moved out by `slack`: a
    /// point at the border that rounding would put into no region is in both.
    pub fn planes(&self, eye: DVec3, slack: f64) -> [[f32; 4]; MAX_HALF_SPACES] {
        std::array::from_fn(|i| {
            self.0.get(i).map_or([0.0; 4], |half| {
                let offset = half.height(eye) + slack;
                let plane: DVec4 = half.normal.extend(offset);
                plane.as_vec4().to_array()
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn everywhere_has_no_end_and_half_spaces_meet() {
        assert!(Region::EVERYWHERE.contains(DVec3::splat(1e9)));
        let half = |normal| HalfSpace {
            origin: DVec3::ONE,
            normal,
        };
        let region = Region::new(vec![half(DVec3::X), half(DVec3::Y)]);
        assert!(region.contains(DVec3::new(1.0, 2.0, -5.0)));
        assert!(!region.contains(DVec3::new(0.9, 2.0, 0.0)));
        let plane = region.planes(DVec3::new(3.0, 0.0, 0.0), 0.5)[0];
        assert_eq!(plane, [1.0, 0.0, 0.0, 2.5]);
    }
}
