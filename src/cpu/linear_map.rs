//! Maps of linear rasterization, as published: pieces of triangles with straight edges in the map, seen by parallel rays, one
//! for each texel.

use super::bins::Cover;
use super::known::Known;
use super::lanes::{dispatch, level};
use super::rasterize::{NONE, Painter};
use super::tessellate::Piece;
use super::texels::{EMPTY, Texels, drawn_by};
use super::tiles::{TILE, Tiling};
use super::view::{Nearness, Planes, View};
use crate::error::Result;
use crate::projection::Projection;
use crate::scene::Scene;
use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};

/// Of pieces that were asked for before, their depth times a function of (column, row, 1), relative to a place, and that
/// function.
type KnownDepths = Known<[DVec3; 2], 64>;

/// Draws pieces: triangles and depths of the texels.
pub fn drawn_linear(projection: &Projection, pieces: &[Piece]) -> Result<Texels> {
    let view = View {
        origin: DVec3::ZERO,
        rows: [DVec4::X, DVec4::Y, DVec4::W],
        nearness: Nearness::Linear(DVec4::Z),
        width: projection.width as usize,
        height: projection.height as usize,
        seen: (f64::NEG_INFINITY, f64::INFINITY),
        light: None,
    };
    let is_central = projection.kind.matrices().is_some() && projection.kind.is_central();
    // The greater, the nearer, and linear over a piece.
    let nearness = |corner: &DVec4| match is_central {
        true => 1.0 / corner.z,
        false => -corner.z / corner.w,
    };
    if pieces.is_empty() {
        return Ok(empty(&view));
    }
    let corners = pieces.iter().flat_map(|piece| &piece.corners);
    let vertices = corners.map(|corner| corner.xy().extend(nearness(corner)));
    let triangles = (0..pieces.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
    let scene = Scene::new(vertices.collect(), triangles.collect())?;
    let places = view.places(&scene);
    let (painter, bins) = Painter::new(&view, &scene, &places, Cover::Middles);
    let unit = projection.unit();
    Ok(drawn_by(
        (painter.tiling, None),
        || (),
        |(), (tile, blocks), ids, texels| {
            let bins = bins.iter().map(|of_thread| &of_thread[tile]);
            dispatch!(level(), simd => painter.draw_tile(simd, bins, (tile, blocks), ids, texels));
            let (x, y) = painter.tiling.corner(tile);
            let corner = DVec2::new(x as f64, y as f64);
            let mut known = KnownDepths::default();
            for (i, (id, texel)) in ids.iter_mut().zip(texels).enumerate() {
                if *id == NONE {
                    *texel = EMPTY;
                    continue;
                }
                let find = || depths(&painter, &pieces[*id as usize], *id, corner);
                let [depth, one] = *known.get(*id, find);
                let place = DVec3::new((i % TILE) as f64 + 0.5, (i / TILE) as f64 + 0.5, 1.0);
                *texel = (depth.dot(place) / one.dot(place) * unit) as f32;
                *id = pieces[*id as usize].triangle;
            }
        },
    ))
}

fn empty(view: &View) -> Texels {
    let tiling = Tiling::new(view.width, view.height);
    drawn_by(
        (tiling, None),
        || (),
        |(), _, ids, texels| {
            ids.fill(NONE);
            texels.fill(EMPTY);
        },
    )
}

/// The values of the edges at a place are barycentric coordinates there.
fn depths(painter: &Painter, piece: &Piece, id: u32, corner: DVec2) -> [DVec3; 2] {
    let planes = Planes::new(painter.view, painter.scene, id, corner);
    let edges = planes.map_or([DVec3::ZERO; 3], |planes| planes.edges);
    let weighted = |value: fn(&DVec4) -> f64| {
        let of_corners = edges.iter().zip(&piece.corners);
        of_corners.map(|(edge, corner)| *edge * value(corner)).sum()
    };
    [
        weighted(|corner| corner.z / corner.w),
        weighted(|corner| 1.0 / corner.w),
    ]
}
