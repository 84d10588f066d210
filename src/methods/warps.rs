//! Layers with a warp: those of `rtw` and of `notw`, which `exact` uses, too.

use crate::error::Result;
use crate::fits::layer::Layer;
use crate::gpu::passes::importance_map::ImportanceMap;
use crate::gpu::passes::warp_map::WarpMap;
use crate::gpu::view::{View, WarpedLayer};
use crate::warp::{Axis, CountFit};

/// One function for all rows and one for all columns, by the maxima of an importance map (Rosen); `blur` is a standard
/// deviation in cells.
pub fn rectilinear(
    view: &mut View,
    layer: Layer,
    cells: u32,
    blur: f64,
    importance: impl FnOnce(&mut View, &Layer) -> Result<ImportanceMap>,
) -> Result<WarpedLayer> {
    let resolution = layer.projection.width;
    let warp = WarpMap::new(view.frame(), 1, cells, resolution)?;
    let importance = importance(view, &layer)?;
    let frame = view.frame();
    for axis in [Axis::X, Axis::Y] {
        warp.fit_maxima(frame, axis, resolution, &importance.values, blur)?;
    }
    warp.finish(frame, resolution);
    Ok(WarpedLayer {
        layer,
        warp: Some(warp),
        importance: Some(importance),
    })
}

/// Functions for rows and for columns, by counts of receivers (Milet et al.). The counts along y are of where the
/// functions along x put them.
pub fn non_orthogonal(
    view: &mut View,
    layer: Layer,
    [functions, cells]: [u32; 2],
    fit: CountFit,
    mut counts: impl FnMut(&mut View, &Layer, Axis, &WarpMap) -> Result<ImportanceMap>,
) -> Result<WarpedLayer> {
    let resolution = layer.projection.width;
    let warp = WarpMap::new(view.frame(), functions, cells, resolution)?;
    let mut importance = None;
    for axis in [Axis::X, Axis::Y] {
        let counts = counts(view, &layer, axis, &warp)?;
        warp.fit_counts(view.frame(), axis, resolution, &counts.values, fit)?;
        importance.get_or_insert(counts);
    }
    warp.finish(view.frame(), resolution);
    Ok(WarpedLayer {
        layer,
        warp: Some(warp),
        importance,
    })
}
