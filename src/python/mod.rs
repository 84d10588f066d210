//! The door to Python: only the files in this folder name pyo3. Arrays in, arrays out, errors to exceptions;
//! the GIL is released while the work is done. `python/lixel/_core.pyi` documents what is here.

mod frames;
mod parameters;
mod points;
mod samples;
mod warps;
mod world;

use crate::bvh::Everything;
use crate::cpu;
use crate::engine::{DEVICE_RULE, Engine, reason_for_cpu};
use crate::error::Error;
use crate::gpu;
use crate::methods::scene_optimized;
use crate::occlusion;
use crate::reference::{self, Reference};
use crate::scene::Scene;
use numpy::ndarray::{Array, Dimension, Ix2, StrideShape};
use numpy::{PyArray, PyReadonlyArray2};
use pyo3::exceptions::{PyTypeError, PyUserWarning, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyTuple};
use std::ffi::CString;
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
    let mut labels = [gpu::passes::LABELS, cpu::LABELS, &[scene_optimized::LABEL]].concat();
    labels.sort_unstable();
    labels.dedup();
    labels
}

#[pyfunction]
fn surface<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    triangle_id: PyReadonlyArray2<i32>,
) -> PyResult<Bound<'py, PyTuple>> {
    check_process()?;
    let shape = camera.shape();
    let scene = scene.read();
    let triangle_id = checked_triangles(&scene, shape, triangle_id)?;
    let (positions, normals, depths) =
        py.detach(|| reference::surface(&scene, &camera.0, &triangle_id));
    let vectors = (shape.0, shape.1, 3);
    (
        array(py, vectors, positions.into_flattened()),
        array(py, vectors, normals.into_flattened()),
        array(py, shape, depths),
    )
        .into_pyobject(py)
}

#[pyfunction]
fn facing(
    py: Python<'_>,
    scene: &PyScene,
    camera: &PyCamera,
    light: &PyLight,
    triangle_id: PyReadonlyArray2<i32>,
) -> PyResult<Py<PyArray<bool, Ix2>>> {
    check_process()?;
    let shape = camera.shape();
    let scene = scene.read();
    let triangle_id = checked_triangles(&scene, shape, triangle_id)?;
    let facing = py.detach(|| occlusion::facing(&scene, &camera.0, &light.0, &triangle_id));
    Ok(array(py, shape, facing))
}

/// One triangle of the scene for each pixel, or -1.
fn checked_triangles(
    scene: &Scene,
    shape: (usize, usize),
    triangle_id: PyReadonlyArray2<i32>,
) -> PyResult<Vec<i32>> {
    let triangle_id = triangle_id.as_array();
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
    Ok(triangle_id.iter().copied().collect())
}

#[pyfunction(name = "reference")]
fn reference_of_image<'py>(
    py: Python<'py>,
    scene: &PyScene,
    camera: &PyCamera,
    light: &PyLight,
) -> PyResult<Bound<'py, PyDict>> {
    check_process()?;
    let reference = py.detach(|| {
        let scene_read = scene.read();
        let (hierarchy, _) = scene.cache.cpu.hierarchy(&scene_read)?;
        let (camera, light) = (&camera.0, &light.0);
        Ok::<_, Error>(reference::reference(
            &scene_read,
            &hierarchy.made,
            camera,
            light,
        ))
    })?;
    reference_to_python(py, camera.shape(), reference)
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
    let reference = py.detach(|| {
        let scene = scene.read();
        let search = Everything(&scene);
        reference::reference_of_pixels(&scene, &search, &camera.0, &light.0, &pixels)
    });
    reference_to_python(py, pixels.len(), reference)
}

fn reference_to_python<'py, D: Dimension + 'py>(
    py: Python<'py>,
    shape: impl Into<StrideShape<D>> + Copy,
    reference: Reference,
) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("triangle_id", array(py, shape, reference.triangle_id))?;
    result.set_item("triangle_tie", array(py, shape, reference.triangle_tie))?;
    result.set_item("float32_tie", array(py, shape, reference.float32_tie))?;
    result.set_item("visibility", array(py, shape, reference.visibility))?;
    result.set_item("tie", array(py, shape, reference.tie))?;
    Ok(result)
}

