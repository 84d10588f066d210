//! Samples of pixels, counted by the CPU engine.

use super::world::{PyCamera, PyLight, PyScene};
use super::{array, check_process};
use crate::cpu::samples::{Counted, MAX_SAMPLES, count_samples as count};
use crate::threads::on_threads;
use glam::DVec2;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

#[pyfunction]
#[pyo3(signature = (scene, camera, light, places, threads=None))]
pub fn count_samples<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    light: &PyLight,
    places: Vec<(f64, f64)>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let is_near = |(x, y): &(f64, f64)| x.abs() <= 0.5 && y.abs() <= 0.5;
    if places.is_empty() || places.len() > MAX_SAMPLES || !places.iter().all(is_near) {
        return Err(PyValueError::new_err(format!(
            "places must be 1 to {MAX_SAMPLES}, within half a pixel of the centre, got {places:?}"
        )));
    }
    let places: Vec<_> = places.into_iter().map(DVec2::from).collect();
    let Counted {
        lit,
        seen,
        effort,
        timings,
    } = py.detach(|| {
        let (world, kept) = (scene.read(), &scene.cache.cpu);
        on_threads(threads, || {
            count(&world, &camera.0, &light.0, &places, kept)
        })
    })?;
    let effort = [
        ("whole_pixels", effort.whole_pixels),
        ("open_pixels", effort.open_pixels),
        ("mixed_pixels", effort.mixed_pixels),
        ("tested_samples", effort.tested_samples),
    ];
    let result = PyDict::new(py);
    result.set_item("lit", array(py, camera.shape(), lit))?;
    result.set_item("seen", array(py, camera.shape(), seen))?;
    result.set_item("effort", effort.into_py_dict(py)?)?;
    result.set_item("timings", timings.into_py_dict(py)?)?;
    Ok(result)
}
