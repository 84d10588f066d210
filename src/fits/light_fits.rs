//! Light matrices of the literature, fitted to points in the world.
//!
//! Each is an optical axis and a frame in the coordinates of a [`RayBundle`]; methods call them.

use super::light_matrix::{Hull, LightMatrix, MapSize, RayBundle};
use crate::camera::Camera;
use crate::light::Light;
use glam::{DVec2, DVec3, DVec4};

/// A light's rays with the points that its map must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    pub rays: RayBundle,
    pub points: Vec<DVec3>,
    pub hull: Hull,
}

/// Cosine of the widest angle between a ray and the middle of the rays that one map holds: that
/// of a face of a cube, nearly.
const WIDEST_COSINE: f64 = 0.55;

impl Subject {
    /// `None` where there is no point, or a light with a position is so much among them that one
    /// plane before it does not do.
    pub fn new(light: &Light, points: Vec<DVec3>) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        let Some(position) = light.position() else {
            return Self::parallel(light, points);
        };
        let towards = |point: &DVec3| (*point - position).normalize_or_zero();
        let forward = points.iter().map(towards).sum::<DVec3>().try_normalize()?;
        let is_ahead = |point| towards(point).dot(forward) > WIDEST_COSINE;
        points.iter().all(is_ahead).then_some(())?;
        Self::central(position, forward, points)
    }

    fn parallel(light: &Light, points: Vec<DVec3>) -> Option<Self> {
        let count = points.len() as f64;
        let middle = points.iter().sum::<DVec3>() / count;
        let direction = -light.vector_from_point(middle);
        let spread = |point: &DVec3| (*point - middle).reject_from(direction).length();
        let mean = points.iter().map(spread).sum::<f64>() / count;
        // Points at one place have no radius; rounding has.
        let farthest = points.iter().map(|p| p.abs().max_element());
        let radius = mean.max(1e-12 * farthest.fold(1e-280, f64::max));
        let rays = RayBundle::parallel(middle, direction, level_axis(direction), radius);
        Self::with_rays(rays, points)
    }

    /// Around a light with a position, the optical axis given.
    pub fn central(position: DVec3, forward: DVec3, points: Vec<DVec3>) -> Option<Self> {
        let rays = RayBundle::central(position, level_axis(forward), forward);
        Self::with_rays(rays, points)
    }

    fn with_rays(rays: RayBundle, points: Vec<DVec3>) -> Option<Self> {
        let hull = Hull::new(DVec3::Z, points.iter().map(|&p| rays.ray_from_point(p)))?;
        Some(Self { rays, points, hull })
    }

    fn middle(&self) -> DVec3 {
        self.points.iter().sum::<DVec3>() / self.points.len() as f64
    }

    /// Least and greatest depth along the viewing direction, not nearer than the near plane.
    fn depths(&self, camera: &Camera) -> (f64, f64) {
        let depths = self
            .points
            .iter()
            .map(|p| (*p - camera.eye).dot(camera.forward));
        let bounds = (f64::INFINITY, f64::NEG_INFINITY);
        let (least, greatest) = depths.fold(bounds, |(l, g), depth| (l.min(depth), g.max(depth)));
        let least = least.max(camera.znear);
        (least, greatest.max(least))
    }
}

/// A horizontal unit vector across a direction; the world's X where that is vertical.
fn level_axis(direction: DVec3) -> DVec3 {
    let across = direction.cross(DVec3::Y);
    if across.length_squared() > 1e-4 {
        across.normalize()
    } else {
        DVec3::X.reject_from(direction).normalize()
    }
}

/// No optical axis but the light's own: the smallest rectangle, or what leans less than it, around
/// the points.
pub fn focused(subject: &Subject, size: MapSize) -> Option<LightMatrix> {
    subject.hull.fit(DVec3::Z, size)
}

/// The near end z_n of a light space perspective is no less than this share of the farthest depth: a frustum
/// that begins at the eye would put the apex there, and all texels with it. Of 1/1000, 1/100 and 1/20 the last
/// had the fewest wrong pixels in eight scenes; receivers are seldom so near that it matters.
const NEAREST: f64 = 1.0 / 20.0;

