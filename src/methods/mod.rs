//! The methods: one method, one paper, one file. This is the only list of them.
//!
//! A method is straight-line code from handles to a visibility image: it fits a projection and calls
//! passes. See CONTRIBUTING.md, "How to add a method".

mod cascades;
pub mod cube;
mod desired_view;
pub mod dual_paraboloid;
mod exact;
mod focused;
mod importance;
pub mod improved_paraboloid;
pub mod lispsm;
mod min_sm;
mod notw;
pub mod parameters;
mod plane_optimal;
mod psm;
mod ray_traced;
mod rtw;
pub mod scene_optimized;
mod shadow_volumes;
pub mod spot;
mod uniform;
pub mod view;

pub use parameters::{Array, MapParameters, OldMap, Parameters, Value};
pub use uniform::fit_uniform;
pub use view::{Fitted, Layer, Plan, ReceiverCounts, Recorded, View};

use crate::error::{Error, Result};

/// A shadow method with its parameters.
pub trait ShadowMethod: Sized {
    /// Name in Python, `lixel.render_shadows(..., method=NAME)`.
    const NAME: &'static str;
    /// Title for tables and plots.
    const TITLE: &'static str;
    /// Where it comes from.
    const CITATION: &'static str;

    /// Takes the parameters it knows; `parameters` holds a value for each of `defaults`.
    fn from_parameters(parameters: &mut Parameters) -> Result<Self>;

    /// Names and defaults of the parameters.
    fn defaults() -> Vec<(&'static str, Value)>;

    /// Records the method's passes.
    fn record(&self, view: &mut View) -> Result<Recorded>;
}

macro_rules! methods {
    ($($variant:ident = $type:path,)+) => {
        /// A method of the closed set.
        #[derive(Debug, Clone, PartialEq)]
        pub enum Method {
            $($variant($type),)+
        }

        impl Method {
            /// What is known of every method, in the order of the list.
            pub fn list() -> Vec<Description> {
                vec![$(Description {
                    name: <$type>::NAME,
                    title: <$type>::TITLE,
                    citation: <$type>::CITATION,
                    parameters: <$type>::defaults(),
                },)+]
            }

            /// The method of that name; parameters left out take their defaults.
            pub fn new(name: &str, parameters: Parameters) -> Result<Self> {
                match name {
                    $(<$type>::NAME => {
                        let mut parameters = parameters.with_defaults(name, <$type>::defaults())?;
                        Ok(Self::$variant(<$type>::from_parameters(&mut parameters)?))
                    })+
                    _ => {
                        let known: Vec<_> = Self::list().iter().map(|m| m.name).collect();
                        Err(Error::Value(format!(
                            "method must be one of {}, got {name:?}",
                            known.join(", ")
                        )))
                    }
                }
            }

            pub fn record(&self, view: &mut View) -> Result<Recorded> {
                match self {
                    $(Self::$variant(method) => method.record(view),)+
                }
            }
        }
    };
}

methods! {
    Uniform = uniform::Uniform,
    DesiredView = desired_view::DesiredView,
    MinimalShadowMap = min_sm::MinimalShadowMap,
    Focused = focused::Focused,
    LightSpacePerspective = lispsm::LightSpacePerspective,
    Perspective = psm::Perspective,
    PlaneOptimal = plane_optimal::PlaneOptimal,
    SceneOptimized = scene_optimized::SceneOptimized,
    Cascades = cascades::Cascades,
    RectilinearWarp = rtw::RectilinearWarp,
    NonOrthogonalWarp = notw::NonOrthogonalWarp,
    ImprovedParaboloid = improved_paraboloid::ImprovedParaboloid,
    Cube = cube::Cube,
    DualParaboloid = dual_paraboloid::DualParaboloid,
    Spot = spot::Spot,
    RayTraced = ray_traced::RayTraced,
    Exact = exact::Exact,
    ShadowVolumes = shadow_volumes::ShadowVolumes,
}

/// What a user can ask about a method.
#[derive(Debug, Clone)]
pub struct Description {
    pub name: &'static str,
    pub title: &'static str,
    pub citation: &'static str,
    pub parameters: Vec<(&'static str, Value)>,
}
