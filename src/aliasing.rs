//! How coarse a shadow map is where the camera looks, in float64: measures that need no reference.

use crate::camera::Camera;
use crate::light::Light;
use crate::projection::Projection;
use crate::reference::{Surface, SurfacePoint};
use crate::region::Region;
use crate::scene::Scene;
use crate::warp::{Warp, Warping};
use glam::{DMat2, DVec2, DVec3};
use rayon::prelude::*;

/// Where a layer took the light's rays.
pub struct RenderedLayer {
    pub projection: Projection,
    /// Of the receivers that it is for.
    pub region: Region,
    /// None where it has none, or it was not asked for.
    pub warp: Option<Warping<Warp>>,
}

impl RenderedLayer {
    /// As `Warping::steps`; those of a map without a warp are its own.
    fn steps(&self, uv: DVec2) -> (DMat2, DVec2) {
        let warp = self.warp.as_ref();
        warp.map_or((DMat2::IDENTITY, DVec2::ONE), |warp| warp.steps(uv))
    }
}

/// The aliasing error m = w'_l / w'_i of each pixel: the width of the beam of the light's texel over
/// the width of the pixel's, both where they meet the surface.
///
/// As m = (w_l / w_i) (cos theta_i / cos theta_l), Stamminger and Drettakis, "Perspective shadow
/// maps", 2002, and Navrátil's thesis, Eq. 3.2, with the widths across the beams taken as square roots
/// of their areas. NaN where no surface is seen or no layer is there. A pixel's layer is the first that it lies in, unless
/// it is given by its number.
///
/// Beside the errors the nearest and the farthest depth that is seen.
pub fn aliasing_error(
    (scene, camera, light): (&Scene, &Camera, &Light),
    (layers, layer_of_pixel): (&[RenderedLayer], Option<&[u8]>),
    triangle_id: &[i32],
) -> (Vec<f32>, [f64; 2]) {
    let image = Projection::from_camera(camera);
    let image_steps = image.steps();
    let steps: Vec<_> = layers.iter().map(|l| l.projection.steps()).collect();
    let error = |pixel: usize, point: &SurfacePoint| {
        let position = point.position;
        let mut own = layers.iter().zip(&steps);
        let own = match layer_of_pixel {
            Some(numbers) => own.nth(numbers[pixel].into()),
            None => own.find(|(layer, _)| layer.region.contains(position)),
        };
        let Some((layer, steps)) = own.filter(|_| !position.is_nan()) else {
            return f32::NAN;
        };
        let map = &layer.projection;
        let to_light = light.vector_from_point(position).normalize();
        let to_eye = -camera.sight_of(position - camera.eye).normalize();
        let size = map.size().texels();
        let (warped, scale) = layer.steps(map.texel_from_point(position).truncate() / size);
        let area_of_texel = map.kind.texel_area(map, steps, position) * warped.determinant().abs()
            / (scale.x * scale.y);
        let width_of_texel = area_of_texel.sqrt();
        let width_of_pixel = image.kind.texel_area(&image, &image_steps, position).sqrt();
        let cosines = point.normal.dot(to_eye).abs() / point.normal.dot(to_light).abs();
        (width_of_texel / width_of_pixel * cosines) as f32
    };
    let mut errors = vec![f32::NAN; triangle_id.len()];
    let width = camera.width as usize;
    let rows = errors
        .par_chunks_mut(width)
        .zip(triangle_id.par_chunks(width));
    let depths = rows.enumerate().map(|(row, (errors, ids))| {
        let mut surface = Surface::new(scene, camera);
        let mut seen = NO_DEPTHS;
        for (column, (of_pixel, &id)) in errors.iter_mut().zip(ids).enumerate() {
            let pixel = row * width + column;
            if let Some(point) = surface.point(pixel, id) {
                *of_pixel = error(pixel, &point);
                let depth = Some(point.depth).filter(|depth| depth.is_finite());
                seen = depth.map_or(seen, |depth| both(seen, [depth; 2]));
            }
        }
        seen
    });
    let depths = depths.reduce(|| NO_DEPTHS, both);
    (errors, depths)
}

/// Nearest and farthest of what is not there.
const NO_DEPTHS: [f64; 2] = [f64::INFINITY, 0.0];

