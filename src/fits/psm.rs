//! Perspective shadow map: the light looks at the scene after the camera's perspective, where near things are large.
//!
//! ```text
//! shadow_from_world = focus * light_projection * light_view * camera
//! ```
//!
//! Marc Stamminger, George Drettakis. Perspective shadow maps. SIGGRAPH 2002.

use super::hull::MapFrame;
use super::light_matrix::{LightMatrix, product, rows};
use super::subject::Subject;
use crate::camera::Camera;
use glam::{DMat4, DVec3, DVec4};

/// Steps back of the virtual camera that are tried, in depths of the view: the first that holds all.
const STEPS_BACK: [f64; 7] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];

/// No side of the map is stretched more than this against the other: where the light shines along the view nearly, one
/// side would have all the texels.
const MAX_PERSPECTIVE: f64 = 100.0;

/// The virtual camera stands back where the light would not have all in front (section 4). `None` where no step back
/// is enough.
pub fn perspective(subject: &Subject, camera: &Camera, frame: MapFrame) -> Option<LightMatrix> {
    let (near, far) = subject.depths(camera);
    let far = far.max(near * (1.0 + 1e-6));
    STEPS_BACK.into_iter().find_map(|step| {
        let camera = camera_after_step_back(camera, step * (far - near), (near, far));
        let map_from_ray = seen_by_light(subject, camera)?;
        let is_even = subject.hull.is_even(map_from_ray, MAX_PERSPECTIVE);
        is_even.then(|| subject.hull.boxed(map_from_ray, frame))?
    })
}

/// The camera's map after a step back: depths from `near` to `far` become 0 to 1, the half width of the image 1.
fn camera_after_step_back(camera: &Camera, step_back: f64, (near, far): (f64, f64)) -> DMat4 {
    let eye = camera.eye - camera.forward * step_back;
    let (near, far) = (near + step_back, far + step_back);
    let [right, up, forward] = camera.rows_from(eye);
    let view = from_rows([right, up, forward, DVec4::W]);
    let scale = camera.width_at(far) / (far - near);
    let projection = from_rows([
        DVec4::X * camera.focal.x,
        DVec4::Y * camera.focal.y,
        DVec4::new(0.0, 0.0, scale, -(scale * near)),
        camera.row_of_width(DVec4::Z),
    ]);
    // The nearer part of the frustum keeps its width, whatever the step.
    let zoom = camera.width_at(near) / camera.width_at(near - step_back) * 2.0
        / f64::from(camera.width.max(camera.height));
    let zoom = DMat4::from_diagonal(DVec4::new(zoom, zoom, 1.0, 1.0));
    product([zoom, projection, view])
}

/// `light_projection * light_view * camera`, over rays.
fn seen_by_light(subject: &Subject, camera: DMat4) -> Option<LightMatrix> {
    let light = camera * subject.rays.light;
    let middle = subject.middle();
    let centre = camera * middle.extend(1.0);
    let centre = centre.truncate() / centre.w;
    // From the light to the centre, through the camera's infinity if need be.
    let ahead = (centre * light.w - light.truncate()).try_normalize()?;
    let right = ahead.cross(DVec3::Y).try_normalize()?;
    let axes = rows([right, ahead.cross(right), ahead]);
    let light_view = DMat4::from_mat3(axes);
    let length = light.length();
    // Functions that vanish at the light.
    let place = axes * light.truncate();
    let vanishing = |axis: DVec4, place: f64| axis * light.w - DVec4::W * place;
    let depth = vanishing(DVec4::Z, place.z);
    let [x, y] = if light.w.abs() > 1e-9 * length {
        [vanishing(DVec4::X, place.x), vanishing(DVec4::Y, place.y)]
    } else {
        // Where the light is at the camera's infinity the first two vanish all over, and so does the light's own place
        // along them: both are over its last coordinate, and that quotient stays.
        let place = axes * centre;
        [DVec4::X - DVec4::W * place.x, DVec4::Y - DVec4::W * place.y]
    };
    let light_projection = from_rows([x, y, DVec4::ZERO, depth]);
    // The light's coordinates may be of any size.
    let shadow_from_world = product([light_projection, light_view, camera]) / length;
    let [x, y, w] = subject.rays.map_from_ray(shadow_from_world);
    let sign = w.dot(subject.rays.ray_from_point(middle)).signum();
    Some(LightMatrix {
        x: x / x.length(),
        y: y / y.length(),
        w: w / (w.length() * sign),
    })
}

pub fn from_rows([x, y, z, w]: [DVec4; 4]) -> DMat4 {
    DMat4::from_cols(x, y, z, w).transpose()
}
