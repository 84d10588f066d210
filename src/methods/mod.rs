//! The methods: one method, one paper, one file. This is the only list of them.
//!
//! A method is straight-line code from handles to a visibility image: it fits a projection and calls
//! passes. CONTRIBUTING.md has the recipe for another one.

pub mod arrays;
mod cascades;
mod cube;
mod desired_view;
mod dual_paraboloid;
mod exact;
pub mod filters;
mod fit;
mod focused;
pub mod given_warp;
mod importance;
mod improved_paraboloid;
pub mod light_matrix;
mod lispsm;
mod log_psm;
pub mod method;
mod min_sm;
mod notw;
pub mod parameters;
mod plane_optimal;
mod prelude;
mod psm;
mod ray_traced;
mod rtw;
pub mod scene_optimized;
pub mod schema;
mod shadow_volumes;
mod smoothing;
mod spot;
mod trapezoidal;
mod uniform;
mod virtual_shadow_map;
mod warps;

use crate::error::{Error, Result};
use crate::verbs::Verbs;
pub use method::Description;
use method::ShadowMethod;
use schema::{ParameterGroup, Parameters, Schema};

macro_rules! methods {
    ($($variant:ident = $type:path,)+) => {
        /// A method of the closed set.
        #[derive(Debug, Clone)]
        pub enum Method {
            $($variant($type),)+
        }

        impl Method {
            /// What is known of every method that has a name, in the order of the list.
            pub fn list() -> Vec<Description> {
                let all = Self::all().into_iter();
                all.filter(|method| !method.is_given).collect()
            }

            fn all() -> Vec<Description> {
                vec![$(Description {
                    title: <$type>::TITLE,
                    citation: <$type>::CITATION,
                    schema: <$type>::SCHEMA,
                    knows_masks: <$type>::KNOWS_MASKS,
                    is_given: <$type>::IS_GIVEN,
                },)+]
            }

            /// What is known of the method of that name.
            pub fn description(name: &str) -> Result<Description> {
                let known: Vec<_> = Self::list().iter().map(|method| method.schema.name).collect();
                let found = Self::all().into_iter().find(|method| method.schema.name == name);
                found.ok_or_else(|| {
                    let known = known.join(", ");
                    Error::Value(format!("method must be one of {known}, got '{name}'"))
                })
            }

            /// The parameters of the method of that name.
            pub fn schema(name: &str) -> Result<Schema> {
                Ok(Self::description(name)?.schema)
            }

            /// The method whose schema that is, with values of its parameters.
            pub fn new(schema: Schema, parameters: &Parameters) -> Result<Self> {
                match schema.name {
                    $(<$type>::NAME => {
                        let method = <$type>::from_parameters(parameters);
                        method.check()?;
                        Ok(Self::$variant(method))
                    })+
                    other => unreachable!("{other} is not listed"),
                }
            }

            /// Whether the GPU engine has a form of it with its parameters.
            pub fn is_on_gpu(&self) -> bool {
                match self {
                    $(Self::$variant(method) => method.is_on_gpu(),)+
                }
            }

            /// Records the method's passes on an engine.
            pub fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
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
    LogPerspective = log_psm::LogPerspective,
    Trapezoidal = trapezoidal::Trapezoidal,
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
    VirtualShadowMap = virtual_shadow_map::VirtualShadowMap,
    RayTraced = ray_traced::RayTraced,
    Exact = exact::Exact,
    ShadowVolumes = shadow_volumes::ShadowVolumes,
    LightMatrix = light_matrix::LightMatrix,
    GivenWarp = given_warp::GivenWarp,
}