/// Nearest and farthest of two ranges of depths.
fn both(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Steps of the grid over the view frustum: pixels along each axis, and depths.
const FRUSTUM_STEPS: u32 = 32;

/// The largest perspective aliasing error over the view frustum: the longer side of the light's texel over
/// the width of the pixel, both across their beams, wherever a surface might be, however it might be turned.
/// The frustum ends at the nearest and the farthest surface that is seen; what no layer covers is left out.
/// Infinite where a warp leaves a place no texels, NaN where nothing is seen or no layer is there.
///
/// D. Brandon Lloyd, David Tuft, Sung-eui Yoon, Dinesh Manocha. Warping and partitioning for low error
/// shadow maps. EGSR 2006, section 3, on a grid of points.
pub fn largest_aliasing_error(
    camera: &Camera,
    layers: &[RenderedLayer],
    [near, far]: [f64; 2],
) -> f64 {
    let image = Projection::from_camera(camera);
    let image_steps = image.steps();
    let share = |i: u32| (f64::from(i) + 0.5) / f64::from(FRUSTUM_STEPS);
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let errors = (0..FRUSTUM_STEPS.pow(3)).into_par_iter().map(|i| {
        let (column, rest) = (i % FRUSTUM_STEPS, i / FRUSTUM_STEPS);
        let (row, slice) = (rest % FRUSTUM_STEPS, rest / FRUSTUM_STEPS);
        let depth = near * (far / near).powf(f64::from(slice) / f64::from(FRUSTUM_STEPS - 1));
        let (eye, ray) = image.ray_from_texel(size * DVec2::new(share(column), share(row)));
        let point = eye + ray * depth;
        let width_of_pixel = image.kind.texel_area(&image, &image_steps, point).sqrt();
        let mut own = layers.iter().filter(|layer| layer.region.contains(point));
        let sides = own.next().and_then(|layer| sides_of_texel(layer, point));
        sides.map_or(f64::NAN, |sides| sides.max_element() / width_of_pixel)
    });
    errors.reduce(|| f64::NAN, f64::max)
}

/// Lengths of the sides of the texel that a point falls in, across its beam; `None` off the map.
fn sides_of_texel(layer: &RenderedLayer, point: DVec3) -> Option<DVec2> {
    let map = &layer.projection;
    let there = map.texel_from_point(point);
    let (texel, depth) = (there.truncate(), there.z);
    let size = map.size().texels();
    let is_inside = texel.cmpge(DVec2::ZERO).all() && texel.cmple(size).all();
    if !is_inside || (map.kind.is_central() && depth <= 0.0) {
        return None;
    }
    let (warped, scale) = layer.steps(texel / size);
    if warped.is_nan() {
        return None;
    }
    let beam = map.ray_from_texel(texel).1.normalize();
    let side = |step: DVec2| {
        let ends = [texel - 0.5 * STEP * step, texel + 0.5 * STEP * step].map(|end| {
            let (start, ray) = map.ray_from_texel(end);
            start + ray * depth
        });
        let along = (ends[1] - ends[0]) / STEP;
        (along - beam * along.dot(beam)).length()
    };
    Some(DVec2::new(side(warped.x_axis), side(warped.y_axis)) / scale)
}

/// Of a texel: what its sides are measured over.
const STEP: f64 = 1e-3;

/// Rosen's maximum effective resolution, (width, height): the size that a uniform map would need to match
/// the smallest texel of this one (Rosen, "Rectilinear texture warping", 2012, section 6): over the
/// casters' box, of which `one_texel` is the map along the same rows and columns, for parallel rays and for a light far away, over a face of a cube
/// around the light for others. The greatest of the layers; NaN where none is there.
pub fn max_effective_resolution(
    one_texel: impl Fn(&Projection) -> Projection,
    layers: &[RenderedLayer],
) -> DVec2 {
    let resolutions = layers.iter().map(|layer| {
        let RenderedLayer {
            projection,
            region,
            warp,
        } = layer;
        let lengths = projection.kind.smallest_texel(projection, region);
        let resolution = match projection.kind.is_central() {
            // Two units wide at a depth of 1.
            true => 2.0 / lengths,
            false => {
                // As wide as at the other map's origin.
                let uniform = one_texel(projection);
                let depth = uniform.projected_from_point(projection.origin).z;
                let width = 1.0 + uniform.kind.convergence() * depth;
                uniform.kind.smallest_texel(&uniform, region) * width / lengths
            }
        };
        resolution * warp.as_ref().map_or(DVec2::ONE, Warping::greatest_scale)
    });
    let greatest = resolutions.reduce(DVec2::max);
    greatest.unwrap_or(DVec2::NAN)
}
