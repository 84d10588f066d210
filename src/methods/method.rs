//! What a method is.

use super::schema::{ParameterGroup, Parameters, Schema};
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::map_settings::MapSettings;
use crate::verbs::{LayerOf, Verbs};

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

    /// Whether it knows of the holes of masked triangles.
    const KNOWS_MASKS: bool = true;

    /// Whether it is nothing without arrays that somebody gives, so that no name calls it.
    const IS_GIVEN: bool = false;

    /// Whether the GPU engine has a form of it with these parameters.
    fn is_on_gpu(&self) -> bool {
        true
    }

    /// Records the method's passes.
    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded>;
}

/// Layers without a warp as maps, and receivers against them.
pub fn mapped_shadows<'a, V: Verbs<'a>>(
    view: &mut V,
    map: MapSettings,
    layers: Vec<Layer>,
) -> Result<V::Recorded> {
    let layers = layers.into_iter().map(LayerOf::<V>::from).collect();
    view.shadows(map, layers)
}

impl Description {
    /// What of the method takes masked triangles for solid ones, if anything, in words.
    pub fn ignores_masks(&self, parameters: &Parameters) -> Option<String> {
        match self.knows_masks {
            false => Some(format!("method '{}'", self.schema.name)),
            true if parameters.says("rasterization", "linear") => {
                Some("rasterization='linear'".to_string())
            }
            true => None,
        }
    }
}

/// What a user can ask about a method.
pub struct Description {
    pub title: &'static str,
    pub citation: &'static str,
    /// Name and parameters.
    pub schema: Schema,
    /// Whether it knows of the holes of masked triangles.
    pub knows_masks: bool,
    /// Whether it is nothing without arrays that somebody gives.
    pub is_given: bool,
}
