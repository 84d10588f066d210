//! The fit that a warp is laid over.

use super::cascades::Cascades;
use super::focused::Focused;
use super::lispsm::LightSpacePerspective;
use super::log_psm::LogPerspective;
use super::plane_optimal::PlaneOptimal;
use super::prelude::*;
use super::psm::Perspective;
use super::scene_optimized::SceneOptimized;
use super::schema::{Typed, Value, chosen};
use super::trapezoidal::Trapezoidal;
use super::{cube, dual_paraboloid, spot};
use crate::fits::cascades::{Slabs, fit_cascades};
use crate::fits::given::{GivenLayers, fit_given};
use crate::fits::improved_paraboloid::{Splitting, Zoom, fit_improved_paraboloid};
use crate::fits::rotation::Rotation;
use crate::fits::uniform::fit_scene_of_receivers;
use glam::DMat3;
use std::borrow::Cow;

/// What the maps of a fit are made for.
#[derive(Clone, Copy)]
pub struct Wanted {
    pub cut: Cut,
    pub rotation: Rotation,
    pub size: MapSize,
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
            fit_boxes(view, turn, wanted.cut, wanted.size)
        }),
    ),
    // Over the whole scene.
    (
        "uniform",
        rotating(|view, wanted| fit_scene_of_receivers(view, wanted.rotation, wanted.size)),
    ),
    // The same as the first, turned as the smallest rectangle around the receivers.
    (
        "min_sm",
        turning(|view, wanted| fit_boxes(view, Turn::SmallestRectangle, wanted.cut, wanted.size)),
    ),
    // The same, turned along the principal axes of the receivers.
    (
        "principal_axes",
        turning(|view, wanted| fit_boxes(view, Turn::PrincipalAxes, wanted.cut, wanted.size)),
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
            fit_cascades(view, slabs, wanted.size)
        }),
    ),
    (
        "focused",
        turning(|view, wanted| Focused::defaults().fit(view, wanted.size)),
    ),
    (
        "psm",
        turning(|view, wanted| Perspective::defaults().fit(view, wanted.size)),
    ),
    (
        "plane_optimal",
        turning(|view, wanted| PlaneOptimal::defaults().fit(view, wanted.size)),
    ),
    (
        "lispsm",
        turning(|view, wanted| LightSpacePerspective::defaults().fit(view, wanted.size)),
    ),
    (
        "log_psm",
        turning(|view, wanted| LogPerspective::defaults().fit(view, wanted.size)),
    ),
    (
        "trapezoidal",
        turning(|view, wanted| Trapezoidal::defaults().fit(view, wanted.size)),
    ),
    (
        "scene_optimized",
        turning(|view, wanted| SceneOptimized::defaults().fit(view, wanted.size)),
    ),
    (
        "cube",
        still(|view, wanted| cube::fit(view, DMat3::IDENTITY, wanted.cut, wanted.size)),
    ),
    (
        "dual_paraboloid",
        still(|view, wanted| dual_paraboloid::fit(view, wanted.cut, Splitting::Light, wanted.size)),
    ),
    (
        "improved_paraboloid",
        turning(|view, wanted| {
            fit_improved_paraboloid(view, Zoom::Receivers, Splitting::Light, wanted.size)
        }),
    ),
    (
        "spot",
        still(|view, wanted| spot::fit(view, wanted.cut, wanted.size)),
    ),
];

/// The maps that are warped: of a fit, or of matrices that somebody gives.
#[derive(Debug, Clone)]
pub enum Fitted {
    By(Cow<'static, str>),
    Given(GivenLayers),
}

impl Typed for Fitted {
    fn typed(value: &Value) -> Self {
        match value {
            Value::Layers(layers) => Self::Given(layers.clone()),
            other => Self::By(Cow::typed(other)),
        }
    }
}

impl Fitted {
    /// Whether its maps can do something.
    fn can(&self, does: fn(&Fit) -> bool) -> bool {
        match self {
            Self::By(word) => does(&chosen(word, FITS)),
            Self::Given(_) => false,
        }
    }
}

parameters! {
    /// Of the maps that are warped.
    pub struct WarpedMaps {
        pub fit: Fitted = word("desired_view", Rule::Fit(&FITS)),
        pub snap: bool = SNAP,
        pub rotation: Option<f64> = ROTATION,
    }
}

impl WarpedMaps {
    /// The texels of a map that turns with the receivers cannot hold still while they move, and a map has one rotation.
    pub fn check(&self) -> Result<()> {
        let those = |can: fn(&Fit) -> bool| {
            let words = FITS.iter().filter(|(_, fit)| can(fit));
            let words: Vec<_> = words.map(|(word, _)| format!("'{word}'")).collect();
            words.join(", ")
        };
        let got = match &self.fit {
            Fitted::By(word) => format!("'{word}'"),
            Fitted::Given(_) => "a lixel.LightMatrix".to_string(),
        };
        ensure_value!(
            !self.snap || self.fit.can(|fit| fit.holds_still),
            "snap must come with one of the fits {}, whose maps do not turn with the receivers, got {got}",
            those(|fit| fit.holds_still)
        );
        ensure_value!(
            self.rotation.is_none() || self.fit.can(|fit| fit.rotates),
            "rotation must come with one of the fits {}, whose maps no other rule rotates, got {got}",
            those(|fit| fit.rotates)
        );
        Ok(())
    }

    pub fn layers(&self, view: &mut dyn FitQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        let wanted = Wanted {
            cut: Cut::Receivers.snapped_where(self.snap),
            rotation: self.rotation.into(),
            size,
        };
        match &self.fit {
            Fitted::By(word) => (chosen(word, FITS).layers)(view, wanted),
            Fitted::Given(layers) => fit_given(view, layers, size),
        }
    }
}
