//! Ray traced: a ray from every receiver towards the light, through a bounding volume hierarchy.
//!
//! The hierarchy is built on the CPU when the scene is new or has moved, and kept on the device.
//!
//! Brian Smits. Efficiency issues for ray tracing. Journal of Graphics Tools 3(2), 1998 (the walk
//! without a stack); Daniel Meister, Jiří Bittner. Parallel locally-ordered clustering for bounding
//! volume hierarchy construction. IEEE TVCG 24(3), 2018 (the build).
//!
//! No parameters.
//!
//! Limits: a moving scene pays for the build in every frame.

use super::{Parameters, Recorded, ShadowMethod, Value, View};
use crate::error::Result;

#[derive(Debug, Clone, PartialEq)]
pub struct RayTraced;

impl ShadowMethod for RayTraced {
    const NAME: &'static str = "ray_traced";
    const TITLE: &'static str = "Ray traced";
    const CITATION: &'static str =
        "Smits, B. 1998. Efficiency issues for ray tracing. Journal of Graphics Tools 3(2).";

    fn defaults() -> Vec<(&'static str, Value)> {
        vec![]
    }

    fn from_parameters(_parameters: &mut Parameters) -> Result<Self> {
        Ok(Self)
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let visibility = view.shadow_rays()?;
        Ok(Recorded {
            visibility,
            layers: vec![],
        })
    }
}