/// Light space perspective: the texels narrow along the view as the pixels do, by the optimal distance
/// n = (z_n + sqrt(z_n z_f)) / sin(gamma) of the frustum's apex (Wimmer et al. 2004, section 4.2).
/// `None` where the light shines along the view, and no direction is the view's.
pub fn light_space_perspective(
    subject: &Subject,
    camera: &Camera,
    size: MapSize,
) -> Option<LightMatrix> {
    let rays = &subject.rays;
    let middle = rays.ray_from_point(subject.middle());
    // How places move with a step in the world, at the middle.
    let motion = |step: DVec3| {
        let turn = rays.ray_from_step(step);
        (turn.truncate() - middle.truncate() * (turn.z / middle.z)) / middle.z
    };
    let along = motion(camera.forward);
    let direction = along.try_normalize()?;
    // Places per world unit across the light: so long a step makes what the view's makes.
    let scale = [camera.right, camera.up, camera.forward].map(|axis| motion(axis).length_squared());
    let scale = (0.5 * scale.iter().sum::<f64>()).sqrt();
    let sine = (along.length() / scale).min(1.0);
    if sine < 1e-3 {
        return None;
    }
    let places = subject.hull.corners.iter().map(|c| c.truncate() / c.z);
    let start = places
        .map(|place| direction.dot(place))
        .fold(f64::INFINITY, f64::min);
    let extent = subject
        .hull
        .corners
        .iter()
        .map(|c| direction.dot(c.truncate() / c.z) - start);
    let extent = extent.fold(0.0, f64::max);
    let (z_near, farthest) = subject.depths(camera);
    let z_near = z_near.max(NEAREST * farthest);
    let z_far = z_near + extent / scale * sine;
    let apex = (z_near + (z_near * z_far).sqrt()) / sine * scale;
    let w = direction.extend(apex - start).normalize();
    // The apex lies beside the eye.
    let eye = rays.ray_from_point(camera.eye);
    let across = direction.perp();
    let column = if eye.z > 0.0 {
        across.dot(eye.truncate() / eye.z)
    } else {
        across.dot(middle.truncate() / middle.z)
    };
    let rows = [across.extend(-column), DVec3::Z];
    subject.hull.fit_box(rows, w, size)
}

/// The camera's map after a step back, as rows (x, y, z, w) over homogeneous points in the world;
/// depths from `near` to `far` become 0 to 1, the half width of the image 1.
fn post_perspective(camera: &Camera, step_back: f64, (near, far): (f64, f64)) -> [DVec4; 4] {
    let eye = camera.eye - camera.forward * step_back;
    let row = |axis: DVec3| axis.extend(-axis.dot(eye));
    let (near, far) = (near + step_back, far + step_back);
    // The nearer part of the frustum keeps its width, whatever the step.
    let zoom = near / (near - step_back) * 2.0 / f64::from(camera.width.max(camera.height));
    let depth = row(camera.forward);
    let scale = far / (far - near);
    [
        row(camera.right) * camera.focal.x * zoom,
        row(camera.up) * camera.focal.y * zoom,
        depth * scale - DVec4::W * (scale * near),
        depth,
    ]
}

/// Steps back of the virtual camera that are tried, in depths of the view: the first that holds all.
const STEPS_BACK: [f64; 7] = [0.0, 0.03, 0.1, 0.3, 1.0, 3.0, 10.0];

/// No side of a perspective shadow map is stretched more than this against the other.
const MAX_PERSPECTIVE: f64 = 1e3;

/// Perspective shadow map: the light looks at the scene after the camera's perspective, where near
/// things are large; the virtual camera stands back where the light would not have all in front
/// (Stamminger and Drettakis 2002, section 4). `None` where no step back is enough.
pub fn perspective(subject: &Subject, camera: &Camera, size: MapSize) -> Option<LightMatrix> {
    let rays = &subject.rays;
    let (near, far) = subject.depths(camera);
    let far = far.max(near * (1.0 + 1e-6));
    let middle = subject.middle().extend(1.0);
    STEPS_BACK.into_iter().find_map(|step| {
        let rows = post_perspective(camera, step * (far - near), (near, far));
        let transformed = |point: DVec4| DVec4::from(rows.map(|row| row.dot(point)));
        let light = transformed(rays.light());
        let centre = transformed(middle);
        // From the light to the centre, through the camera's infinity if need be. The rows of the
        // light's camera after the perspective: functions that vanish at the light.
        let centre = centre.truncate() / centre.w;
        let ahead = (centre * light.w - light.truncate()).try_normalize()?;
        let right = ahead.cross(DVec3::Y).try_normalize()?;
        let down = ahead.cross(right);
        let combine = |axis: DVec3| rows[0] * axis.x + rows[1] * axis.y + rows[2] * axis.z;
        let offset = |axis: DVec3| combine(axis) - rows[3] * axis.dot(centre);
        let length = light.length();
        let function =
            |axis: DVec3| (combine(axis) * light.w - rows[3] * axis.dot(light.truncate())) / length;
        // Where the light is at the camera's infinity the first two vanish all over, and so does the
        // light's own place along them: both are over its last coordinate, and that quotient stays.
        let [x, y, w] = if light.w.abs() > 1e-9 * length {
            rays.covectors([right, down, ahead].map(function))
        } else {
            let [x, y] = [right, down].map(offset);
            rays.covectors([x, y, function(ahead)])
        };
        let sign = w.dot(rays.ray_from_point(subject.middle())).signum();
        let length = w.length() * sign;
        let hull = &subject.hull;
        let w = w / length;
        let depths = hull.corners.iter().map(|corner| w.dot(*corner));
        let bounds = (f64::INFINITY, 0.0_f64);
        let (least, greatest) = depths.fold(bounds, |(l, g), depth| (l.min(depth), g.max(depth)));
        let is_even = least * MAX_PERSPECTIVE > greatest;
        let size_of = |v: DVec3| v / v.length();
        is_even.then(|| hull.fit_box([size_of(x), size_of(y)], w, size))?
    })
}

