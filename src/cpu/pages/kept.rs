//! The pages of the frame before, whose maps held still.

use crate::cpu::map::Map;
use crate::light::Light;
use crate::projection::Projection;
use crate::scene::Scene;
use std::sync::Arc;

/// Of each level that was looked at, what was drawn of it.
type Maps = Vec<(Projection, Arc<Map>)>;

pub struct KeptPages {
    generation: u64,
    light: Light,
    maps: Maps,
}

impl KeptPages {
    pub fn new(scene: &Scene, light: &Light, maps: Maps) -> Self {
        Self {
            generation: scene.generation(),
            light: light.clone(),
            maps,
        }
    }

    /// Whether the light and the scene are still the same.
    pub fn are_of(&self, scene: &Scene, light: &Light) -> bool {
        self.generation == scene.generation() && self.light == *light
    }

    /// The pages of a map, if it is the same.
    pub fn map(&self, projection: &Projection) -> Option<&Map> {
        let mut maps = self.maps.iter();
        let found = maps.find(|(known, _)| known == projection);
        found.map(|(_, map)| &**map)
    }
}

impl Map {
    /// Whether a page is stored.
    pub fn has_page(&self, place: [u32; 2]) -> bool {
        let pages = self.pages.as_ref();
        pages.is_some_and(|pages| pages.slot(place).is_some())
    }
}
