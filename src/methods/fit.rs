//! The fit that a warp is laid over.

use super::lispsm::LightSpacePerspective;
use super::prelude::*;
use super::scene_optimized::SceneOptimized;
use super::{cube, dual_paraboloid, spot};
use crate::fits::improved_paraboloid::{Zoom, fit_improved_paraboloid};
use glam::DMat3;

/// The maps around the receivers, for a cut and a resolution. A layer without receivers is left out.
type Layers = fn(&mut dyn FitQueries<'_>, Cut, u32) -> Result<Vec<Layer>>;

/// Which maps there are, before they are warped.
#[derive(Clone, Copy)]
pub struct Fit {
    /// Its maps do not turn with the receivers, so that their texels can hold still.
    pub holds_still: bool,
    pub layers: Layers,
}

const fn still(layers: Layers) -> Fit {
    Fit {
        holds_still: true,
        layers,
    }
}

const fn turning(layers: Layers) -> Fit {
    Fit {
        holds_still: false,
        layers,
    }
}

/// The maps that are warped.
pub const FITS: Choices<Fit> = &[
    // The light's own: one map for parallel rays or a cone, faces of a cube for a point.
    (
        "desired_view",
        still(|view, cut, size| fit_boxes(view, Turn::Still, cut, size)),
    ),
    // The same, turned as the smallest rectangle around the receivers.
    (
        "min_sm",
        turning(|view, cut, size| fit_boxes(view, Turn::SmallestRectangle, cut, size)),
    ),
    // The same, turned along the principal axes of the receivers.
    (
        "principal_axes",
        turning(|view, cut, size| fit_boxes(view, Turn::PrincipalAxes, cut, size)),
    ),
    (
        "lispsm",
        turning(|view, _, size| LightSpacePerspective::defaults().fit(view, size)),
    ),
    (
        "scene_optimized",
        turning(|view, _, size| SceneOptimized::defaults().fit(view, size)),
    ),
    (
        "cube",
        still(|view, cut, size| cube::fit(view, DMat3::IDENTITY, cut, size)),
    ),
    (
        "dual_paraboloid",
        still(|view, cut, size| dual_paraboloid::fit(view, cut, size)),
    ),
    (
        "improved_paraboloid",
        turning(|view, _, size| fit_improved_paraboloid(view, Zoom::Receivers, size)),
    ),
    ("spot", still(|view, cut, size| spot::fit(view, cut, size))),
];