/// The plane, as a function of homogeneous points, that most points of surfaces lie in.
pub fn dominant_plane(points: &[DVec3], normals: &[DVec3]) -> Option<DVec4> {
    let step = points.len().div_ceil(CANDIDATES).max(1);
    let size = points
        .iter()
        .fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(l, h), p| {
            (l.min(*p), h.max(*p))
        });
    let tolerance = 1e-3 * (size.1 - size.0).length();
    let candidates = points.iter().zip(normals).step_by(step);
    let votes = candidates.map(|(point, normal)| {
        let plane = normal.extend(-normal.dot(*point));
        let agree = |(p, n): &(&DVec3, &DVec3)| {
            n.dot(*normal).abs() > 0.999 && plane.dot(p.extend(1.0)).abs() <= tolerance
        };
        (points.iter().zip(normals).filter(agree).count(), plane)
    });
    // The first of those with most votes.
    let best = votes.reduce(|best, other| if other.0 > best.0 { other } else { best });
    best.map(|(_, plane)| plane)
}

/// Planes that stand for election.
const CANDIDATES: usize = 128;

/// What a plane optimal map ends at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlaneFrame {
    /// The image: what the plane of the texels shows outside of it is not held.
    Image,
    /// The points that have a place.
    Points,
}

/// Plane optimal: on a plane each texel is a pixel. A point's place is where its shadow on the plane
/// is in the image (Chong and Gortler 2004). `None` where the light shines along the plane.
pub fn plane_optimal(
    subject: &Subject,
    camera: &Camera,
    plane: DVec4,
    frame: PlaneFrame,
    size: MapSize,
) -> Option<LightMatrix> {
    let rays = &subject.rays;
    let light = rays.light();
    let height = plane.dot(light);
    if height.abs() < 1e-6 * light.length() * plane.truncate().length() {
        return None;
    }
    let image = |axis: DVec3| axis.extend(-axis.dot(camera.eye));
    // Where the line from the light through a point X meets the plane: X (plane L) - L (plane X).
    let shadow = |row: DVec4| (row * height - plane * row.dot(light)) * height.signum();
    let covectors = rays.covectors([
        shadow(image(camera.right) * camera.focal.x),
        shadow(image(-camera.up) * camera.focal.y),
        shadow(image(camera.forward)),
    ]);
    let [x, y, w] = covectors.map(|row| row / covectors[2].length());
    if frame == PlaneFrame::Image {
        let image = DVec2::new(f64::from(camera.width), f64::from(camera.height));
        let middle = 0.5 * image - camera.centre;
        let scale = size.texels / image;
        return Some(LightMatrix {
            x: (x - w * middle.x) * scale.x,
            y: (y - w * middle.y) * scale.y,
            w,
        });
    }
    // What lies behind the camera's plane once it is moved along the rays has no place.
    let in_front = subject
        .points
        .iter()
        .map(|point| rays.ray_from_point(*point));
    let depths: Vec<_> = in_front.map(|ray| (w.dot(ray) / ray.z, ray)).collect();
    let greatest = depths.iter().map(|(depth, _)| *depth).fold(0.0, f64::max);
    let held = depths
        .iter()
        .filter(|(depth, _)| depth * MAX_PERSPECTIVE > greatest);
    let hull = Hull::new(DVec3::Z, held.map(|(_, ray)| *ray))?;
    hull.fit_box([x, y], w, size)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::light_matrix::Sample;
    use crate::frustum::visible_part;
    use glam::DMat4;
    use std::f64::consts::FRAC_PI_6;

    const SIZE: MapSize = MapSize {
        texels: 400.0,
        margin: 0.01,
    };

    fn camera() -> Camera {
        let pose =
            DMat4::from_translation(DVec3::new(1.0, 1.7, 2.0)) * DMat4::from_rotation_x(-0.25);
        let centre = DVec2::splat(90.0);
        Camera::new(pose, DVec2::splat(150.0), centre, (180, 180), (0.1, 60.0)).unwrap()
    }

    fn floor(camera: &Camera) -> Vec<DVec3> {
        let pixels = (0..180)
            .step_by(3)
            .flat_map(|y| (0..180).step_by(5).map(move |x| (x, y)));
        let rays = pixels.map(|(x, y)| camera.ray_from_pixel(x, y));
        rays.filter(|ray| ray.y < -0.03)
            .map(|ray| camera.eye - ray * (camera.eye.y / ray.y))
            .collect()
    }

    fn lights() -> Vec<Light> {
        let mut lights = Vec::new();
        for height in [-0.1, -0.5, -1.0, -4.0] {
            for turn in 0..12 {
                let (sin, cos) = (0.1 + f64::from(turn) * FRAC_PI_6).sin_cos();
                lights.push(Light::directional(DVec3::new(sin, height, cos)).unwrap());
            }
        }
        // So high that it has all of the floor in front.
        lights.push(Light::point(DVec3::new(5.0, 80.0, -20.0)).unwrap());
        lights
    }

    fn samples(subject: &Subject, camera: &Camera) -> Vec<Sample> {
        let points = subject.points.iter();
        points
            .map(|&point| Sample::new(&subject.rays, camera, point, DVec3::Y))
            .collect()
    }

    #[test]
    fn what_a_method_promises_it_holds() {
        let camera = camera();
        let body = visible_part(&camera, (DVec3::splat(-50.0), DVec3::splat(50.0)));
        for light in lights() {
            for points in [floor(&camera), body.clone()] {
                let Some(subject) = Subject::new(&light, points) else {
                    continue;
                };
                let fits = [
                    focused(&subject, SIZE),
                    light_space_perspective(&subject, &camera, SIZE),
                    perspective(&subject, &camera, SIZE),
                ];
                for (i, matrix) in fits.into_iter().enumerate() {
                    let matrix = matrix.unwrap_or_else(|| panic!("{i} {light:?}"));
                    for point in &subject.points {
                        let place = matrix.place(subject.rays.ray_from_point(*point));
                        assert!(place.abs().max_element() <= 200.0, "{i} {place}");
                    }
                }
            }
        }
    }

    #[test]
    fn perspectives_serve_a_floor_better_than_none() {
        let camera = camera();
        let mut sums = [0.0; 3];
        for light in lights() {
            let subject = Subject::new(&light, floor(&camera)).unwrap();
            let samples = samples(&subject, &camera);
            let fits = [
                focused(&subject, SIZE),
                light_space_perspective(&subject, &camera, SIZE),
                perspective(&subject, &camera, SIZE),
            ];
            for (sum, fit) in sums.iter_mut().zip(fits) {
                *sum += fit.unwrap().h(&samples).ln() / lights().len() as f64;
            }
        }
        println!("{sums:?}");
        assert!(
            sums[1] < sums[0] - 0.5 && sums[2] < sums[0] - 0.5,
            "{sums:?}"
        );
    }

    #[test]
    fn texels_of_the_optimal_plane_are_pixels() {
        let camera = camera();
        for light in lights() {
            let subject = Subject::new(&light, floor(&camera)).unwrap();
            let normals = vec![DVec3::Y; subject.points.len()];
            let plane = dominant_plane(&subject.points, &normals).unwrap();
            let matrix = plane_optimal(&subject, &camera, plane, PlaneFrame::Points, SIZE).unwrap();
            let badness: Vec<_> = samples(&subject, &camera)
                .iter()
                .map(|sample| matrix.badness(sample))
                .collect();
            for value in &badness {
                assert!(
                    (value / badness[0] - 1.0).abs() < 1e-6,
                    "{value} {}",
                    badness[0]
                );
            }
        }
    }

    #[test]
    fn the_plane_of_most_points_is_found() {
        let mut points = floor(&camera());
        let mut normals = vec![DVec3::Y; points.len()];
        for i in 0..points.len() / 3 {
            points.insert(i * 2, DVec3::new(i as f64 * 0.01, 3.0, -4.0));
            normals.insert(i * 2, DVec3::Z);
        }
        let plane = dominant_plane(&points, &normals).unwrap();
        assert!((plane / plane.y - DVec4::Y).length() < 1e-9, "{plane}");
    }

    #[test]
    fn degenerate_subjects_have_no_fit() {
        let sun = Light::directional(DVec3::NEG_Y).unwrap();
        assert_eq!(Subject::new(&sun, vec![]), None);
        let bulb = Light::point(DVec3::ZERO).unwrap();
        assert_eq!(Subject::new(&bulb, vec![DVec3::X, DVec3::NEG_X]), None);
        let camera = camera();
        let along = Light::directional(camera.forward).unwrap();
        let subject = Subject::new(&along, floor(&camera)).unwrap();
        assert_eq!(light_space_perspective(&subject, &camera, SIZE), None);
        let grazing = Light::directional(DVec3::X).unwrap();
        let subject = Subject::new(&grazing, floor(&camera)).unwrap();
        assert_eq!(
            plane_optimal(&subject, &camera, DVec4::Y, PlaneFrame::Image, SIZE),
            None
        );
    }
}
