//! Depth discontinuities of a light's depth image, as `shaders/shadow_edge.wgsl`.

use super::depth_image::DepthImage;
use super::importance_map::Words;
use crate::importance::{EdgeBias, Grid};
use crate::projection::Projection;
use glam::DVec2;
use rayon::prelude::*;

/// The factor of each texel: 1 where its depth differs from a neighbour's by more than the bias, else `floor`.
pub fn shadow_edge(
    projection: &Projection,
    image: &DepthImage,
    bias: EdgeBias,
    floor: f64,
) -> Grid<Words> {
    let (columns, rows) = (projection.width as usize, projection.height as usize);
    let [constant, beam] = bias.depths(projection, 1.0);
    let mut edges = vec![0; columns * rows];
    let of_rows = edges.par_chunks_mut(columns).enumerate();
    of_rows.for_each(|(y, edges)| {
        for (x, edge) in edges.iter_mut().enumerate() {
            let middle = image.depths[y * columns + x];
            let mut jump = 0.0;
            for near in y.saturating_sub(1)..(y + 2).min(rows) {
                let row = &image.depths[near * columns..][..columns];
                for &depth in &row[x.saturating_sub(1)..(x + 2).min(columns)] {
                    // Both may be empty.
                    jump = f32::max(
                        jump,
                        if depth == middle {
                            0.0
                        } else {
                            (depth - middle).abs()
                        },
                    );
                }
            }
            let place = DVec2::new(x as f64, y as f64) + 0.5 - projection.centre;
            let least = || {
                let ray = projection.kind.ray_from_texel(place.into());
                let point = projection.kind.projected_from_ray(ray, middle.into());
                constant + beam * projection.kind.beam_growth(point)
            };
            // Beside nothing every depth is an edge.
            let is_edge = jump == f32::INFINITY || jump > 0.0 && f64::from(jump) > least();
            *edge = (if is_edge { 1.0 } else { floor as f32 }).to_bits();
        }
    });
    Grid {
        values: edges,
        columns: projection.width,
        rows: projection.height,
    }
}
