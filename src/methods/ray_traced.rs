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

/// Who searches for the triangles that a ray may meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Traversal {
    /// Ray queries on a GPU that has them, else compute.
    Auto,
    Compute,
    Hardware,
}

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

    const ON_CPU: Option<AnswerOnCpu<Self>> = Some(|method, frame| match method.traversal {
        Traversal::Hardware => Err(no_hardware("the CPU engine has no ray queries")),
        Traversal::Auto | Traversal::Compute => frame.shadow_rays(),
    });

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let structure = match self.traversal {
            Traversal::Auto => view.preferred_structure(),
            Traversal::Compute => None,
            Traversal::Hardware => {
                Some(view.acceleration_structure().map_err(|error| match error {
                    Error::Device(reason) => no_hardware(&reason),
                    other => other,
                })?)
            }
        };
        let visibility = match structure {
            Some(structure) => view.ray_queries(&structure)?,
            None => view.shadow_rays()?,
        };
        Ok(Recorded {
            visibility,
            layers: vec![],
        })
    }
}

fn no_hardware(reason: &str) -> Error {
    Error::Device(format!(
        "traversal='hardware' cannot be: {reason}; take traversal='compute' or 'auto'"
    ))
}
