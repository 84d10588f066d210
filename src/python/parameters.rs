//! Methods and their parameters: values are converted by the rules that `methods::schema` declares.

use super::array;
use crate::error::Error;
use crate::methods::Method;
use crate::methods::arrays::{Array, Fault, OldMap, WarpFunctions, WarpSamples};
use crate::methods::filters::FILTERS;
use crate::methods::given_warp::GivenWarp;
use crate::methods::light_matrix::LightMatrix;
use crate::methods::method::ShadowMethod;
use crate::methods::parameters::AUTO;
use crate::methods::schema::{Parameter, ParameterGroup, Parameters, Rule, Schema, Value};
use crate::warp::tables::Table;
use glam::{DMat4, DVec4};
use numpy::ndarray::{ArrayView, ArrayViewD, Dimension};
use numpy::{Element, PyArrayMethods, PyReadonlyArray2, PyReadonlyArray3, PyReadonlyArrayDyn};
use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;
use pyo3::types::{IntoPyDict, PyDict, PyFloat, PyString, PyTuple};
use std::borrow::Cow;
use std::sync::Arc;

/// The parameters of what is no method: of a filter such as `lookup=Pcf(...)`, or of the choice of a method.
fn other_schema(name: &str) -> Option<Schema> {
    let filters = FILTERS.iter().map(|(schema, _)| *schema);
    filters.chain([AUTO]).find(|schema| schema.name == name)
}

fn schema_of(name: &str) -> Result<Schema, Error> {
    other_schema(name).map_or_else(|| Method::schema(name), Ok)
}

/// Every method with its parameters.
#[pyfunction]
pub fn methods(py: Python) -> PyResult<Vec<Bound<PyDict>>> {
    let describe = |method: &crate::methods::method::Description| {
        let (name, title, citation) = (method.schema.name, method.title, method.citation);
        let texts = [("name", name), ("title", title), ("citation", citation)];
        let description = texts.into_py_dict(py)?;
        description.set_item("parameters", parameters(py, name)?)?;
        Ok(description)
    };
    Method::list().iter().map(describe).collect()
}

/// What the parameters of a method are.
#[pyfunction]
pub fn parameters<'py>(py: Python<'py>, method: &str) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let describe = |parameter: &Parameter| {
        let description = PyDict::new(py);
        description.set_item("name", parameter.name)?;
        description.set_item(
            "default",
            to_python(py, &parameter.default, py.None().bind(py))?,
        )?;
        description.set_item("unit", parameter.unit)?;
        description.set_item("is_optional", parameter.is_optional())?;
        description.set_item("must_be", parameter.to_string())?;
        let (kind, choices) = match parameter.rule {
            Rule::Flag => ("flag", vec![]),
            Rule::Count { .. } => ("count", vec![]),
            Rule::MapSize { .. } => ("map_size", vec![]),
            Rule::Number { .. } => ("number", vec![]),
            Rule::NumberOr { words, .. } => ("number", words.to_vec()),
            Rule::Choice(known) => ("choice", known.words()),
            Rule::Lookup(known) => ("lookup", known.words()),
            Rule::Product(known) => ("product", known.to_vec()),
            Rule::Weights => ("weights", vec![]),
            Rule::Matrix => ("matrix", vec![]),
            Rule::Maps => ("maps", vec![]),
            Rule::Fit(known) => ("fit", known.words()),
            Rule::Matrices => ("matrices", vec![]),
            Rule::Regions => ("regions", vec![]),
            Rule::Functions => ("functions", vec![]),
            Rule::Samples => ("samples", vec![]),
        };
        description.set_item("rule", kind)?;
        description.set_item("choices", choices)?;
        let max = match parameter.rule {
            Rule::Count { max } | Rule::MapSize { max } => Some(f64::from(max)),
            Rule::Number { max, .. } | Rule::NumberOr { max, .. } if max.is_finite() => Some(max),
            _ => None,
        };
        description.set_item("max", max)?;
        Ok(description)
    };
    schema_of(method)?.parameters().map(describe).collect()
}

