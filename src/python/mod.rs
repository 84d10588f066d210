//! The door to Python: only the files in this folder name pyo3. Arrays in, arrays out, errors to exceptions;
//! the GIL is released while the work is done. `python/lixel/_core.pyi` documents what is here.

mod parameters;
mod world;

use crate::aliasing;
use crate::bvh::Everything;
use crate::error::Error;
use crate::gpu;
use crate::gpu::passes::LABELS;
use crate::light::Light;
use crate::methods::scene_optimized;
use crate::reference::{self, Reference};
use crate::render::{MAX_TOGETHER, Outputs, Rendered, Stats, render as render_frames};
use numpy::ndarray::{Array2, Array3, Array4};
use numpy::{PyArray2, PyArray3, PyArray4, PyReadonlyArray2, ToPyArray};
use parameters::method_from_python;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use std::sync::atomic::{AtomicU32, Ordering};
use world::{PyCamera, PyLight, PyScene};

pyo3::create_exception!(
    lixel,
    DeviceError,
    pyo3::exceptions::PyRuntimeError,
    "The machine cannot do it: no adapter, a missing feature, a limit, a lost device."
);

impl From<Error> for PyErr {
    fn from(error: Error) -> Self {
        match error {
            Error::Value(message) => PyValueError::new_err(message),
            Error::Type(message) => PyTypeError::new_err(message),
            Error::Device(message) => DeviceError::new_err(message),
        }
    }
}

/// Refuses a process that was forked from one that had used lixel: the threads that work here and those
/// of the device stay behind, and waiting for them would never end.
fn check_process() -> PyResult<()> {
    static OWNER: AtomicU32 = AtomicU32::new(0);
    let own = std::process::id();
    let owner = OWNER.compare_exchange(0, own, Ordering::Relaxed, Ordering::Relaxed);
    if owner.is_ok() || owner == Err(own) {
        return Ok(());
    }
    Err(DeviceError::new_err(
        "this process was forked from one that had used lixel, whose threads and device do not come \
         along; start processes with multiprocessing.get_context(\"spawn\"), or fork before the first \
         scene is made",
    ))
}

#[pyfunction]
fn labels() -> Vec<&'static str> {
    let stages = [scene_optimized::LABEL];
    LABELS.iter().copied().chain(stages).collect()
}

