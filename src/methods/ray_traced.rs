//! Ray traced: a ray from every receiver towards the light.
//!
//! Either compute walks a bounding volume hierarchy, which is built on the CPU when the scene is new or
//! has moved and kept on the device; or the device's own ray queries find the boxes that a ray meets, in a
//! structure that the device builds. Both ask the same test about the triangles.
//!
//! Brian Smits. Efficiency issues for ray tracing. Journal of Graphics Tools 3(2), 1998 (the walk
//! without a stack); Daniel Meister, Jiří Bittner. Parallel locally-ordered clustering for bounding
//! volume hierarchy construction. IEEE TVCG 24(3), 2018 (the build).
//!
//! Parameters: `traversal`.
//!
//! Limits: a moving scene pays for the build in every frame.

use super::prelude::*;
use crate::verbs::Traversal;

const TRAVERSALS: Choices<Traversal> = &[
    ("auto", Traversal::Auto),
    ("compute", Traversal::Compute),
    ("hardware", Traversal::Hardware),
];

parameters! {
    pub struct RayTraced {
        pub traversal: Traversal = choice(TRAVERSALS, "auto"),
    }
}

impl ShadowMethod for RayTraced {
    const NAME: &'static str = "ray_traced";
    const TITLE: &'static str = "Ray traced";
    const CITATION: &'static str =
        "Smits, B. 1998. Efficiency issues for ray tracing. Journal of Graphics Tools 3(2).";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        view.shadow_rays(self.traversal)
    }
}
