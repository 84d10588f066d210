//! Exact: an irregular z-buffer. No pixel is wrong, and nothing is kept between frames, so that geometry
//! may move.
//!
//! A shadow map settles most receivers that are in shadow: the triangle in their texel meets their own
//! light ray. The others are listed in the texels of the light's grid that they fall in; each caster is
//! tested against the receivers in the texels that it may touch, in each receiver's own light ray. Where
//! many receivers share a texel the lists grow long; a warp spreads them evenly.
//!
//! Gregory Johnson, Juhyun Lee, Christopher Burns, William Mark. The irregular Z-buffer: hardware
//! acceleration for irregular data structures. ACM TOG 24(4), 2005. Timo Aila, Samuli Laine. Alias-free
//! shadow maps. EGSR 2004. The warps are those of `notw` and `rtw`.
//!
//! Parameters: `resolution`, `warp`.
//!
//! Limits: time grows with the casters whose bound holds receivers, whether they shadow them or not.

use super::schema::{Choices, Groups, Rule, count, word};
use super::{Fitted, Parameters, Plan, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::boxes::{Cut, Fit, cut_layers};
use crate::fits::central::{cone_layer, cube_faces};
use crate::gpu::passes::importance_map::{Factors, Importance};
use crate::gpu::passes::light_grid::{LARGEST_RESOLUTION, TILE};
use crate::gpu::passes::warp_map::{Axis, CountFit, WarpMap};

#[derive(Debug, Clone, PartialEq)]
pub struct Exact {
    /// Texels along each side of the grid; `None` for about two texels to a receiver.
    pub resolution: Option<u32>,
    pub warp: Warp,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Warp {
    None,
    Rectilinear,
    NonOrthogonal,
}

/// Functions of a warp along each axis, and cells of each: fewer than a shadow map's, because a fine
/// warp makes the bounds of casters wide.
const CELLS: u32 = 128;

const WARPS: Choices<Warp> = &[
    ("none", Warp::None),
    ("rtw", Warp::Rectilinear),
    ("notw", Warp::NonOrthogonal),
];

impl ShadowMethod for Exact {
    const NAME: &'static str = "exact";
    const TITLE: &'static str = "Exact (irregular z-buffer)";
    const CITATION: &'static str = "Johnson, G., Lee, J., Burns, C., and Mark, W. 2005. The \
         irregular Z-buffer. ACM Transactions on Graphics 24(4).";

    const PARAMETERS: Groups = &[&[
        count("resolution", None, LARGEST_RESOLUTION, "texels"),
        // Measured on two scenes of 260,000 triangles: the warps shorten the longest list to a fifth, but
        // casters' bounds grow, and frames take 1.2 to 2.2 times as long.
        word("warp", "none", Rule::Choice(&WARPS)),
    ]];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            resolution: parameters.get("resolution"),
            warp: parameters.choice("warp", WARPS),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let mut plans = Vec::new();
        for fitted in self.fit(view)? {
            plans.push(match self.warp {
                Warp::None => Plan::from(fitted),
                Warp::Rectilinear => rectilinear(view, fitted)?,
                Warp::NonOrthogonal => non_orthogonal(view, fitted)?,
            });
        }
        view.listed_shadows(&plans)
    }
}

/// Texels along each side of a grid whose size follows from the receivers, at least.
const FEWEST_TEXELS: u32 = 64;

/// Standard deviation of the blur of `rtw`, in cells.
const RTW_BLUR: f64 = 3.0;

impl Exact {
    /// The desired view's layers, but all of them with straight edges: a cone that is too wide for one
    /// perspective takes faces of a cube.
    fn fit(&self, view: &mut View) -> Result<Vec<Fitted>> {
        let mut layers = self.layers(view)?;
        let resolution = self.resolution.unwrap_or_else(|| {
            let receivers = f64::from(view.facing_count()) / layers.len().max(1) as f64;
            let side = ((2.0 * receivers).sqrt() as u32).next_multiple_of(TILE);
            side.clamp(FEWEST_TEXELS, LARGEST_RESOLUTION)
        });
        for layer in &mut layers {
            layer.projection = layer.projection.with_resolution(resolution);
        }
        Ok(layers)
    }

    fn layers(&self, view: &mut View) -> Result<Vec<Fitted>> {
        let scene = view.scene.bounds();
        if let (Some(position), Some(cone)) = (view.light.position(), view.light.cone())
            && !cone_layer(position, cone, scene)
                .projection
                .kind
                .has_straight_edges()
        {
            return cut_layers(
                view,
                cube_faces(position, scene),
                Cut::Receivers,
                FEWEST_TEXELS,
            );
        }
        Fit::DesiredView.fit(view, false, FEWEST_TEXELS)
    }
}

/// One function along each axis, by the receivers' distance (Rosen).
fn rectilinear(view: &mut View, fitted: Fitted) -> Result<Plan> {
    let resolution = fitted.projection.width;
    let warp = WarpMap::new(view.frame(), 1, CELLS, resolution)?;
    let factors = Factors {
        distance: true,
        ..Factors::default()
    };
    let importance = view.importance_map(&fitted, CELLS, Importance::Maximum, factors, None)?;
    let frame = view.frame();
    for axis in [Axis::X, Axis::Y] {
        warp.fit_maxima(frame, axis, resolution, &importance.buffer, RTW_BLUR)?;
    }
    warp.finish(frame, resolution);
    Ok(Plan {
        fitted,
        warp: Some(warp),
        importance: None,
    })
}

/// A function for each row and each column, by the number of receivers (Milet et al.).
fn non_orthogonal(view: &mut View, fitted: Fitted) -> Result<Plan> {
    let resolution = fitted.projection.width;
    let warp = WarpMap::new(view.frame(), CELLS, CELLS, resolution)?;
    let fit = CountFit {
        smoothing: f64::from(CELLS) / 16.0,
        exponent: 1.0,
        even_share: 0.0,
    };
    for axis in [Axis::X, Axis::Y] {
        let counted = Importance::Count {
            along: axis,
            unit: 1.0,
        };
        let factors = Factors::default();
        let counts = view.importance_map(&fitted, CELLS, counted, factors, Some(&warp))?;
        warp.fit_counts(view.frame(), axis, resolution, &counts.buffer, fit)?;
    }
    warp.finish(view.frame(), resolution);
    Ok(Plan {
        fitted,
        warp: Some(warp),
        importance: None,
    })
}