/// The values as the core keeps them; all rules of the method are asked.
#[pyfunction]
pub fn check_parameters<'py>(
    py: Python<'py>,
    method: &str,
    values: &Bound<'py, PyDict>,
) -> PyResult<Bound<'py, PyDict>> {
    let schema = schema_of(method)?;
    let checked = from_python(schema, values)?;
    if other_schema(method).is_none() {
        Method::new(schema, &checked)?;
    }
    let result = PyDict::new(py);
    for (name, given) in values {
        let name: String = name.extract()?;
        result.set_item(&name, to_python(py, checked.value(&name), &given)?)?;
    }
    Ok(result)
}

/// A warp's table, as the rule of the method's parameter has it.
pub fn samples_from_python(value: &Bound<PyAny>) -> PyResult<WarpSamples> {
    let parameter = Method::schema(GivenWarp::NAME)?.parameter("samples")?;
    match checked(parameter, value)? {
        Value::Samples(samples) => Ok(samples),
        _ => Err(parameter.error(Fault::Kind, &shown(value)).into()),
    }
}

/// A method, and what of it takes masked triangles for solid ones.
pub fn method_from_python(
    name: &str,
    values: &Bound<PyDict>,
) -> PyResult<(Method, Option<String>)> {
    let description = Method::description(name)?;
    let parameters = from_python(description.schema, values)?;
    let ignores_masks = description.ignores_masks(&parameters);
    Ok((Method::new(description.schema, &parameters)?, ignores_masks))
}

fn from_python(schema: Schema, values: &Bound<PyDict>) -> PyResult<Parameters> {
    let mut parameters = schema.defaults();
    for (name, value) in values {
        let parameter = schema.parameter(&name.extract::<String>()?)?;
        parameters.set(parameter, checked(parameter, &value)?);
    }
    Ok(parameters)
}

fn checked(parameter: &Parameter, value: &Bound<PyAny>) -> PyResult<Value> {
    let converted = match (parameter.rule, value.is_none()) {
        (_, true) => Ok(Value::None),
        // Its own parameters have their own errors.
        (Rule::Lookup(_), _) if !value.is_instance_of::<PyString>() => match filter(value)? {
            Some(filter) => Ok(filter),
            None => Err(Fault::Kind),
        },
        (Rule::Fit(_), _) if !value.is_instance_of::<PyString>() => match light_matrix(value)? {
            Some(layers) => Ok(Value::Layers(layers.layers())),
            None => Err(Fault::Kind),
        },
        (rule, _) => converted(rule, value),
    };
    let checked = converted.and_then(|converted| parameter.check(converted));
    Ok(checked.map_err(|fault| parameter.error(fault, &shown(value)))?)
}

/// A value as an error shows it.
fn shown(value: &Bound<PyAny>) -> String {
    let text = value.repr().map(|text| text.to_string());
    match text {
        Ok(text) if text.len() <= 80 && !text.contains('\n') => text,
        _ => value.get_type().to_string(),
    }
}

