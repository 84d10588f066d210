//! The fit that a warp is laid over.

use super::lispsm::LightSpacePerspective;
use super::prelude::*;
use super::scene_optimized::SceneOptimized;
use super::{cube, dual_paraboloid, spot};
use crate::fits::improved_paraboloid::{Zoom, fit_improved_paraboloid};
use glam::DMat3;

/// Which maps there are, before their sides are fitted to the receivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The light's own: one map for parallel rays or a cone, faces of a cube for a point.
    DesiredView,
    /// The same, turned as the smallest rectangle around the receivers.
    MinSm,
    /// The same, turned along the principal axes of the receivers.
    PrincipalAxes,
    /// With the perspective of `lispsm`.
    LightSpacePerspective,
    /// With the light matrix of `scene_optimized`.
    SceneOptimized,
    /// Six faces of a cube around the light.
    Cube,
    /// Two paraboloids back to back.
    DualParaboloid,
    /// A paraboloid that looks at the receivers.
    ImprovedParaboloid,
    /// One map along the axis of a spot light.
    Spot,
}

/// The maps that are warped.
pub const FITS: Choices<Fit> = &[
    ("desired_view", Fit::DesiredView),
    ("min_sm", Fit::MinSm),
    ("principal_axes", Fit::PrincipalAxes),
    ("lispsm", Fit::LightSpacePerspective),
    ("scene_optimized", Fit::SceneOptimized),
    ("cube", Fit::Cube),
    ("dual_paraboloid", Fit::DualParaboloid),
    ("improved_paraboloid", Fit::ImprovedParaboloid),
    ("spot", Fit::Spot),
];

impl Fit {
    /// The maps around the receivers. A layer without receivers is left out.
    pub fn fit(self, view: &mut View, snaps: bool, resolution: u32) -> Result<Vec<Layer>> {
        let cut = Cut::Receivers.snapped_where(snaps);
        match self {
            Self::DesiredView => fit_boxes(view, Turn::Still, cut, resolution),
            Self::MinSm => fit_boxes(view, Turn::SmallestRectangle, cut, resolution),
            Self::PrincipalAxes => fit_boxes(view, Turn::PrincipalAxes, cut, resolution),
            Self::LightSpacePerspective => {
                let mut method = LightSpacePerspective::defaults();
                method.map.resolution = resolution;
                method.fit(view)
            }
            Self::SceneOptimized => {
                let mut method = SceneOptimized::defaults();
                method.map.resolution = resolution;
                method.fit(view)
            }
            Self::Cube => cube::fit(view, DMat3::IDENTITY, cut, resolution),
            Self::DualParaboloid => dual_paraboloid::fit(view, cut, resolution),
            Self::ImprovedParaboloid => fit_improved_paraboloid(view, Zoom::Receivers, resolution),
            Self::Spot => spot::fit(view, cut, resolution),
        }
    }
}