#[pyfunction]
#[pyo3(signature = (scene, camera, light, method, parameters, outputs, *, culling=true))]
fn render<'py>(
    scene: &PyScene,
    camera: &PyCamera,
    light: &PyLight,
    method: &str,
    parameters: &Bound<'py, PyDict>,
    outputs: Vec<String>,
    culling: bool,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let py = parameters.py();
    let method = method_from_python(method, parameters)?;
    let asks_for = |name: &str| outputs.iter().any(|output| output == name);
    let asks_for_aliasing = asks_for("aliasing_error");
    let asks_for_largest = asks_for("largest_aliasing_error");
    let wanted = Outputs {
        triangle_id: asks_for("triangle_id") || asks_for_aliasing || asks_for_largest,
        shadow_map: asks_for("shadow_map"),
        importance_map: asks_for("importance_map"),
        warp_map: asks_for("warp_map")
            || asks_for_aliasing
            || asks_for_largest
            || asks_for("max_effective_resolution"),
        without_culling: !culling,
    };
    let (camera, light) = (&camera.0, &light.0);
    let (rendered, aliasing_error, largest_aliasing_error, effective_resolution) =
        py.detach(|| {
            let cache = &scene.cache;
            let scene = scene.read();
            let rendered = render_frames(&scene, cache, camera, &[light], &method, wanted)?;
            let rendered = rendered.into_iter().next().expect("one for each light");
            let layers = &rendered.layers;
            let seen = (asks_for_aliasing || asks_for_largest)
                .then(|| reference::surface(&scene, camera, &rendered.triangle_id));
            let seen_for = |asked: bool| seen.as_ref().filter(|_| asked);
            let aliasing_error = seen_for(asks_for_aliasing).map(|(positions, normals, _)| {
                aliasing::aliasing_error(camera, light, layers, positions, normals)
            });
            let largest = seen_for(asks_for_largest)
                .map(|(_, _, depths)| aliasing::largest_aliasing_error(camera, layers, depths));
            let effective_resolution = asks_for("max_effective_resolution")
                .then(|| aliasing::max_effective_resolution(&scene, camera, light, layers));
            Ok::<_, Error>((rendered, aliasing_error, largest, effective_resolution))
        })?;

    let result = PyDict::new(py);
    let shape = (camera.height as usize, camera.width as usize);
    let Rendered {
        visibility,
        triangle_id,
        shadow_map,
        importance_maps,
        layers,
        timings,
        stats,
        adapter,
    } = rendered;
    result.set_item("visibility", image(py, shape, visibility))?;
    if let Some(aliasing_error) = aliasing_error {
        result.set_item("aliasing_error", image(py, shape, aliasing_error))?;
    }
    if let Some(error) = largest_aliasing_error {
        result.set_item("largest_aliasing_error", error)?;
    }
    if let Some(resolution) = effective_resolution {
        result.set_item("max_effective_resolution", (resolution.x, resolution.y))?;
    }
    if asks_for("triangle_id") {
        result.set_item("triangle_id", image(py, shape, triangle_id))?;
    }
    if wanted.shadow_map {
        let (height, width) = layers.first().map_or((0, 0), |layer| {
            let map = &layer.fitted.projection;
            (map.height as usize, map.width as usize)
        });
        let maps = Array3::from_shape_vec((layers.len(), height, width), shadow_map)
            .expect("every layer has the size of the first");
        result.set_item("shadow_map", PyArray3::from_owned_array(py, maps))?;
    }
    if wanted.importance_map {
        let maps = stacked(importance_maps, 1);
        let shape = maps.dim();
        let maps = maps.into_shape_with_order((shape.0, shape.2, shape.3));
        let maps = maps.expect("one block for each map");
        result.set_item("importance_map", PyArray3::from_owned_array(py, maps))?;
    }
    if asks_for("light_matrix") {
        let matrices: Vec<_> = layers
            .iter()
            .map(|layer| layer.fitted.projection.texel_from_world())
            .collect();
        let matrices = Array3::from_shape_fn((matrices.len(), 4, 4), |(layer, row, column)| {
            matrices[layer].col(column)[row]
        });
        result.set_item("light_matrix", matrices.to_pyarray(py))?;
    }
    if asks_for("warp_map") {
        let maps = layers
            .into_iter()
            .filter_map(|layer| layer.warp)
            .map(|warp| (warp.functions, warp.boundaries, warp.values));
        let maps = stacked(maps.collect(), 2);
        result.set_item("warp_map", PyArray4::from_owned_array(py, maps))?;
    }
    let times = PyDict::new(py);
    for (label, milliseconds) in timings {
        times.set_item(label, milliseconds)?;
    }
    result.set_item("timings", times)?;
    result.set_item("stats", stats_to_python(py, &stats)?)?;
    result.set_item("adapter", adapter_to_python(py, &adapter)?)?;
    Ok(result)
}

/// The visibility images of several lights, (lights, rows, columns).
#[pyfunction]
fn render_visibility<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    lights: Vec<PyRef<'py, PyLight>>,
    method: &str,
    parameters: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyArray3<f32>>> {
    check_process()?;
    let method = method_from_python(method, parameters)?;
    let camera = &camera.0;
    let lights: Vec<&Light> = lights.iter().map(|light| &light.0).collect();
    let mut visibility = Vec::with_capacity(lights.len() * camera.pixel_count());
    for group in lights.chunks(MAX_TOGETHER) {
        py.check_signals()?;
        let frames = py.detach(|| {
            let (scene, cache) = (scene.read(), &scene.cache);
            render_frames(&scene, cache, camera, group, &method, Outputs::default())
        })?;
        visibility.extend(frames.into_iter().flat_map(|frame| frame.visibility));
    }
    let shape = (lights.len(), camera.height as usize, camera.width as usize);
    let images = Array3::from_shape_vec(shape, visibility).expect("an image for each light");
    Ok(PyArray3::from_owned_array(py, images))
}