fn converted(rule: Rule, value: &Bound<PyAny>) -> Result<Value, Fault> {
    let wrong_kind = |_| Fault::Kind;
    match rule {
        Rule::Flag => value.extract().map(Value::Bool).map_err(wrong_kind),
        Rule::Count { .. } => Ok(Value::Int(whole(value)?)),
        Rule::MapSize { .. } => match (whole(value), value.is_instance_of::<PyString>()) {
            (Err(Fault::Kind), false) => {
                let sides = value.try_iter().map_err(wrong_kind)?;
                let sides = sides.map(|side| whole(&side.map_err(wrong_kind)?));
                let sides: Vec<_> = sides.collect::<Result<_, _>>()?;
                let pair = sides.try_into().map_err(|_| Fault::Kind)?;
                Ok(Value::Pair(pair))
            }
            (side, _) => Ok(Value::Int(side?)),
        },
        Rule::NumberOr { .. } if value.is_instance_of::<PyString>() => {
            let text = value.extract::<String>().map_err(wrong_kind)?;
            Ok(Value::Text(text.into()))
        }
        Rule::Number { .. } | Rule::NumberOr { .. } => {
            let number = numbers(value, &[0])?.extract().map_err(wrong_kind)?;
            Ok(Value::Float(number))
        }
        Rule::Choice(_) | Rule::Lookup(_) | Rule::Fit(_) => {
            let text = value.extract::<String>().map_err(wrong_kind)?;
            Ok(Value::Text(text.into()))
        }
        Rule::Product(_) => {
            let factors = value
                .extract::<Vec<String>>()
                .map(|factors| factors.join("*"));
            let text = value.extract().or(factors).map_err(wrong_kind)?;
            Ok(Value::Text(Cow::Owned(text)))
        }
        Rule::Weights => {
            // As a method keeps them, so that each render takes them without a detour.
            if let Ok(weights) = value.extract::<PyReadonlyArray2<f32>>() {
                return Ok(Value::Array(weights_of(&weights, |weight| weight)));
            }
            let weights: PyReadonlyArray2<f64> =
                numbers(value, &[2])?.extract().map_err(|_| Fault::Kind)?;
            Ok(Value::Array(weights_of(&weights, |weight| weight as f32)))
        }
        Rule::Matrix => {
            let matrix = numbers(value, &[2])?;
            let shape = matrix.getattr("shape").map_err(wrong_kind)?.to_string();
            let rows = matrix.extract::<[[f64; 4]; 4]>();
            let rows = rows.map_err(|_| Fault::RangeOf(format!("shape {shape}")))?;
            Ok(Value::Matrix(DMat4::from_cols_array_2d(&rows).transpose()))
        }
        Rule::Maps => old_maps(value),
        Rule::Matrices => {
            let values = rows_of(&numbers(value, &[2, 3])?, &[4, 4])?;
            let matrices = values.as_chunks::<16>().0.iter();
            let matrices = matrices.map(|rows| DMat4::from_cols_array(rows).transpose());
            Ok(Value::Matrices(matrices.collect()))
        }
        Rule::Regions => {
            let regions = value.try_iter().map_err(wrong_kind)?;
            let regions = regions.map(|region| planes(&region.map_err(wrong_kind)?));
            Ok(Value::Regions(regions.collect::<Result<_, _>>()?))
        }
        Rule::Functions => functions(value),
        Rule::Samples => samples(value),
    }
}

/// A whole number, which is no truth.
fn whole(value: &Bound<PyAny>) -> Result<i64, Fault> {
    if value.extract::<bool>().is_ok() {
        return Err(Fault::Kind);
    }
    let is_too_large = |error: &PyErr| error.is_instance_of::<PyOverflowError>(value.py());
    value.extract().map_err(|error| match is_too_large(&error) {
        true => Fault::Range,
        false => Fault::Kind,
    })
}

/// The numbers of an array whose last axes have those lengths.
fn rows_of(array: &Bound<PyAny>, last: &[usize]) -> Result<Vec<f64>, Fault> {
    let array: PyReadonlyArrayDyn<f64> = array.extract().map_err(|_| Fault::Kind)?;
    let array = array.as_array();
    if !array.shape().ends_with(last) {
        return Err(Fault::RangeOf(format!("shape {:?}", array.shape())));
    }
    Ok(array.iter().copied().collect())
}

/// Planes (a, b, c, d).
fn planes(value: &Bound<PyAny>) -> Result<Vec<DVec4>, Fault> {
    if value.len().is_ok_and(|count| count == 0) {
        return Ok(vec![]);
    }
    let values = rows_of(&numbers(value, &[2])?, &[4])?;
    let planes = values.as_chunks::<4>().0.iter();
    Ok(planes.map(|plane| DVec4::from_array(*plane)).collect())
}

/// Functions of a warp, of all layers or of each.
fn functions(value: &Bound<PyAny>) -> Result<Value, Fault> {
    let array = numbers(value, &[3, 4])?;
    let array: PyReadonlyArrayDyn<f64> = array.extract().map_err(|_| Fault::Kind)?;
    let array = array.as_array();
    let (layers, shape) = match *array.shape() {
        [axes, functions, boundaries] => (None, [axes, functions, boundaries]),
        [layers, axes, functions, boundaries] => (Some(layers), [axes, functions, boundaries]),
        _ => return Err(Fault::Kind),
    };
    if shape[0] != 2 || layers == Some(0) {
        return Err(Fault::RangeOf(format!("shape {:?}", array.shape())));
    }
    Ok(Value::Functions(WarpFunctions {
        layers,
        functions: shape[1],
        boundaries: shape[2],
        values: array.iter().map(|&value| value as f32).collect(),
    }))
}

/// Tables of a warp, of all layers or of each.
fn samples(value: &Bound<PyAny>) -> Result<Value, Fault> {
    // As a method keeps them, so that each render takes them without a detour.
    if let Ok(array) = value.extract::<PyReadonlyArrayDyn<f32>>() {
        return tables(array.as_array(), |value| value);
    }
    let array = numbers(value, &[3, 4])?;
    let array: PyReadonlyArrayDyn<f64> = array.extract().map_err(|_| Fault::Kind)?;
    tables(array.as_array(), |value| value as f32)
}

