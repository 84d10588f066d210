//! The passes. Each is a function from handles to a handle; one pass is one file, one label and one
//! timer key, and passes belong to the house, not to a method.

pub mod blend_importance;
pub mod boundary;
pub mod caster_tests;
pub mod forward_importance;
pub mod image_tiles;
pub mod importance_map;
pub mod inputs;
pub mod light_grid;
pub mod light_rays;
pub mod lookup;
pub mod moments;
pub mod outline;
pub mod packed_image;
pub mod page_requests;
pub mod rasterize;
pub mod ray_queries;
pub mod receiver_lists;
pub mod receiver_tiles;
pub mod receivers;
pub mod samples;
pub mod shadow_edge;
pub mod shadow_map;
pub mod shadow_rays;
pub mod shadow_volumes;
pub mod stored_pages;
pub mod tessellate;
#[cfg(test)]
mod twins;
pub mod visibility;
pub mod warp_map;
pub mod work_items;

use super::{acceleration, unsure};

/// The keys of a frame's timers, of passes and of what the CPU does for them.
pub const LABELS: &[&str] = &[
    acceleration::LABEL,
    blend_importance::LABEL,
    boundary::LABEL,
    caster_tests::LABEL,
    forward_importance::LABEL,
    image_tiles::LABEL,
    importance_map::LABEL,
    lookup::LABEL,
    moments::LABEL,
    outline::LABEL,
    packed_image::LABEL,
    page_requests::LABEL,
    ray_queries::LABEL,
    receiver_lists::LABEL,
    receiver_tiles::LABEL,
    receivers::LABEL,
    samples::LABEL,
    shadow_edge::LABEL,
    shadow_map::LABEL,
    shadow_rays::HIERARCHY_LABEL,
    shadow_rays::LABEL,
    shadow_volumes::EDGES_LABEL,
    shadow_volumes::LABEL,
    unsure::LABEL,
    visibility::LABEL,
    warp_map::LABEL,
];

#[cfg(test)]
mod tests {
    use super::LABELS;
    use std::path::Path;

    #[test]
    fn every_label_is_listed_once() {
        let gpu = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/gpu");
        let mut found = Vec::new();
        for folder in [gpu.join("passes"), gpu] {
            for entry in std::fs::read_dir(folder).unwrap() {
                let Ok(text) = std::fs::read_to_string(entry.unwrap().path()) else {
                    continue;
                };
                let constants = text.lines().filter(|line| line.starts_with("pub const "));
                let labels = constants.filter_map(|line| line.split_once("LABEL: &str = \""));
                found.extend(labels.map(|(_, value)| value.trim_end_matches("\";").to_string()));
            }
        }
        found.sort();
        let mut listed = LABELS.to_vec();
        listed.sort();
        assert_eq!(found, listed);
    }
}
