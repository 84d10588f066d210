//! Shadow volumes: the points of what the camera sees that are inside the volumes behind triangles.
//!
//! The GPU engine counts the volumes' faces beyond each point on the rasterization hardware (z-fail): every
//! triangle, the extruded edges that are silhouettes seen from the light, and the triangles once more at
//! infinity. The CPU engine counts the extruded edges before each point, from the volumes that the eye is in
//! (z-pass). Nothing is sampled from the light, and meshes may be open or meet in any number at an edge.
//!
//! Franklin Crow. Shadow algorithms for computer graphics. SIGGRAPH 1977. Bill Bilodeau, Mike Songy.
//! Real time shadows. Creativity 1999, and John Carmack, 2000 (counting beyond the point). Morgan McGuire,
//! John Hughes, Kevin Egan, Mark Kilgard, Cass Everitt. Fast, practical and robust shadows. NVIDIA, 2003
//! (caps at infinity). Byungmoon Kim, Kihwan Kim, Greg Turk. A shadow-volume algorithm for opaque and
//! transparent nonmanifold casters. Journal of Graphics Tools 13(3), 2008 (crossings of an edge). Timo Aila,
//! Tomas Akenine-Moeller. A hierarchical shadow volume algorithm. Graphics Hardware 2004 (parts of the image).
//!
//! No parameters.
//!
//! Limits: a GPU's hardware rounds corners to 1/256 of a pixel, so that single pixels at outlines may be wrong
//! (drawn three times as fine, a fifth to a seventh of them are left); time grows with the area of all
//! volumes in the image, on the CPU with the length of their outlines; triangles with holes cast no volume that
//! is right, and are refused.

use super::prelude::*;

parameters! {
    pub struct ShadowVolumes {
    }
}

impl ShadowMethod for ShadowVolumes {
    const NAME: &'static str = "shadow_volumes";
    const TITLE: &'static str = "Shadow volumes";
    const CITATION: &'static str =
        "Crow, F. 1977. Shadow algorithms for computer graphics. SIGGRAPH 1977.";

    const KNOWS_MASKS: bool = false;

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        view.shadow_volumes()
    }
}
