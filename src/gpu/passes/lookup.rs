//! Pass "lookup": the shadow test of every pixel.

use super::inputs::Receivers;
use super::rasterize::Target;
use super::warp_map::WarpMap;
use crate::gpu::kernel::Kernel;
use crate::gpu::recording::Recording;
use crate::projection::Projection;

pub const LABEL: &str = "lookup";

/// What is taken off a receiver's depth before it is compared.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DepthBias {
    /// World units.
    pub constant: f64,
    /// World units per unit of depth where a texel's beam widens with it, else world units.
    pub beam: f64,
    /// Texels: times the width of a texel and the slope of the receiver against the light.
    pub slope: f64,
    /// Whether the receiver's plane is evaluated on the texel's own ray.
    pub receiver_plane: bool,
    /// Bound of the rounding error of a depth, world units; none where the user gave the whole bias.
    pub rounding: f64,
}

/// How a receiver is compared with the texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Texels on each side of the receiver's own.
    pub reach: u8,
    /// Whether the receiver's own light ray is tested against the triangles of those texels.
    pub triangles: bool,
    /// Whether depth tests that all agree decide.
    pub depths: bool,
    /// Depth tests in a disc instead, whose mean is the answer.
    pub filter: Option<Filter>,
}

/// Percentage closer filtering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// Of the disc: in texels of the warped map, or in world units.
    pub radius: f64,
    pub samples: u32,
    /// Whether the disc lies across the receiver's light ray, before the warp, or in the warped map.
    pub is_unwarped: bool,
}

impl Comparison {
    pub const DEPTH: Self = Self {
        reach: 0,
        triangles: false,
        depths: true,
        filter: None,
    };

    pub fn filtered(filter: Filter) -> Self {
        Self {
            // Without a radius every test is the receiver's own.
            filter: Some(filter).filter(|filter| filter.radius > 0.0),
            ..Self::DEPTH
        }
    }

    pub fn target(self) -> Target {
        if self.triangles {
            Target::DepthTriangle
        } else {
            Target::Depth
        }
    }
}

/// A map to look up.
#[derive(Clone, Copy)]
pub struct LookupInput<'a> {
    pub projection: &'a Projection,
    pub warp: Option<&'a WarpMap>,
    pub texels: &'a wgpu::Buffer,
    pub comparison: Comparison,
    pub bias: DepthBias,
    /// Bound of the rounding error of a position in light space, world units.
    pub rounding: f64,
}

/// Answers for the receivers of the layer; the other pixels keep what they have. Per pixel, float32: 1 lit, 0 in
/// shadow, in between with a filter.
pub fn lookup(frame: &mut Recording, seen: Receivers, map: LookupInput, visibility: &wgpu::Buffer) {
    let LookupInput {
        projection,
        comparison,
        bias,
        ..
    } = map;
    let mut uniform = seen.uniform(projection);
    // Depths are in the projection's unit there. So is the growth of a beam.
    let unit = projection.unit();
    uniform.constant_bias = (bias.constant * unit) as f32;
    uniform.beam_bias = bias.beam as f32;
    uniform.slope_bias = bias.slope as f32;
    uniform.receiver_plane = f32::from(u8::from(bias.receiver_plane));
    let filter = comparison.filter;
    uniform.filter_radius = filter.map_or(0.0, |filter| filter.radius as f32);
    uniform.rounding = (bias.rounding * unit) as f32;
    uniform.margin = map.rounding as f32;
    let rows = frame.gpu.work_per_invocation(1, 32);
    let kernel = Kernel::new("lookup")
        .projection(&frame.gpu, 0, projection, seen.scene.origin)
        .receivers(&frame.gpu, seen, &uniform)
        .tiles(seen, rows)
        .triangles(seen.scene)
        .warp(map.warp)
        .stored(comparison.target())
        .bind(5, map.texels)
        .bind(6, visibility)
        .constant("reach", comparison.reach)
        .constant("uses_triangles", comparison.triangles)
        .constant("uses_depths", comparison.depths)
        .constant("samples", filter.map_or(0, |filter| filter.samples))
        .constant("is_unwarped", filter.is_some_and(|f| f.is_unwarped));
    frame.pass(LABEL, &[kernel.dispatch(seen.groups(rows))]);
}