/// Values as an array of a shape, without a copy.
fn array<T: numpy::Element, D: Dimension>(
    py: Python,
    shape: impl Into<StrideShape<D>>,
    values: Vec<T>,
) -> Py<PyArray<T, D>> {
    let array = Array::from_shape_vec(shape, values).expect("as many values as the shape has");
    PyArray::from_owned_array(py, array).unbind()
}

fn adapter_to_python<'py>(
    py: Python<'py>,
    adapter: &gpu::AdapterDescription,
) -> PyResult<Bound<'py, PyDict>> {
    let texts = [
        ("name", &adapter.name),
        ("type", &adapter.kind),
        ("backend", &adapter.backend),
        ("driver", &adapter.driver),
    ];
    texts.into_py_dict(py)
}

fn limits_to_python<'py>(py: Python<'py>, limits: &gpu::Limits) -> PyResult<Bound<'py, PyDict>> {
    let workgroups = u64::from(limits.max_compute_workgroups_per_dimension);
    let limits = [
        (
            "storage_binding_bytes",
            limits.max_storage_buffer_binding_size,
        ),
        ("buffer_bytes", limits.max_buffer_size),
        ("texture_size", u64::from(limits.max_texture_dimension_2d)),
        ("workgroups_per_dimension", workgroups),
    ];
    limits.into_py_dict(py)
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

/// The engine of a device's name, or the best there is.
fn engine_of(py: Python, device: Option<&Bound<PyAny>>) -> PyResult<Engine> {
    check_process()?;
    let text = |device: &Bound<PyAny>| {
        device.extract::<String>().or_else(|_| {
            let got = device.get_type().name()?;
            Err(PyTypeError::new_err(format!("{DEVICE_RULE}, got {got}")))
        })
    };
    let device = device.map(text).transpose()?;
    let engine = py.detach(|| Engine::choose(device.as_deref()))?;
    if let Some(reason) = reason_for_cpu() {
        let reason = CString::new(reason).expect("no driver's name has a zero");
        PyErr::warn(py, &py.get_type::<PyUserWarning>(), &reason, 1)?;
    }
    Ok(engine)
}

#[pyfunction]
#[pyo3(signature = (device))]
fn engine(py: Python, device: Option<&Bound<PyAny>>) -> PyResult<&'static str> {
    Ok(match engine_of(py, device)? {
        Engine::Cpu => "cpu",
        Engine::Gpu(_) => "gpu",
    })
}

#[pyfunction]
#[pyo3(signature = (device=None))]
fn device<'py>(py: Python<'py>, device: Option<&Bound<PyAny>>) -> PyResult<Bound<'py, PyDict>> {
    let engine = engine_of(py, device)?;
    let result = adapter_to_python(py, &engine.description())?;
    match &engine {
        Engine::Gpu(gpu) => {
            result.set_item("used_features", gpu.feature_names())?;
            result.set_item("limits", limits_to_python(py, &gpu.limits)?)?;
        }
        Engine::Cpu => {
            let cpu::Description { lanes, threads, .. } = cpu::description();
            result.set_item("lanes", lanes)?;
            result.set_item("threads", threads)?;
        }
    }
    Ok(result)
}

#[pyfunction]
fn clear_cache(py: Python) -> PyResult<()> {
    check_process()?;
    py.detach(|| {
        gpu::opened().iter().for_each(|gpu| gpu.clear());
    });
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
    module.add_function(wrap_pyfunction!(engine, module)?)?;
    module.add_class::<frames::Rendered>()?;
    module.add_function(wrap_pyfunction!(frames::render, module)?)?;
    module.add_function(wrap_pyfunction!(surface, module)?)?;
    module.add_function(wrap_pyfunction!(facing, module)?)?;
    module.add_function(wrap_pyfunction!(reference_of_image, module)?)?;
    module.add_function(wrap_pyfunction!(points::shadows_at, module)?)?;
    module.add_function(wrap_pyfunction!(samples::count_samples, module)?)?;
    module.add_function(wrap_pyfunction!(warps::sampled_points, module)?)?;
    module.add_function(wrap_pyfunction!(brute_force, module)?)?;
    module.add_function(wrap_pyfunction!(adapters, module)?)?;
    module.add_function(wrap_pyfunction!(device, module)?)?;
    module.add_function(wrap_pyfunction!(clear_cache, module)?)?;
    Ok(())
}