#[pyfunction]
fn surface<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    triangle_id: PyReadonlyArray2<i32>,
) -> PyResult<Bound<'py, PyTuple>> {
    check_process()?;
    let shape = (camera.0.height as usize, camera.0.width as usize);
    let triangle_id = triangle_id.as_array();
    let scene = scene.read();
    let count = scene.triangles().len();
    if triangle_id.dim() != shape {
        return Err(PyValueError::new_err(format!(
            "triangle_id must have the shape of the image, {shape:?}, got {:?}",
            triangle_id.dim()
        )));
    }
    let is_known = |&id: &i32| id == -1 || usize::try_from(id).is_ok_and(|id| id < count);
    if let Some(unknown) = triangle_id.iter().find(|&id| !is_known(id)) {
        return Err(PyValueError::new_err(format!(
            "triangle_id must be -1 or index one of {count} faces, got {unknown}"
        )));
    }
    let triangle_id: Vec<i32> = triangle_id.iter().copied().collect();
    let (positions, normals, depths) =
        py.detach(|| reference::surface(&scene, &camera.0, &triangle_id));
    (
        vectors(py, shape, positions),
        vectors(py, shape, normals),
        image(py, shape, depths),
    )
        .into_pyobject(py)
}

/// Vectors of pixels as an array (H, W, 3).
fn vectors<T: numpy::Element>(
    py: Python<'_>,
    (height, width): (usize, usize),
    pixels: Vec<[T; 3]>,
) -> Bound<'_, PyArray3<T>> {
    let flat: Vec<T> = pixels.into_iter().flatten().collect();
    let array = Array3::from_shape_vec((height, width, 3), flat).expect("three for each pixel");
    PyArray3::from_owned_array(py, array)
}

#[pyfunction(name = "reference")]
fn reference_of_image<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    light: &PyLight,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let Reference {
        triangle_id,
        triangle_tie,
        visibility,
        tie,
    } = py.detach(|| {
        let scene_read = scene.read();
        let bvh = scene.bvh(&scene_read);
        reference::reference(&scene_read, &*bvh, &camera.0, &light.0)
    });
    let shape = (camera.0.height as usize, camera.0.width as usize);
    let result = PyDict::new(py);
    result.set_item("triangle_id", image(py, shape, triangle_id))?;
    result.set_item("triangle_tie", image(py, shape, triangle_tie))?;
    result.set_item("visibility", image(py, shape, visibility))?;
    result.set_item("tie", image(py, shape, tie))?;
    Ok(result)
}

#[pyfunction]
fn brute_force<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    light: &PyLight,
    pixels: Vec<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let count = camera.0.pixel_count();
    if let Some(outside) = pixels.iter().find(|&&pixel| pixel >= count) {
        return Err(PyValueError::new_err(format!(
            "pixels must index an image of {count} pixels, got {outside}"
        )));
    }
    let settled = py.detach(|| {
        let scene = scene.read();
        let search = Everything(&scene);
        reference::reference_of_pixels(&scene, &search, &camera.0, &light.0, &pixels)
    });
    let result = PyDict::new(py);
    result.set_item("triangle_id", settled.triangle_id.to_pyarray(py))?;
    result.set_item("triangle_tie", settled.triangle_tie.to_pyarray(py))?;
    result.set_item("visibility", settled.visibility.to_pyarray(py))?;
    result.set_item("tie", settled.tie.to_pyarray(py))?;
    Ok(result)
}