fn tables<T: Copy>(array: ArrayViewD<T>, narrow: impl Fn(T) -> f32) -> Result<Value, Fault> {
    let (is_of_layers, rows, columns) = match *array.shape() {
        [rows, columns, 2] if !array.is_empty() => (false, rows, columns),
        [_, rows, columns, 2] if !array.is_empty() => (true, rows, columns),
        _ => return Err(Fault::RangeOf(format!("shape {:?}", array.shape()))),
    };
    let values = narrowed(&array, narrow);
    let of_layers = match is_of_layers {
        true => {
            let layers = values.chunks_exact(2 * rows * columns);
            layers.map(Arc::from).collect()
        }
        false => vec![values],
    };
    let table = |values| Table {
        columns,
        rows,
        values,
    };
    Ok(Value::Samples(WarpSamples {
        is_of_layers,
        tables: of_layers.into_iter().map(table).collect(),
    }))
}

fn weights_of<T: Element + Copy>(array: &PyReadonlyArray2<T>, narrow: impl Fn(T) -> f32) -> Array {
    let weights = array.as_array();
    let (rows, columns) = weights.dim();
    Array {
        rows,
        columns,
        values: narrowed(&weights, narrow),
    }
}

/// The values of an array, row by row.
fn narrowed<T: Copy, D: Dimension>(
    array: &ArrayView<T, D>,
    narrow: impl Fn(T) -> f32,
) -> Arc<[f32]> {
    match array.as_slice() {
        // Millions of them are read as they lie.
        Some(values) => values.iter().map(|&value| narrow(value)).collect(),
        None => array.iter().map(|&value| narrow(value)).collect(),
    }
}

/// Real numbers in an array with one of so many axes, as float64.
fn numbers<'py>(value: &Bound<'py, PyAny>, axes: &[usize]) -> Result<Bound<'py, PyAny>, Fault> {
    if value.is_exact_instance_of::<PyFloat>() && axes.contains(&0) {
        // As it is, which spares numpy's part in each parameter of each render.
        return Ok(value.clone());
    }
    let py = value.py();
    let numpy = py.import("numpy").map_err(|_| Fault::Kind)?;
    // A ragged list is no array.
    let array = numpy.call_method1("asarray", (value,));
    let array = array.map_err(|_| Fault::RangeOf("a ragged list".to_string()))?;
    let read = |array: &Bound<PyAny>| -> PyResult<(String, usize, String)> {
        let kind = array.getattr("dtype")?.getattr("kind")?.extract()?;
        let axes = array.getattr("ndim")?.extract()?;
        Ok((kind, axes, array.getattr("shape")?.to_string()))
    };
    let (kind, own_axes, shape) = read(&array).map_err(|_| Fault::Kind)?;
    if !["f", "i", "u"].contains(&kind.as_str()) || (own_axes != 0 && axes == [0]) {
        return Err(Fault::Kind);
    }
    if !axes.contains(&own_axes) {
        return Err(Fault::RangeOf(format!("shape {shape}")));
    }
    let converted = array.call_method1("astype", ("float64",));
    converted.map_err(|_| Fault::Kind)
}

/// A lixel.Pcf or one of the others: whatever has the name of a filter, and its parameters as attributes.
fn filter(value: &Bound<PyAny>) -> PyResult<Option<Value>> {
    let name = value
        .getattr("name")
        .and_then(|name| name.extract::<String>());
    let mut filters = FILTERS.iter();
    let named = filters.find(|(schema, _)| name.as_ref().is_ok_and(|name| name == schema.name));
    let Some((schema, make)) = named else {
        return Ok(None);
    };
    let mut parameters = schema.defaults();
    for parameter in schema.parameters() {
        let Ok(part) = value.getattr(parameter.name) else {
            return Ok(None);
        };
        parameters.set(parameter, checked(parameter, &part)?);
    }
    Ok(Some(make(&parameters)))
}

