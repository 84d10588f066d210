//! Frames: from a scene, a camera, lights and a method to arrays.

use super::parameters::method_from_python;
use super::world::{PyCamera, PyLight, PyScene};
use super::{adapter_to_python, check_process, image};
use crate::aliasing::RenderedLayer;
use crate::gpu::view::Stats;
use crate::light::Light;
use crate::render::{
    MAX_TOGETHER, Output, Outputs, Rendered as RenderedFrame, render as render_frames,
};
use numpy::ndarray::{Array3, Array4};
use numpy::{PyArray2, PyArray3, PyArray4};
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// What one light's frame has to show; `None` where it was not asked for.
#[pyclass(module = "lixel._core", frozen, get_all)]
pub struct Rendered {
    visibility: Py<PyArray2<f32>>,
    triangle_id: Option<Py<PyArray2<i32>>>,
    shadow_map: Option<Py<PyArray3<f32>>>,
    importance_map: Option<Py<PyArray3<f32>>>,
    warp_map: Option<Py<PyArray4<f32>>>,
    light_matrix: Option<Py<PyArray3<f64>>>,
    aliasing_error: Option<Py<PyArray2<f32>>>,
    largest_aliasing_error: Option<f64>,
    max_effective_resolution: Option<(f64, f64)>,
    timings: Py<PyDict>,
    stats: Py<PyDict>,
    adapter: Py<PyDict>,
}

/// The frames of one method, one for each light.
#[pyfunction]
#[pyo3(signature = (scene, camera, lights, method, parameters, outputs, *, culling=true))]
pub fn render<'py>(
    scene: &PyScene,
    camera: &PyCamera,
    lights: Vec<PyRef<'py, PyLight>>,
    method: &str,
    parameters: &Bound<'py, PyDict>,
    outputs: Vec<String>,
    culling: bool,
) -> PyResult<Vec<Rendered>> {
    check_process()?;
    let py = parameters.py();
    let method = method_from_python(method, parameters)?;
    let outputs = Outputs::from_names(&outputs, culling)?;
    let camera = &camera.0;
    let shape = (camera.height as usize, camera.width as usize);
    let lights: Vec<&Light> = lights.iter().map(|light| &light.0).collect();
    let mut rendered = Vec::with_capacity(lights.len());
    for group in lights.chunks(MAX_TOGETHER) {
        py.check_signals()?;
        let frames = py.detach(|| {
            let (scene, cache) = (scene.read(), &scene.cache);
            render_frames(&scene, cache, camera, group, &method, outputs)
        })?;
        for frame in frames {
            rendered.push(to_python(py, shape, frame, outputs)?);
        }
    }
    Ok(rendered)
}

fn to_python(
    py: Python,
    shape: (usize, usize),
    frame: RenderedFrame,
    outputs: Outputs,
) -> PyResult<Rendered> {
    let asks = |output| outputs.has(output).then_some(());
    let timings = PyDict::new(py);
    for (label, milliseconds) in frame.timings {
        timings.set_item(label, milliseconds)?;
    }
    let shadow_map =
        asks(Output::ShadowMap).map(|()| depths_of_layers(&frame.layers, frame.shadow_map));
    let importance_map = asks(Output::ImportanceMap).map(|()| {
        let maps = stacked(frame.importance_maps, 1);
        let (layers, _, rows, columns) = maps.dim();
        let maps = maps.into_shape_with_order((layers, rows, columns));
        maps.expect("one block for each map")
    });
    let light_matrix = asks(Output::LightMatrix).map(|()| matrices(&frame.layers));
    let warp_map = asks(Output::WarpMap).map(|()| {
        let warps = frame.layers.into_iter().filter_map(|layer| layer.warp);
        let maps = warps.map(|warp| (warp.functions, warp.boundaries, warp.values));
        stacked(maps.collect(), 2)
    });
    let triangle_id = asks(Output::TriangleId).map(|()| frame.triangle_id);
    Ok(Rendered {
        visibility: image(py, shape, frame.visibility).unbind(),
        triangle_id: triangle_id.map(|ids| image(py, shape, ids).unbind()),
        shadow_map: shadow_map.map(|maps| PyArray3::from_owned_array(py, maps).unbind()),
        importance_map: importance_map.map(|maps| PyArray3::from_owned_array(py, maps).unbind()),
        warp_map: warp_map.map(|maps| PyArray4::from_owned_array(py, maps).unbind()),
        light_matrix: light_matrix.map(|maps| PyArray3::from_owned_array(py, maps).unbind()),
        aliasing_error: frame
            .aliasing_error
            .map(|error| image(py, shape, error).unbind()),
        largest_aliasing_error: frame.largest_aliasing_error,
        max_effective_resolution: frame.max_effective_resolution.map(|size| (size.x, size.y)),
        timings: timings.unbind(),
        stats: stats_to_python(py, &frame.stats)?.unbind(),
        adapter: adapter_to_python(py, &frame.adapter)?.unbind(),
    })
}

/// Depths per texel, layer after layer, as (layers, rows, columns).
fn depths_of_layers(layers: &[RenderedLayer], depths: Vec<f32>) -> Array3<f32> {
    let (height, width) = layers.first().map_or((0, 0), |layer| {
        let map = &layer.fitted.projection;
        (map.height as usize, map.width as usize)
    });
    Array3::from_shape_vec((layers.len(), height, width), depths)
        .expect("every layer has the size of the first")
}

/// Of each layer, texels from the world.
fn matrices(layers: &[RenderedLayer]) -> Array3<f64> {
    let matrices = layers.iter();
    let matrices = matrices.map(|layer| layer.fitted.projection.texel_from_world());
    let matrices: Vec<_> = matrices.collect();
    Array3::from_shape_fn((matrices.len(), 4, 4), |(layer, row, column)| {
        matrices[layer].col(column)[row]
    })
}

/// Maps of (rows, columns, values) each, `blocks` times rows, as (layers, blocks, rows, columns).
fn stacked(maps: Vec<(usize, usize, Vec<f32>)>, blocks: usize) -> Array4<f32> {
    let count = maps.len();
    let (rows, columns) = maps.first().map_or((0, 0), |map| (map.0, map.1));
    let values: Vec<f32> = maps.into_iter().flat_map(|map| map.2).collect();
    Array4::from_shape_vec((count, blocks, rows, columns), values)
        .expect("every layer has a map of the size of the first's")
}

fn stats_to_python<'py>(py: Python<'py>, stats: &Stats) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("triangles", stats.triangles)?;
    result.set_item("degenerate_triangles", stats.degenerate_triangles)?;
    result.set_item("layers", stats.layers)?;
    result.set_item("skipped_layers", stats.skipped_layers)?;
    for (label, facts) in &stats.facts.0 {
        let pass = PyDict::new(py);
        for fact in facts {
            pass.set_item(fact.name, fact.value)?;
        }
        result.set_item(label, pass)?;
    }
    if let Some(counts) = stats.receivers {
        result.set_item("covered_pixels", counts.seen)?;
        result.set_item("facing_pixels", counts.facing)?;
    }
    for (name, value) in &stats.measures {
        result.set_item(name, value)?;
    }
    result.set_item("skipped", &stats.skipped)?;
    Ok(result)
}
