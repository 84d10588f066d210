//! The part of a box of the world that a camera may see.

use crate::camera::Camera;
use crate::region::HalfSpace;
use glam::{DVec2, DVec3};

/// The part of a convex polygon in a half space (Sutherland and Hodgman, 1974).
fn clip(polygon: &[DVec3], half: &HalfSpace) -> Vec<DVec3> {
    let mut inside = Vec::new();
    for (i, &a) in polygon.iter().enumerate() {
        let b = polygon[(i + 1) % polygon.len()];
        let (above_a, above_b) = (half.height(a), half.height(b));
        if above_a >= 0.0 {
            inside.push(a);
        }
        if (above_a >= 0.0) != (above_b >= 0.0) {
            inside.push(a + (b - a) * (above_a / (above_a - above_b)));
        }
    }
    inside
}

fn clip_all(polygon: Vec<DVec3>, half_spaces: &[HalfSpace]) -> Vec<DVec3> {
    let clipped = half_spaces.iter();
    clipped.fold(polygon, |polygon, half| clip(&polygon, half))
}

/// The corners of the camera's image at a depth.
fn corners_at(camera: &Camera, depth: f64) -> [DVec3; 4] {
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    let corners = [DVec2::ZERO, size * DVec2::X, size, size * DVec2::Y];
    corners.map(|corner| {
        let (start, ray) = camera.ray_from_place(corner);
        camera.eye + start + ray * depth
    })
}

/// Faces of the hexahedron of two opposite quadrilaterals.
fn faces(near: [DVec3; 4], far: [DVec3; 4]) -> Vec<Vec<DVec3>> {
    let sides = (0..4).map(|i| {
        let j = (i + 1) % 4;
        vec![near[i], near[j], far[j], far[i]]
    });
    sides.chain([near.to_vec(), far.to_vec()]).collect()
}

/// The half spaces of faces, the middle inside.
fn half_spaces(faces: &[Vec<DVec3>], middle: DVec3) -> Vec<HalfSpace> {
    let half = |face: &Vec<DVec3>| {
        let normal = (face[2] - face[0]).cross(face[3] - face[1]);
        let origin = face.iter().sum::<DVec3>() / face.len() as f64;
        HalfSpace {
            origin,
            normal: normal * normal.dot(middle - origin).signum(),
        }
    };
    faces.iter().map(half).collect()
}

/// Corners of the part of a box, from its least to its greatest corner, that is in the camera's
/// frustum; none where nothing is.
pub fn visible_part(camera: &Camera, (low, high): (DVec3, DVec3)) -> Vec<DVec3> {
    let square = |z: f64| {
        [
            (low.x, low.y),
            (high.x, low.y),
            (high.x, high.y),
            (low.x, high.y),
        ]
        .map(|(x, y)| DVec3::new(x, y, z))
    };
    let (bottom, top) = (square(low.z), square(high.z));
    let depths = bottom.iter().chain(&top).map(|corner| {
        // Room for the far plane to lie behind the box.
        (*corner - camera.eye).dot(camera.forward) * 1.001
    });
    let far = depths.fold(camera.znear, f64::max).min(camera.zfar);
    if far <= camera.znear {
        return vec![];
    }
    let frustum = faces(corners_at(camera, camera.znear), corners_at(camera, far));
    let cuboid = faces(bottom, top);
    let axis = camera.eye + camera.forward * (0.5 * (camera.znear + far));
    let inside = corners_at(camera, 0.5 * (camera.znear + far));
    let middle = 0.5 * axis + 0.125 * inside.iter().sum::<DVec3>();
    let frustum_sides = half_spaces(&frustum, middle);
    let box_sides: Vec<_> = DVec3::AXES
        .into_iter()
        .flat_map(|axis| {
            [(low, axis), (high, -axis)].map(|(origin, normal)| HalfSpace { origin, normal })
        })
        .collect();
    // A corner of the part is one of the box's faces cut by the frustum, or the other way round.
    let mut corners = Vec::new();
    for face in cuboid {
        corners.extend(clip_all(face, &frustum_sides));
    }
    for face in frustum {
        corners.extend(clip_all(face, &box_sides));
    }
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;

    fn camera(zfar: f64) -> Camera {
        let pose = DMat4::from_translation(DVec3::new(0.0, 2.0, 5.0));
        let centre = DVec2::new(60.0, 50.0);
        Camera::new(pose, DVec2::splat(80.0), centre, (120, 90), (0.1, zfar)).unwrap()
    }

    fn is_seen(camera: &Camera, point: DVec3) -> bool {
        let sight = point - camera.eye;
        let depth = sight.dot(camera.forward);
        let image = DVec2::new(sight.dot(camera.right), -sight.dot(camera.up)) / depth;
        let pixel = image * camera.focal + camera.centre;
        depth > camera.znear
            && depth < camera.zfar
            && pixel.min_element() > 0.0
            && pixel.x < f64::from(camera.width)
            && pixel.y < f64::from(camera.height)
    }

    #[test]
    fn every_visible_point_of_the_box_is_between_the_corners() {
        let (low, high) = (DVec3::new(-9.0, 0.0, -30.0), DVec3::new(9.0, 6.0, 20.0));
        for zfar in [12.0, 1e3, f64::INFINITY] {
            let camera = camera(zfar);
            let corners = visible_part(&camera, (low, high));
            for i in 0..4000 {
                let unit = |k: u64| (i * k % 4001) as f64 / 4001.0;
                let point = low + (high - low) * DVec3::new(unit(7), unit(1201), unit(3307));
                if !is_seen(&camera, point) {
                    continue;
                }
                // No plane through the point has all corners on one side.
                for j in 0..24 {
                    let direction = DVec3::new(
                        f64::from(j).sin(),
                        f64::from(j * 5).cos(),
                        f64::from(j * 3).sin(),
                    );
                    let heights = corners.iter().map(|c| direction.dot(*c - point));
                    assert!(heights.fold(f64::NEG_INFINITY, f64::max) > -1e-9);
                }
            }
            for corner in &corners {
                let slack = 1e-9 * DVec3::ONE;
                assert!(corner.cmpge(low - slack).all() && corner.cmple(high + slack).all());
                let depth = (*corner - camera.eye).dot(camera.forward);
                assert!(depth > camera.znear - 1e-9 && depth < camera.zfar + 1e-9);
            }
        }
    }

    #[test]
    fn nothing_is_seen_of_a_box_behind() {
        let behind = (DVec3::new(-1.0, 0.0, 6.0), DVec3::new(1.0, 1.0, 9.0));
        assert!(visible_part(&camera(f64::INFINITY), behind).is_empty());
    }
}
