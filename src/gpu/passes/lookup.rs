//! Pass "lookup": the shadow test of every pixel.

use super::inputs::{Receivers, ReceiversUniform};
use super::moments::MomentMap;
use super::rasterize::Target;
use super::stored_pages::PagesInput;
use super::warp_map::WarpMap;
use crate::gpu::kernel::{Dispatch, Kernel};
use crate::gpu::recording::Recording;
use crate::map_settings::{Comparison, DepthBias};
use crate::projection::Projection;

pub const LABEL: &str = "lookup";

impl Comparison {
    /// What a texel must keep for it.
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
    /// Where the map is a level of one in pages: then it is for the pixels that have its number.
    pub pages: Option<LevelInput<'a>>,
}

/// A level of a map in pages, before some receivers.
#[derive(Clone, Copy)]
pub struct LevelInput<'a> {
    pub pages: PagesInput<'a>,
    pub level_of_pixel: &'a wgpu::Buffer,
    /// Of a few bytes, for a binding that has no part in it.
    pub unused: &'a wgpu::Buffer,
}

/// Answers for the receivers of the layer; the other pixels keep what they have. Per pixel, float32: 1 lit, 0 in
/// shadow, in between with a filter.
pub fn lookup(frame: &mut Recording, seen: Receivers, map: LookupInput, visibility: &wgpu::Buffer) {
    let dispatch = lookup_dispatch(frame, seen, map, visibility);
    frame.pass(LABEL, &[dispatch]);
}

/// Of a pass that looks, or that asks for pages.
pub fn lookup_dispatch(
    frame: &Recording,
    seen: Receivers,
    map: LookupInput,
    visibility: &wgpu::Buffer,
) -> Dispatch {
    let LookupInput {
        projection,
        comparison,
        ..
    } = map;
    let filter = comparison.filter;
    let mut uniform = uniform_of(seen, map);
    uniform.filter_radius = filter.map_or(0.0, |filter| filter.radius as f32);
    let rows = frame.gpu.work_per_invocation(1, 32);
    let kernel = Kernel::new("lookup")
        .projection(0, projection, seen.scene.origin)
        .receivers(seen, &uniform)
        .tiles(seen, rows)
        .triangles(seen.scene)
        .masks(seen.scene.masks.as_ref())
        .warp(map.warp)
        .stored(comparison.target())
        .bind(5, map.texels)
        .bind(6, visibility)
        .constant("reach", comparison.reach)
        .constant("uses_triangles", comparison.triangles)
        .constant("uses_depths", comparison.depths)
        .constant("samples", filter.map_or(0, |filter| filter.samples))
        .constant("is_unwarped", filter.is_some_and(|f| f.is_unwarped))
        .constant("is_gaussian", filter.is_some_and(|f| f.is_gaussian))
        .constant("is_jittered", filter.is_some_and(|f| f.is_jittered))
        .constant("is_revectorized", comparison.is_revectorized);
    let kernel = match map.pages {
        None => kernel,
        Some(LevelInput {
            pages,
            level_of_pixel,
            unused,
        }) => kernel.pages_looked_at(pages, level_of_pixel, unused),
    };
    kernel.dispatch(seen.groups(rows))
}

/// The same from moments of the map.
pub fn lookup_moments(
    frame: &mut Recording,
    seen: Receivers,
    map: LookupInput,
    moments: &MomentMap,
    visibility: &wgpu::Buffer,
) {
    let rows = frame.gpu.work_per_invocation(1, 32);
    let kernel = Kernel::new("lookup_moments")
        .projection(0, map.projection, seen.scene.origin)
        .receivers(seen, &uniform_of(seen, map))
        .tiles(seen, rows)
        .warp(map.warp)
        .moments(moments.filter)
        .bind(5, &moments.values)
        .bind(6, visibility)
        .constant("levels", moments.levels);
    frame.pass(LABEL, &[kernel.dispatch(seen.groups(rows))]);
}

/// The receivers, with what is taken off their depths.
fn uniform_of(seen: Receivers, map: LookupInput) -> ReceiversUniform {
    let mut uniform = seen.uniform(map.projection);
    let rule = map
        .bias
        .rule(map.projection.unit())
        .map(|number| number as f32);
    uniform.constant_bias = rule.constant;
    uniform.beam_bias = rule.beam;
    uniform.slope_bias = rule.slope;
    uniform.receiver_plane = rule.receiver_plane;
    uniform.rounding = rule.rounding;
    uniform.margin = map.rounding as f32;
    uniform
}
