//! What a method is.

use super::schema::{Groups, Parameters, Schema};
use crate::error::Result;
use crate::gpu::view::{Recorded, View};

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
pub fn schema_of<M: ShadowMethod>() -> Schema {
    let (name, groups) = (M::NAME, M::PARAMETERS);
    Schema { name, groups }
}

/// The method with the default of every parameter.
pub fn default_method<M: ShadowMethod>() -> M {
    M::from_parameters(&schema_of::<M>().defaults()).expect("defaults agree with each other")
}

/// What a user can ask about a method.
pub struct Description {
    pub title: &'static str,
    pub citation: &'static str,
    /// Name and parameters.
    pub schema: Schema,
}