/// A lixel.LightMatrix: whatever has its own parameters as attributes.
fn light_matrix(value: &Bound<PyAny>) -> PyResult<Option<LightMatrix>> {
    let mut parameters = LightMatrix::SCHEMA.defaults();
    for name in ["matrix", "regions"] {
        let Ok(part) = value.getattr(name) else {
            return Ok(None);
        };
        let parameter = LightMatrix::SCHEMA.parameter(name)?;
        parameters.set(parameter, checked(parameter, &part)?);
    }
    let given = LightMatrix::from_parameters(&parameters);
    given.check()?;
    Ok(Some(given))
}

/// The layers of a frame: importance maps (layers, h, w), and matrices (layers, 4, 4) from the world.
fn old_maps(value: &Bound<PyAny>) -> Result<Value, Fault> {
    let parts: (PyReadonlyArray3<f32>, PyReadonlyArray3<f64>) =
        value.extract().map_err(|_| Fault::Kind)?;
    let (importance, matrices) = (parts.0.as_array(), parts.1.as_array());
    let (layers, rows, columns) = importance.dim();
    if matrices.dim() != (layers, 4, 4) {
        let shape = matrices.dim();
        return Err(Fault::RangeOf(format!("matrices of shape {shape:?}")));
    }
    let maps = importance.outer_iter().zip(matrices.outer_iter());
    let maps = maps.map(|(importance, matrix)| OldMap {
        importance: Array {
            rows,
            columns,
            values: importance.iter().copied().collect(),
        },
        map_from_world: DMat4::from_cols_slice(&matrix.t().iter().copied().collect::<Vec<_>>()),
    });
    Ok(Value::Maps(maps.collect()))
}

/// The value as Python keeps it; what Python made of other objects stays as it was given.
fn to_python<'py>(
    py: Python<'py>,
    value: &Value,
    given: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyAny>> {
    Ok(match value {
        Value::None => py.None().into_bound(py),
        Value::Bool(value) => value.into_pyobject(py)?.to_owned().into_any(),
        Value::Int(value) => value.into_pyobject(py)?.into_any(),
        Value::Pair(sides) => PyTuple::new(py, sides)?.into_any(),
        Value::Float(value) => value.into_pyobject(py)?.into_any(),
        Value::Text(value) => value.into_pyobject(py)?.into_any(),
        Value::Array(weights) => {
            let shape = [weights.rows, weights.columns];
            kept(py, &shape, weights.values.to_vec())
        }
        Value::Matrix(matrix) => {
            let rows = [0, 1, 2, 3].map(|row| matrix.row(row).to_array());
            let [a, b, c, d] = rows.map(|[a, b, c, d]| (a, b, c, d));
            (a, b, c, d).into_pyobject(py)?.into_any()
        }
        Value::Matrices(matrices) => {
            let rows = matrices
                .iter()
                .flat_map(|matrix| matrix.transpose().to_cols_array());
            kept(py, &[matrices.len(), 4, 4], rows.collect())
        }
        Value::Functions(functions) => {
            let shape = [2, functions.functions, functions.boundaries];
            let layers = functions.layers.into_iter();
            let shape: Vec<_> = layers.chain(shape).collect();
            kept(py, &shape, functions.values.to_vec())
        }
        Value::Samples(samples) => {
            let table = &samples.tables[0];
            let shape: Vec<_> = samples
                .layers()
                .into_iter()
                .chain([table.rows, table.columns, 2])
                .collect();
            let values = samples
                .tables
                .iter()
                .flat_map(|table| table.values.iter().copied());
            kept(py, &shape, values.collect())
        }
        Value::Regions(regions) => {
            let planes = |planes: &Vec<DVec4>| {
                let planes: Vec<_> = planes
                    .iter()
                    .map(|plane| <(f64, f64, f64, f64)>::from(*plane))
                    .collect();
                PyTuple::new(py, planes)
            };
            let regions: Vec<_> = regions.iter().map(planes).collect::<PyResult<_>>()?;
            PyTuple::new(py, regions)?.into_any()
        }
        Value::Filter(_) | Value::FilteredMap(_) | Value::Maps(_) | Value::Layers(_) => {
            given.clone()
        }
    })
}

/// Values as an array that nobody changes.
fn kept<'py, T: Element>(py: Python<'py>, shape: &[usize], values: Vec<T>) -> Bound<'py, PyAny> {
    let array = array(py, shape.to_vec(), values).into_bound(py);
    array.readwrite().make_nonwriteable();
    array.into_any()
}
