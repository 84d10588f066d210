//! Layers with a warp: those of `rtw` and of `notw`, which `exact` uses, too.

use crate::error::Result;
use crate::fits::layer::Layer;
use crate::importance::ImportanceMap;
use crate::verbs::{LayerOf, Verbs, WarpedLayer};
use crate::warp::{Axis, CountFit};

/// One function for all rows and one for all columns, by the maxima of an importance map (Rosen); `blur` is a standard
/// deviation in cells.
pub fn rectilinear<'a, V: Verbs<'a>>(
    view: &mut V,
    layer: Layer,
    cells: u32,
    blur: f64,
    importance: impl FnOnce(&mut V, &Layer) -> Result<ImportanceMap<V::Values>>,
) -> Result<LayerOf<'a, V>> {
    let size = layer.projection.size();
    let mut warp = view.warp(1, cells, size)?;
    let importance = importance(view, &layer)?;
    for axis in [Axis::X, Axis::Y] {
        view.fit_maxima(&mut warp, axis, size, &importance, blur)?;
    }
    view.finish_warp(&mut warp, size);
    Ok(WarpedLayer {
        layer,
        warp: Some(warp),
        importance: Some(importance),
    })
}

/// A warp without its inverses, and what it was made from.
pub type Functions<'a, V> = (
    <V as Verbs<'a>>::Warp,
    Option<ImportanceMap<<V as Verbs<'a>>::Values>>,
);

/// Functions for rows and for columns, by counts of receivers (Milet et al.). The counts along y are of where the
/// functions along x put them.
pub fn functions_of_counts<'a, V: Verbs<'a>>(
    view: &mut V,
    layer: &Layer,
    [functions, cells]: [u32; 2],
    fit: CountFit,
    mut counts: impl FnMut(&mut V, &Layer, Axis, &V::Warp) -> Result<ImportanceMap<V::Values>>,
) -> Result<Functions<'a, V>> {
    let size = layer.projection.size();
    let mut warp = view.warp(functions, cells, size)?;
    let mut importance = None;
    for axis in [Axis::X, Axis::Y] {
        let counts = counts(view, layer, axis, &warp)?;
        view.fit_counts(&mut warp, axis, size, &counts, fit)?;
        importance.get_or_insert(counts);
    }
    Ok((warp, importance))
}

/// A layer with such functions.
pub fn non_orthogonal<'a, V: Verbs<'a>>(
    view: &mut V,
    layer: Layer,
    sizes: [u32; 2],
    fit: CountFit,
    counts: impl FnMut(&mut V, &Layer, Axis, &V::Warp) -> Result<ImportanceMap<V::Values>>,
) -> Result<LayerOf<'a, V>> {
    let (mut warp, importance) = functions_of_counts(view, &layer, sizes, fit, counts)?;
    view.finish_warp(&mut warp, layer.projection.size());
    Ok(WarpedLayer {
        layer,
        warp: Some(warp),
        importance,
    })
}
