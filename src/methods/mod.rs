//! The methods: one method, one paper, one file. This is the only list of them.
//!
//! A method is straight-line code from handles to a visibility image: it fits a projection and calls
//! passes. CONTRIBUTING.md has the recipe for another one.

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
pub mod schema;
mod shadow_volumes;
pub mod spot;
mod uniform;
pub mod view;

pub use parameters::MapParameters;
pub use schema::Parameters;
pub use uniform::fit_uniform;
pub use view::{Fitted, Layer, Plan, Recorded, Stats, View};

use crate::error::{Error, Result};
use schema::{Groups, Schema};

/// A shadow method with its parameters.
pub trait ShadowMethod: Sized {
    /// Name in Python, `lixel.render_shadows(..., method=NAME)`.
    const NAME: &'static str;
    /// Title for tables and plots.
    const TITLE: &'static str;
    /// Where it comes from.
    const CITATION: &'static str;

    const PARAMETERS: Groups;

    /// The values obey their rules; errors are of rules between parameters.
    fn from_parameters(parameters: &Parameters) -> Result<Self>;

    /// Records the method's passes.
    fn record(&self, view: &mut View) -> Result<Recorded>;
}

/// The parameters of a method.
fn schema_of<M: ShadowMethod>() -> Schema {
    let (name, groups) = (M::NAME, M::PARAMETERS);
    Schema { name, groups }
}

/// The method with the default of every parameter.
fn default_method<M: ShadowMethod>() -> M {
    M::from_parameters(&schema_of::<M>().defaults()).expect("defaults agree with each other")
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
                    title: <$type>::TITLE,
                    citation: <$type>::CITATION,
                    schema: schema_of::<$type>(),
                },)+]
            }

            /// The parameters of the method of that name.
            pub fn schema(name: &str) -> Result<Schema> {
                let known = Self::list().into_iter().map(|method| method.schema);
                let known: Vec<_> = known.collect();
                known.iter().find(|schema| schema.name == name).copied().ok_or_else(|| {
                    let known: Vec<_> = known.iter().map(|schema| schema.name).collect();
                    let known = known.join(", ");
                    Error::Value(format!("method must be one of {known}, got '{name}'"))
                })
            }

            /// The method whose schema that is, with values of its parameters.
            pub fn new(schema: Schema, parameters: &Parameters) -> Result<Self> {
                match schema.name {
                    $(<$type>::NAME => <$type>::from_parameters(parameters).map(Self::$variant),)+
                    other => unreachable!("{other} is not listed"),
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
pub struct Description {
    pub title: &'static str,
    pub citation: &'static str,
    /// Name and parameters.
    pub schema: Schema,
}
