//! Scenes, cameras and lights: what is validated once and used for many frames.

use super::{array, check_process};
use crate::camera::{Camera, Rays};
use crate::error::Error;
use crate::light::Light;
use crate::masks::{AlphaImage, Masks, Sampling, Wrap};
use crate::render::SceneCache;
use crate::scene::Scene;
use glam::{DMat4, DVec2, DVec3};
use numpy::{PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use rayon::prelude::*;
use std::sync::{RwLock, RwLockReadGuard};

fn rows_of_three<T: numpy::Element + Copy>(
    name: &str,
    array: &PyReadonlyArray2<T>,
) -> PyResult<Vec<[T; 3]>> {
    let array = array.as_array();
    if array.ncols() != 3 {
        let (rows, columns) = array.dim();
        return Err(PyValueError::new_err(format!(
            "{name} must have shape (n, 3), got ({rows}, {columns})"
        )));
    }
    let rows = array.rows().into_iter();
    Ok(rows.map(|row| [row[0], row[1], row[2]]).collect())
}

pub fn points(name: &str, array: &PyReadonlyArray2<f64>) -> PyResult<Vec<DVec3>> {
    // Millions of them are copied by all threads.
    if let (Ok(flat), 3) = (array.as_slice(), array.as_array().ncols()) {
        return Ok(flat.par_chunks_exact(3).map(DVec3::from_slice).collect());
    }
    Ok(rows_of_three(name, array)?
        .into_iter()
        .map(DVec3::from)
        .collect())
}

/// The number of the alpha image of each face, negative where it is opaque; (u, v, factor of alpha) of each corner of the
/// others; and the images: texels, ways to go on beyond the sides, sampling and cutoff.
type MasksFromPython<'py> = (
    PyReadonlyArray1<'py, i32>,
    PyReadonlyArray3<'py, f64>,
    Vec<(PyReadonlyArray2<'py, u8>, (String, String), String, f64)>,
);

fn masks_from_python((numbers, corners, images): &MasksFromPython) -> Result<Option<Masks>, Error> {
    let wrap = |name: &str| named("wrap", &Wrap::NAMES, name);
    let images = images
        .iter()
        .map(|(texels, (along_u, along_v), sampling, cutoff)| {
            let (height, width) = texels.as_array().dim();
            let texels = texels.as_array().iter().copied().collect();
            let wraps = [wrap(along_u)?, wrap(along_v)?];
            let sampling = named("sampling", &Sampling::NAMES, sampling)?;
            AlphaImage::new((width, height), texels, (wraps, sampling), *cutoff)
        });
    let images = images.collect::<Result<_, _>>()?;
    let values: Vec<f64> = corners.as_array().iter().copied().collect();
    let corners: Vec<[DVec3; 3]> = values
        .as_chunks::<9>()
        .0
        .iter()
        .map(|v| [0, 3, 6].map(|i| DVec3::new(v[i], v[i + 1], v[i + 2])))
        .collect();
    let numbers: Vec<i32> = numbers.as_array().iter().copied().collect();
    Masks::new(images, &numbers, &corners)
}

/// What goes by a name.
fn named<T: Copy>(what: &str, known: &[(&str, T)], name: &str) -> Result<T, Error> {
    let found = known.iter().find(|(known, _)| *known == name);
    found.map(|(_, found)| *found).ok_or_else(|| {
        let names: Vec<_> = known.iter().map(|(name, _)| *name).collect();
        let names = names.join("', '");
        Error::Value(format!("{what} must be among '{names}', got '{name}'"))
    })
}

#[pyclass(name = "Scene", module = "lixel._core", frozen)]
pub struct PyScene {
    scene: RwLock<Scene>,
    pub cache: SceneCache,
}

impl PyScene {
    pub fn read(&self) -> RwLockReadGuard<'_, Scene> {
        self.scene
            .read()
            .unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[pymethods]
impl PyScene {
    #[new]
    #[pyo3(signature = (vertices, faces, masks=None))]
    fn new(
        py: Python,
        vertices: PyReadonlyArray2<f64>,
        faces: PyReadonlyArray2<i64>,
        masks: Option<MasksFromPython>,
    ) -> PyResult<Self> {
        check_process()?;
        let vertices = points("vertices", &vertices)?;
        let faces = rows_of_three("faces", &faces)?;
        let masks = masks.as_ref().map(masks_from_python).transpose()?.flatten();
        let scene = py.detach(|| {
            if let Some(row) = faces.iter().position(|face| face.iter().any(|&i| i < 0)) {
                return Err(Error::Value(format!(
                    "faces must index vertices: row {row} is {:?}, and no index may be negative",
                    faces[row]
                )));
            }
            // An index beyond 32 bits is beyond any number of vertices, too.
            let narrow = |i: i64| u32::try_from(i).unwrap_or(u32::MAX);
            let triangles = faces.iter().map(|face| face.map(narrow)).collect();
            Scene::new(vertices, triangles)?.with_masks(masks)
        })?;
        Ok(Self {
            scene: RwLock::new(scene),
            cache: SceneCache::default(),
        })
    }

    #[getter]
    fn vertices(&self, py: Python) -> Py<PyArray2<f64>> {
        let scene = self.read();
        let vertices = scene.vertices().iter().flat_map(DVec3::to_array);
        array(py, (scene.vertices().len(), 3), vertices.collect())
    }

    #[getter]
    fn faces(&self, py: Python) -> Py<PyArray2<u32>> {
        let scene = self.read();
        let triangles = scene.triangles();
        array(py, (triangles.len(), 3), triangles.as_flattened().to_vec())
    }

    #[getter]
    fn bounds(&self, py: Python) -> Py<PyArray2<f64>> {
        let (low, high) = self.read().bounds();
        array(py, (2, 3), [low.to_array(), high.to_array()].concat())
    }

    #[getter]
    fn triangle_count(&self) -> usize {
        self.read().triangles().len()
    }

    #[getter]
    fn degenerate_count(&self) -> usize {
        self.read().degenerate_count()
    }

    /// How many triangles have holes.
    #[getter]
    fn masked_count(&self) -> usize {
        self.read().masks().map_or(0, Masks::masked_count)
    }

    fn update_vertices(&self, py: Python, vertices: PyReadonlyArray2<f64>) -> PyResult<()> {
        check_process()?;
        let vertices = points("vertices", &vertices)?;
        py.detach(|| {
            let mut scene = self
                .scene
                .write()
                .unwrap_or_else(|poisoned| poisoned.into_inner());
            scene.update_vertices(vertices)
        })?;
        Ok(())
    }
}

#[pyclass(name = "Camera", module = "lixel._core", frozen)]
pub struct PyCamera(pub Camera);

impl PyCamera {
    /// Rows and columns of its image.
    pub fn shape(&self) -> (usize, usize) {
        (self.0.height as usize, self.0.width as usize)
    }
}

#[pymethods]
impl PyCamera {
    #[new]
    #[pyo3(signature = (pose, focal, centre, size, depth_range, is_orthographic=false))]
    fn new(
        pose: PyReadonlyArray2<f64>,
        focal: (f64, f64),
        centre: (f64, f64),
        size: (u32, u32),
        depth_range: (f64, f64),
        is_orthographic: bool,
    ) -> PyResult<Self> {
        let pose = pose.as_array();
        if pose.dim() != (4, 4) {
            return Err(PyValueError::new_err(format!(
                "camera pose must have shape (4, 4), got {:?}",
                pose.dim()
            )));
        }
        let columns: Vec<f64> = pose.t().iter().copied().collect();
        let rays = match is_orthographic {
            true => Rays::Orthographic,
            false => Rays::Perspective,
        };
        Ok(Self(Camera::with_rays(
            rays,
            DMat4::from_cols_slice(&columns),
            DVec2::from(focal),
            DVec2::from(centre),
            size,
            depth_range,
        )?))
    }
}

#[pyclass(name = "Light", module = "lixel._core", frozen)]
pub struct PyLight(pub Light);

#[pymethods]
impl PyLight {
    #[staticmethod]
    fn directional(direction: PyReadonlyArray1<f64>) -> PyResult<Self> {
        Ok(Self(Light::directional(vector("direction", &direction)?)?))
    }

    #[staticmethod]
    fn point(position: PyReadonlyArray1<f64>) -> PyResult<Self> {
        Ok(Self(Light::point(vector("position", &position)?)?))
    }

    #[staticmethod]
    fn spot(
        position: PyReadonlyArray1<f64>,
        direction: PyReadonlyArray1<f64>,
        outer: f64,
    ) -> PyResult<Self> {
        let position = vector("position", &position)?;
        let direction = vector("direction", &direction)?;
        Ok(Self(Light::spot(position, direction, outer)?))
    }

    #[staticmethod]
    fn hemisphere(position: PyReadonlyArray1<f64>, axis: PyReadonlyArray1<f64>) -> PyResult<Self> {
        let position = vector("position", &position)?;
        Ok(Self(Light::hemisphere(position, vector("axis", &axis)?)?))
    }
}

fn vector(name: &str, array: &PyReadonlyArray1<f64>) -> PyResult<DVec3> {
    let array = array.as_array();
    if array.len() != 3 {
        return Err(PyValueError::new_err(format!(
            "light {name} must have shape (3,), got ({},)",
            array.len()
        )));
    }
    Ok(DVec3::new(array[0], array[1], array[2]))
}
