//! Warps by themselves.

use super::parameters::samples_from_python;
use super::{array, check_process};
use crate::map_size::MapSize;
use crate::warp::samples::SampledWarp;
use glam::DVec2;
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

/// Where a warp by samples takes points, or where it takes them from; not numbers where it does not reach.
#[pyfunction]
pub fn sampled_points<'py>(
    samples: &Bound<'py, PyAny>,
    points: PyReadonlyArray2<'py, f64>,
    is_inverse: bool,
) -> PyResult<Py<PyArray2<f64>>> {
    check_process()?;
    let tables = samples_from_python(samples)?.tables;
    let warp = SampledWarp::new(&tables[0], MapSize::square(1));
    let points = points.as_array();
    let places = points.outer_iter().flat_map(|point| {
        let point = DVec2::new(point[0], point[1]);
        let place = match is_inverse {
            true => warp.linear_from_warped(point),
            false => warp.warped_place(point).unwrap_or(DVec2::NAN),
        };
        place.to_array()
    });
    Ok(array(samples.py(), (points.nrows(), 2), places.collect()))
}
