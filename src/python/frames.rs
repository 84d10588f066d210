//! Frames: from a scene, a camera, lights and a method to arrays.

use super::parameters::method_from_python;
use super::world::{PyCamera, PyLight, PyScene};
use super::{adapter_to_python, array, engine_of};
use crate::aliasing::RenderedLayer;
use crate::engine::{Engine, named_by_environment};
use crate::error::Error;
use crate::light::Light;
use crate::paging::PagedMaps;
use crate::render::{
    MAX_TOGETHER, Output, Outputs, Rendered as RenderedFrame, render as render_frames,
};
use crate::scene::Scene;
use crate::stats::Stats;
use crate::threads::on_threads;
use crate::warp::tables::Table;
use crate::warp::{Warp, Warping};
use numpy::{PyArray2, PyArray3, PyArray4};
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict};

/// What one light's frame has to show; `None` where it was not asked for.
#[pyclass(module = "lixel._core", frozen, get_all)]
pub struct Rendered {
    visibility: Py<PyArray2<f32>>,
    triangle_id: Option<Py<PyArray2<i32>>>,
    shadow_map: Option<Py<PyArray3<f32>>>,
    importance_map: Option<Py<PyArray3<f32>>>,
    warp_map: Option<Py<PyArray4<f32>>>,
    light_matrix: Option<Py<PyArray3<f64>>>,
    projections: Option<Vec<Py<PyDict>>>,
    aliasing_error: Option<Py<PyArray2<f32>>>,
    largest_aliasing_error: Option<f64>,
    max_effective_resolution: Option<(f64, f64)>,
    pages: Option<Py<PyArray2<i32>>>,
    page_levels: Option<Py<PyArray2<i32>>>,
    timings: Py<PyDict>,
    stats: Py<PyDict>,
    adapter: Py<PyDict>,
}

