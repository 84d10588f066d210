//! What a method is.

use super::schema::{ParameterGroup, Schema};
use crate::cpu;
use crate::error::Result;
use crate::gpu::view::{Recorded, View};

/// What answers a method on the CPU: 1 lit, 0 in shadow, NaN where nothing is seen, row by row.
pub type AnswerOnCpu<M> = fn(&M, &mut cpu::Frame) -> Result<Vec<f32>>;

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

    /// The method's form on the CPU engine, if it has one.
    const ON_CPU: Option<AnswerOnCpu<Self>> = None;

    /// Records the method's passes on the GPU engine.
    fn record(&self, view: &mut View) -> Result<Recorded>;
}

/// What a user can ask about a method.
pub struct Description {
    pub title: &'static str,
    pub citation: &'static str,
    /// Name and parameters.
    pub schema: Schema,
    /// Whether it has a form on the CPU engine.
    pub is_on_cpu: bool,
}
