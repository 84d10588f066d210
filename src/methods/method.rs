//! What a method is.

use super::schema::{ParameterGroup, Schema};
use crate::error::Result;
use crate::gpu::view::{Recorded, View};

/// A shadow method with its parameters.
pub trait ShadowMethod: ParameterGroup {
    /// Name in Python, `lixel.render_shadows(..., method=NAME)`.
    const NAME: &'static str;
    /// Title for tables and plots.
    const TITLE: &'static str;
    /// Where it comes from.
    const CITATION: &'static str;

    const SCHEMA: Schema = Schema {
        name: Self::NAME,
        entries: Self::ENTRIES,
    };

    /// The rules between parameters; each obeys its own.
    fn check(&self) -> Result<()> {
        Ok(())
    }

    /// Records the method's passes.
    fn record(&self, view: &mut View) -> Result<Recorded>;
}

/// What a user can ask about a method.
pub struct Description {
    pub title: &'static str,
    pub citation: &'static str,
    /// Name and parameters.
    pub schema: Schema,
}