/// The frames of one method, a name with parameters, one for each light.
#[pyfunction]
#[pyo3(signature = (scene, camera, lights, method, outputs, *, culling=true, on=(None, None)))]
pub fn render<'py>(
    scene: &PyScene,
    camera: &PyCamera,
    lights: Vec<PyRef<'py, PyLight>>,
    method: (String, Bound<'py, PyDict>),
    outputs: Vec<String>,
    culling: bool,
    on: (Option<Bound<'py, PyAny>>, Option<usize>),
) -> PyResult<Vec<Rendered>> {
    let (name, parameters) = &method;
    let py = parameters.py();
    let (device, threads) = on;
    let (method, ignores_masks) = method_from_python(name, parameters)?;
    let is_named = device.is_some() || named_by_environment().is_some();
    let engine = match engine_of(py, device.as_ref())? {
        // Where nobody asks for the GPU, the engine that can do the method is the best there is.
        Engine::Gpu(_) if !is_named && !method.is_on_gpu() => Engine::Cpu,
        engine => engine,
    };
    refuse_masks(&scene.read(), ignores_masks)?;
    let is_on_cpu = matches!(engine, Engine::Cpu);
    let outputs = Outputs::from_names(&outputs, culling)?;
    let (camera, shape) = (&camera.0, camera.shape());
    let lights: Vec<&Light> = lights.iter().map(|light| &light.0).collect();
    let mut rendered = Vec::with_capacity(lights.len());
    for group in lights.chunks(MAX_TOGETHER) {
        py.check_signals()?;
        let frames = py.detach(|| {
            let (scene, cache) = (scene.read(), &scene.cache);
            let scene: &Scene = &scene;
            let work = || render_frames(&engine, scene, cache, camera, group, &method, outputs);
            // A GPU's driver has its own threads.
            match is_on_cpu {
                true => on_threads(threads, work),
                false => work(),
            }
        })?;
        for frame in frames {
            rendered.push(to_python(py, shape, frame, outputs)?);
        }
    }
    Ok(rendered)
}

/// Triangles with holes are never drawn without them in silence.
fn refuse_masks(scene: &Scene, ignores: Option<String>) -> Result<(), Error> {
    let Some(masks) = scene.masks() else {
        return Ok(());
    };
    let count = masks.masked_count();
    match ignores {
        Some(what) => Err(Error::Value(format!(
            "{what} would draw {count} masked triangles of the scene without their holes; take \
             method='exact', or another method with rasterization='exact'"
        ))),
        None => Ok(()),
    }
}

fn to_python(
    py: Python,
    shape: (usize, usize),
    frame: RenderedFrame,
    outputs: Outputs,
) -> PyResult<Rendered> {
    let asks = |output| outputs.has(output).then_some(());
    let layers = &frame.layers;
    // Every layer has the size of the first.
    let (height, width) = layers.first().map_or((0, 0), |layer| {
        let map = &layer.projection;
        (map.height as usize, map.width as usize)
    });
    let size = match &frame.pages {
        Some(PagedMaps {
            page_size, pages, ..
        }) => (pages.len(), *page_size as usize, *page_size as usize),
        None => (layers.len(), height, width),
    };
    let paged = frame.pages.as_ref();
    let pages = asks(Output::Pages).map(|()| {
        let (count, values) = page_rows(paged);
        array(py, (count, PAGE_COLUMNS), values)
    });
    let page_levels =
        asks(Output::PageLevels).map(|()| array(py, shape, levels_of_pixels(paged, shape)));
    let light_matrix = asks(Output::LightMatrix).map(|()| {
        let matrices = layers.iter().flat_map(|layer| {
            let texel_from_world = layer.projection.texel_from_world();
            texel_from_world.transpose().to_cols_array()
        });
        array(py, (layers.len(), 4, 4), matrices.collect())
    });
    let projections = asks(Output::Projections).map(|()| {
        let projections = layers.iter().map(|layer| projection_to_python(py, layer));
        projections.collect::<PyResult<_>>()
    });
    let projections = projections.transpose()?;
    let importance_map = asks(Output::ImportanceMap).map(|()| {
        let ([count, rows, columns], values) = stacked(frame.importance_maps);
        array(py, (count, rows, columns), values)
    });
    let warp_map = asks(Output::WarpMap).map(|()| {
        let warps = frame.layers.into_iter().filter_map(|layer| layer.warp);
        let warps: Vec<_> = warps.map(shaped).collect();
        let [a, b, c] = warps.first().map_or([2, 0, 0], |(shape, _)| *shape);
        let count = warps.len();
        let values = warps.into_iter().flat_map(|(_, values)| values);
        array(py, (count, a, b, c), values.collect())
    });
    Ok(Rendered {
        visibility: array(py, shape, frame.visibility),
        triangle_id: asks(Output::TriangleId).map(|()| array(py, shape, frame.triangle_id)),
        shadow_map: asks(Output::ShadowMap).map(|()| array(py, size, frame.shadow_map)),
        importance_map,
        warp_map,
        light_matrix,
        projections,
        aliasing_error: frame.aliasing_error.map(|error| array(py, shape, error)),
        largest_aliasing_error: frame.largest_aliasing_error,
        max_effective_resolution: frame.max_effective_resolution.map(|size| (size.x, size.y)),
        pages,
        page_levels,
        timings: frame.timings.into_py_dict(py)?.unbind(),
        stats: stats_to_python(py, &frame.stats)?.unbind(),
        adapter: adapter_to_python(py, &frame.adapter)?.unbind(),
    })
}

/// Of a page: its layer, its map, its level, its column and row, and 1 if it was kept.
const PAGE_COLUMNS: usize = 6;

/// How many pages, and what there is to know of each.
fn page_rows(paged: Option<&PagedMaps>) -> (usize, Vec<i32>) {
    let Some(PagedMaps { pages, layers, .. }) = paged else {
        return (0, vec![]);
    };
    let rows = pages.iter().flat_map(|page| {
        let [map, level] = layers[page.layer];
        let [x, y] = page.place.map(|place| place as i32);
        let numbers = [page.layer, map, level].map(|number| number as i32);
        [
            numbers[0],
            numbers[1],
            numbers[2],
            x,
            y,
            page.is_kept.into(),
        ]
    });
    (pages.len(), rows.collect())
}

/// Of each pixel the level that it looks into, -1 where there is none.
fn levels_of_pixels(paged: Option<&PagedMaps>, (height, width): (usize, usize)) -> Vec<i32> {
    let Some(paged) = paged else {
        return vec![-1; height * width];
    };
    let numbers = paged.layer_of_pixel.iter();
    let level = |&number: &u8| {
        let layer = paged.layers.get(usize::from(number));
        layer.map_or(-1, |[_, level]| *level as i32)
    };
    numbers.map(level).collect()
}

/// What else than its matrix takes a point to its place in a layer's map.
fn projection_to_python(py: Python, layer: &RenderedLayer) -> PyResult<Py<PyDict>> {
    let RenderedLayer {
        projection, region, ..
    } = layer;
    let result = PyDict::new(py);
    result.set_item("kind", projection.kind.name())?;
    result.set_item("scale", projection.kind.plane_scale().to_array())?;
    result.set_item("centre", projection.centre.to_array())?;
    let half_spaces = region.half_spaces().iter();
    let planes = half_spaces.map(|half| half.normal.extend(-half.normal.dot(half.origin)));
    let planes: Vec<_> = planes.map(|plane| plane.to_array()).collect();
    result.set_item("region", planes)?;
    Ok(result.unbind())
}

/// The functions of a warp, or its samples.
fn shaped(warp: Warping<Warp>) -> ([usize; 3], Vec<f32>) {
    match warp {
        Warping::Functions(warp) => ([2, warp.functions, warp.boundaries], warp.values),
        Warping::Samples(samples) => {
            let Table {
                columns,
                rows,
                values,
            } = samples.given;
            ([rows, columns, 2], values.to_vec())
        }
    }
}

/// Maps of (rows, columns, values) as one, layer after layer: the number of layers, rows, columns, and the values.
fn stacked(maps: Vec<(usize, usize, Vec<f32>)>) -> ([usize; 3], Vec<f32>) {
    let (rows, columns) = maps.first().map_or((0, 0), |map| (map.0, map.1));
    let shape = [maps.len(), rows, columns];
    (shape, maps.into_iter().flat_map(|map| map.2).collect())
}

fn stats_to_python<'py>(py: Python<'py>, stats: &Stats) -> PyResult<Bound<'py, PyDict>> {
    let counts = [
        ("triangles", stats.triangles),
        ("degenerate_triangles", stats.degenerate_triangles),
        ("layers", stats.layers),
        ("skipped_layers", stats.skipped_layers),
    ];
    let result = counts.into_py_dict(py)?;
    for (label, facts) in &stats.facts.0 {
        let facts = facts.iter().map(|fact| (fact.name, fact.value));
        result.set_item(label, facts.into_py_dict(py)?)?;
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