/// Maps of (rows, columns, values) each, `blocks` times rows, as (layers, blocks, rows, columns).
fn stacked(maps: Vec<(usize, usize, Vec<f32>)>, blocks: usize) -> Array4<f32> {
    let count = maps.len();
    let (rows, columns) = maps.first().map_or((0, 0), |map| (map.0, map.1));
    let values: Vec<f32> = maps.into_iter().flat_map(|map| map.2).collect();
    Array4::from_shape_vec((count, blocks, rows, columns), values)
        .expect("every layer has a map of the size of the first's")
}

/// A vector of pixels as an array (H, W), without a copy.
fn image<T: numpy::Element>(
    py: Python<'_>,
    shape: (usize, usize),
    pixels: Vec<T>,
) -> Bound<'_, PyArray2<T>> {
    let array = Array2::from_shape_vec(shape, pixels).expect("one value for each pixel");
    PyArray2::from_owned_array(py, array)
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

fn adapter_to_python<'py>(
    py: Python<'py>,
    adapter: &gpu::AdapterDescription,
) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("name", &adapter.name)?;
    result.set_item("type", &adapter.kind)?;
    result.set_item("backend", &adapter.backend)?;
    result.set_item("driver", &adapter.driver)?;
    Ok(result)
}

fn limits_to_python<'py>(py: Python<'py>, limits: &gpu::Limits) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item(
        "storage_binding_bytes",
        limits.max_storage_buffer_binding_size,
    )?;
    result.set_item("buffer_bytes", limits.max_buffer_size)?;
    result.set_item("texture_size", limits.max_texture_dimension_2d)?;
    result.set_item(
        "workgroups_per_dimension",
        limits.max_compute_workgroups_per_dimension,
    )?;
    Ok(result)
}

#[pyfunction]
fn adapters(py: Python) -> PyResult<Vec<Bound<PyDict>>> {
    py.detach(gpu::adapters)
        .iter()
        .map(|report| {
            let result = adapter_to_python(py, &report.adapter)?;
            result.set_item("missing_features", &report.missing_features)?;
            result.set_item("used_features", &report.used_features)?;
            result.set_item("limits", limits_to_python(py, &report.limits)?)?;
            Ok(result)
        })
        .collect()
}

#[pyfunction]
fn device(py: Python) -> PyResult<Bound<PyDict>> {
    check_process()?;
    let gpu = py.detach(gpu::gpu)?;
    let result = adapter_to_python(py, &gpu.adapter)?;
    result.set_item("used_features", gpu.feature_names())?;
    result.set_item("limits", limits_to_python(py, &gpu.limits)?)?;
    Ok(result)
}

#[pyfunction]
fn clear_cache(py: Python) -> PyResult<()> {
    check_process()?;
    let gpu = py.detach(gpu::gpu)?;
    gpu::pool::clear(&gpu);
    Ok(())
}

#[pymodule]
fn _core(module: &Bound<PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("DeviceError", module.py().get_type::<DeviceError>())?;
    module.add_class::<PyScene>()?;
    module.add_class::<PyCamera>()?;
    module.add_class::<PyLight>()?;
    module.add_function(wrap_pyfunction!(parameters::methods, module)?)?;
    module.add_function(wrap_pyfunction!(parameters::parameters, module)?)?;
    module.add_function(wrap_pyfunction!(parameters::check_parameters, module)?)?;
    module.add_function(wrap_pyfunction!(labels, module)?)?;
    module.add_function(wrap_pyfunction!(render, module)?)?;
    module.add_function(wrap_pyfunction!(render_visibility, module)?)?;
    module.add_function(wrap_pyfunction!(surface, module)?)?;
    module.add_function(wrap_pyfunction!(reference_of_image, module)?)?;
    module.add_function(wrap_pyfunction!(brute_force, module)?)?;
    module.add_function(wrap_pyfunction!(adapters, module)?)?;
    module.add_function(wrap_pyfunction!(device, module)?)?;
    module.add_function(wrap_pyfunction!(clear_cache, module)?)?;
    Ok(())
}
