//! Points anywhere in space, and whether lights reach them.

use super::world::{PyLight, PyScene, points as points_of};
use super::{array, check_process};
use crate::cpu::points::{CHUNK_POINTS, LitPoints, Points, prefers_rays};
use crate::threads::on_threads;
use numpy::{PyArray2, PyReadonlyArray2};
use pyo3::prelude::*;

/// 1 or 0 for each light and point; points come with what was rounded of a coordinate, as a share of it. After each piece of work `advance` is told how many answers it gave.
#[pyfunction]
#[pyo3(signature = (scene, points, normals, lights, threads, advance, *, by_rays=None))]
pub fn shadows_at<'py>(
    scene: &PyScene,
    points: (PyReadonlyArray2<'py, f64>, f64),
    normals: Option<PyReadonlyArray2<'py, f64>>,
    lights: Vec<PyRef<'py, PyLight>>,
    threads: Option<usize>,
    advance: Bound<'py, PyAny>,
    by_rays: Option<bool>,
) -> PyResult<Py<PyArray2<f32>>> {
    check_process()?;
    let py = advance.py();
    let (points, rounding) = points;
    let positions = points_of("points", &points)?;
    let normals = normals.map(|normals| points_of("normals", &normals));
    let normals = normals.transpose()?;
    let lights: Vec<_> = lights.iter().map(|light| &light.0).collect();
    let count = positions.len();
    let world = scene.read();
    let by_rays =
        by_rays.unwrap_or_else(|| prefers_rays(world.triangles().len(), count, lights.len()));
    let (points, hierarchy) = py.detach(|| {
        on_threads(threads, || {
            let hierarchy = by_rays.then(|| scene.cache.cpu.hierarchy(&world));
            let points = Points::new(&world, &positions, normals.as_deref(), rounding);
            Ok((points, hierarchy.transpose()?))
        })
    })?;
    let hierarchy = hierarchy.as_ref().map(|(hierarchy, _)| &hierarchy.made);
    let mut answers = vec![0; count];
    let mut visibility = vec![0.0; lights.len() * count];
    for (light, visibility) in lights.iter().zip(visibility.chunks_mut(count.max(1))) {
        let lit =
            py.detach(|| on_threads(threads, || Ok(LitPoints::new(&points, light, hierarchy))))?;
        for (i, answers) in answers.chunks_mut(CHUNK_POINTS).enumerate() {
            py.check_signals()?;
            let first = i * CHUNK_POINTS;
            py.detach(|| {
                on_threads(threads, || {
                    lit.answer(first, answers);
                    Ok(())
                })
            })?;
            advance.call1((answers.len(),))?;
        }
        py.detach(|| {
            on_threads(threads, || {
                points.as_given(&answers, visibility);
                Ok(())
            })
        })?;
    }
    Ok(array(py, (lights.len(), count), visibility))
}
