//! The fit that a warp is laid over.

use super::cascades::Cascades;
use super::focused::Focused;
use super::lispsm::LightSpacePerspective;
use super::plane_optimal::PlaneOptimal;
use super::prelude::*;
use super::psm::Perspective;
use super::scene_optimized::SceneOptimized;
use super::{cube, dual_paraboloid, spot};
use crate::fits::cascades::{Slabs, fit_cascades};
use crate::fits::improved_paraboloid::{Splitting, Zoom, fit_improved_paraboloid};
use crate::fits::rotation::Rotation;
use crate::fits::uniform::fit_scene_of_receivers;
use glam::DMat3;

/// What the maps of a fit are made for.
#[derive(Clone, Copy)]
pub struct Wanted {
    pub cut: Cut,
    pub rotation: Rotation,
    pub resolution: u32,
}

/// The maps around the receivers. A layer without receivers is left out.
type Layers = fn(&mut dyn FitQueries<'_>, Wanted) -> Result<Vec<Layer>>;

/// Which maps there are, before they are warped.
#[derive(Clone, Copy)]
pub struct Fit {
    /// Its maps do not turn with the receivers, so that their texels can hold still.
    pub holds_still: bool,
    /// They take a rotation of the light's plane.
    pub rotates: bool,
    pub layers: Layers,
}

const fn still(layers: Layers) -> Fit {
    Fit {
        holds_still: true,
        rotates: false,
        layers,
    }
}

const fn turning(layers: Layers) -> Fit {
    Fit {
        holds_still: false,
        ..still(layers)
    }
}

const fn rotating(layers: Layers) -> Fit {
    Fit {
        rotates: true,
        ..still(layers)
    }
}

/// The maps that are warped.
pub const FITS: Choices<Fit> = &[
    // The light's own: one map for parallel rays or a cone, faces of a cube for a point.
    (
        "desired_view",
        rotating(|view, wanted| {
            let turn = Turn::Still(wanted.rotation);
            fit_boxes(view, turn, wanted.cut, wanted.resolution)
        }),
    ),
    // Over the whole scene.
    (
        "uniform",
        rotating(|view, wanted| fit_scene_of_receivers(view, wanted.rotation, wanted.resolution)),
    ),
    // The same as the first, turned as the smallest rectangle around the receivers.
    (
        "min_sm",
        turning(|view, wanted| {
            fit_boxes(view, Turn::SmallestRectangle, wanted.cut, wanted.resolution)
        }),
    ),
    // The same, turned along the principal axes of the receivers.
    (
        "principal_axes",
        turning(|view, wanted| fit_boxes(view, Turn::PrincipalAxes, wanted.cut, wanted.resolution)),
    ),
    // In each slab of the view.
    (
        "cascades",
        rotating(|view, wanted| {
            let slabs = Slabs {
                snaps: wanted.cut == Cut::Snapped,
                rotation: wanted.rotation,
                ..Cascades::defaults().slabs()
            };
            fit_cascades(view, slabs, wanted.resolution)
        }),
    ),
    (
        "focused",
        turning(|view, wanted| Focused::defaults().fit(view, wanted.resolution)),
    ),
    (
        "psm",
        turning(|view, wanted| Perspective::defaults().fit(view, wanted.resolution)),
    ),
    (
        "plane_optimal",
        turning(|view, wanted| PlaneOptimal::defaults().fit(view, wanted.resolution)),
    ),
    (
        "lispsm",
        turning(|view, wanted| LightSpacePerspective::defaults().fit(view, wanted.resolution)),
    ),
    (
        "scene_optimized",
        turning(|view, wanted| SceneOptimized::defaults().fit(view, wanted.resolution)),
    ),
    (
        "cube",
        still(|view, wanted| cube::fit(view, DMat3::IDENTITY, wanted.cut, wanted.resolution)),
    ),
    (
        "dual_paraboloid",
        still(|view, wanted| {
            dual_paraboloid::fit(view, wanted.cut, Splitting::Light, wanted.resolution)
        }),
    ),
    (
        "improved_paraboloid",
        turning(|view, wanted| {
            fit_improved_paraboloid(view, Zoom::Receivers, Splitting::Light, wanted.resolution)
        }),
    ),
    (
        "spot",
        still(|view, wanted| spot::fit(view, wanted.cut, wanted.resolution)),
    ),
];
