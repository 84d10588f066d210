//! What a light's depth image makes of each cell of its map, as `shaders/forward_importance.wgsl`.

use super::cells::filled;
use super::depth_image::DepthImage;
use super::importance_map::{Words, cell_at, factor_of_normal, weight_of_place};
use super::rasterize::NONE;
use crate::camera::Camera;
use crate::importance::{Factors, ImportanceMap};
use crate::projection::Projection;
use crate::scene::Scene;
use glam::{DMat3, DVec2, DVec3};

/// The greatest importance in each cell of what the light sees.
pub fn forward_importance(
    scene: &Scene,
    camera: &Camera,
    projection: &Projection,
    image: &DepthImage,
    cells: u32,
    factors: Factors<Words>,
) -> ImportanceMap<Words> {
    let seen = SeenByLight {
        scene,
        camera,
        projection,
        image,
        steps: projection.steps(),
        // The shaders' projection space is scaled where a texel's width grows with the distance to the light.
        unit: match projection.kind.is_central() {
            true => projection.unit(),
            false => 1.0,
        },
        factors,
    };
    let sides = [projection.width, projection.height].map(f64::from);
    let columns = projection.width as usize;
    let count = (cells as usize).pow(2);
    let values = filled(count, projection.height as usize, u32::max, |map, row| {
        for column in 0..columns {
            let centre = DVec2::new(column as f64, row as f64) + 0.5;
            let place = [centre.x / sides[0], centre.y / sides[1]].map(|place| place as f32);
            if let Some(value) = seen.value(row * columns + column, centre, place) {
                let [x, y] = place.map(|place| cell_at(place, cells) as usize);
                let cell = &mut map[y * cells as usize + x];
                *cell = value.to_bits().max(*cell);
            }
        }
    });
    ImportanceMap {
        values,
        cells,
        count_unit: None,
    }
}

struct SeenByLight<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    projection: &'a Projection,
    image: &'a DepthImage,
    steps: DMat3,
    unit: f64,
    factors: Factors<'a, Words>,
}

impl SeenByLight<'_> {
    /// The importance of a texel; `None` where nothing is seen, or the camera does not see it.
    fn value(&self, texel: usize, centre: DVec2, place: [f32; 2]) -> Option<f32> {
        let triangle = self.image.triangles[texel];
        if triangle == NONE {
            return None;
        }
        let (projection, camera) = (self.projection, self.camera);
        let ray = projection
            .kind
            .ray_from_texel((centre - projection.centre).into());
        let depth = f64::from(self.image.depths[texel]);
        let q = projection.kind.projected_from_ray(ray, depth);
        let from_eye = projection.origin - camera.eye + self.steps * DVec3::from(q);
        // Desired view (5.1).
        let (pixel, z) = camera.place_from_eye(from_eye);
        let size = DVec2::new(camera.width.into(), camera.height.into());
        let is_inside = pixel.cmpge(DVec2::ZERO).all() && pixel.cmple(size).all();
        if z <= camera.znear || z > camera.zfar || !is_inside {
            return None;
        }
        let factors = &self.factors;
        let mut value = 1.0;
        if factors.distance {
            value = (projection.kind.texel_width(q) * self.unit / camera.width_at(z)) as f32;
        }
        if let Some(bonus) = factors.normal {
            let normal = self.scene.unit_normals()[triangle as usize];
            let sight = camera.sight_of(from_eye);
            value *= factor_of_normal(bonus, normal.as_dvec3(), sight);
        }
        if let Some(edges) = factors.shadow_edge {
            value *= f32::from_bits(edges.values[texel]);
        }
        Some(value * weight_of_place(factors.map_weights, place))
    }
}
