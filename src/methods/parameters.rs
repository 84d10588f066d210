//! Parameters of methods: names to values, checked with errors that name the parameter.

use crate::error::{Error, Result, ensure_value};
use crate::gpu::passes::lookup::{Comparison, DepthBias, Filter};
use crate::gpu::passes::rasterize::Rasterization;
use crate::projection::{Kind, Projection};
use glam::{DMat4, DVec3};
use std::collections::BTreeMap;
use std::sync::Arc;

/// A value of a parameter, as Python has it.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    None,
    Bool(bool),
    Int(i64),
    Float(f64),
    Text(String),
    Array(Array),
    /// A matrix of 4 x 4, row by row.
    Matrix(Box<[f64; 16]>),
    Maps(Arc<[OldMap]>),
}

/// What a layer of the frame before leaves to the next one.
#[derive(Debug, Clone, PartialEq)]
pub struct OldMap {
    pub importance: Array,
    /// (x, y, depth, w) from a point in the world, x and y from 0 to 1 in the map.
    pub map_from_world: DMat4,
}

/// Numbers in rows.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    pub rows: usize,
    pub columns: usize,
    pub values: Arc<[f32]>,
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::None => write!(f, "None"),
            Self::Bool(true) => write!(f, "True"),
            Self::Bool(false) => write!(f, "False"),
            Self::Int(value) => write!(f, "{value}"),
            Self::Float(value) => write!(f, "{value}"),
            Self::Text(value) => write!(f, "{value:?}"),
            Self::Array(array) => {
                write!(f, "an array of shape ({}, {})", array.rows, array.columns)
            }
            Self::Matrix(value) => write!(f, "{value:?}"),
            Self::Maps(maps) => write!(f, "{} layers", maps.len()),
        }
    }
}

/// Parameters by name. Each is taken once.
#[derive(Debug, Clone, Default)]
pub struct Parameters(BTreeMap<String, Value>);

impl FromIterator<(String, Value)> for Parameters {
    fn from_iter<I: IntoIterator<Item = (String, Value)>>(values: I) -> Self {
        Self(values.into_iter().collect())
    }
}

impl Parameters {
    /// Fills in the defaults; a name that has none is unknown.
    pub fn with_defaults(mut self, method: &str, defaults: Vec<(&str, Value)>) -> Result<Self> {
        if let Some(unknown) = self
            .0
            .keys()
            .find(|k| !defaults.iter().any(|(d, _)| d == k))
        {
            let known: Vec<_> = defaults.iter().map(|(name, _)| *name).collect();
            return Err(Error::Value(format!(
                "method {method:?} has the parameters {}, got {unknown:?}",
                known.join(", ")
            )));
        }
        for (name, value) in defaults {
            self.0.entry(name.to_string()).or_insert(value);
        }
        Ok(self)
    }

    fn take(&mut self, name: &str) -> Value {
        self.0
            .remove(name)
            .expect("every parameter has a default and is taken once")
    }

    /// A number of texels along the side of a map.
    pub fn take_resolution(&mut self, name: &str) -> Result<u32> {
        match self.take(name) {
            Value::Int(value) if (1..=i64::from(LARGEST_RESOLUTION)).contains(&value) => {
                Ok(value as u32)
            }
            value => Err(Error::Value(format!(
                "{name} must be a whole number of texels from 1 to {LARGEST_RESOLUTION}, got {value}"
            ))),
        }
    }

    /// A whole number from 1.
    pub fn take_count(&mut self, name: &str, most: u32) -> Result<u32> {
        match self.take(name) {
            Value::Int(value) if (1..=i64::from(most)).contains(&value) => Ok(value as u32),
            value => Err(Error::Value(format!(
                "{name} must be a whole number from 1 to {most}, got {value}"
            ))),
        }
    }

    /// As `take_resolution`, or `None`.
    pub fn take_optional_resolution(&mut self, name: &str) -> Result<Option<u32>> {
        if self.0.get(name) == Some(&Value::None) {
            self.take(name);
            return Ok(None);
        }
        self.take_resolution(name).map(Some)
    }

    /// True or false.
    pub fn take_flag(&mut self, name: &str) -> Result<bool> {
        match self.take(name) {
            Value::Bool(value) => Ok(value),
            value => Err(Error::Value(format!(
                "{name} must be True or False, got {value}"
            ))),
        }
    }

    /// A number that is finite and not negative.
    pub fn take_non_negative(&mut self, name: &str) -> Result<f64> {
        let value = self.take(name);
        let number = match value {
            Value::Float(number) => number,
            Value::Int(number) => number as f64,
            _ => f64::NAN,
        };
        ensure_value!(
            number.is_finite() && number >= 0.0,
            "{name} must be a finite number, at least 0, got {value}"
        );
        Ok(number)
    }

    /// A number from 0 to 1.
    pub fn take_fraction(&mut self, name: &str) -> Result<f64> {
        let number = self.take_non_negative(name)?;
        ensure_value!(number <= 1.0, "{name} must be at most 1, got {number}");
        Ok(number)
    }

    /// As `take_non_negative`, or `None`.
    pub fn take_optional(&mut self, name: &str) -> Result<Option<f64>> {
        if self.0.get(name) == Some(&Value::None) {
            self.take(name);
            return Ok(None);
        }
        self.take_non_negative(name).map(Some)
    }

    /// Weights in rows: finite, not negative, at least one of them; or `None`.
    pub fn take_weights(&mut self, name: &str) -> Result<Option<Array>> {
        match self.take(name) {
            Value::None => Ok(None),
            Value::Array(array) => {
                ensure_value!(
                    !array.values.is_empty(),
                    "{name} must hold at least one weight, got an array of shape ({}, {})",
                    array.rows,
                    array.columns
                );
                let is_weight = |value: &&f32| value.is_finite() && **value >= 0.0;
                if let Some(wrong) = array.values.iter().find(|value| !is_weight(value)) {
                    return Err(Error::Value(format!(
                        "{name} must be finite and not negative, got {wrong}"
                    )));
                }
                Ok(Some(array))
            }
            value => Err(Error::Value(format!(
                "{name} must be an array with two axes, got {value}"
            ))),
        }
    }

    /// A finite matrix of 4 x 4, or `None`.
    pub fn take_matrix(&mut self, name: &str) -> Result<Option<DMat4>> {
        match self.take(name) {
            Value::None => Ok(None),
            Value::Matrix(rows) if rows.iter().all(|entry| entry.is_finite()) => {
                Ok(Some(DMat4::from_cols_array(&rows).transpose()))
            }
            value => Err(Error::Value(format!(
                "{name} must be a finite matrix of 4 x 4 or None, got {value}"
            ))),
        }
    }

    /// The layers of the frame before; none where there was no frame.
    pub fn take_maps(&mut self, name: &str) -> Result<Arc<[OldMap]>> {
        match self.take(name) {
            Value::None => Ok(Arc::new([])),
            Value::Maps(maps) => {
                let is_whole = |map: &OldMap| {
                    let importance = &map.importance.values;
                    !importance.is_empty()
                        && importance.iter().all(|&w| w.is_finite() && w >= 0.0)
                        && map.map_from_world.is_finite()
                };
                ensure_value!(
                    maps.iter().all(is_whole),
                    "{name} must have finite matrices and importance that is finite and not negative"
                );
                Ok(maps)
            }
            value => Err(Error::Value(format!("{name} must be a frame, got {value}"))),
        }
    }

    /// A product of words, `"a*b"`, each at most once.
    pub fn take_product(
        &mut self,
        name: &str,
        known: &[&'static str],
    ) -> Result<Vec<&'static str>> {
        let value = self.take(name);
        let words = match &value {
            Value::Text(text) => text
                .split('*')
                .map(|word| known.iter().copied().find(|&known| known == word.trim()))
                .collect::<Option<Vec<_>>>(),
            _ => None,
        };
        words.ok_or_else(|| {
            let known = known.join(", ");
            Error::Value(format!("{name} must be a product of {known}, got {value}"))
        })
    }

    fn take_rasterization(&mut self) -> Result<Rasterization> {
        let is_linear = self.take_choice("rasterization", &[("exact", false), ("linear", true)])?;
        let longest_edge = self.take_optional("tessellation")?;
        if let Some(share) = longest_edge {
            ensure_value!(
                share > 0.0 && share <= 1.0,
                "tessellation must be above 0 and at most 1, got {share}"
            );
        }
        Ok(match is_linear {
            true => Rasterization::Linear { longest_edge },
            false => Rasterization::Exact,
        })
    }

    /// One of `LOOKUPS`, or a filter: `"pcf(radius=2.0, samples=16, space=warped)"`.
    fn take_lookup(&mut self) -> Result<Comparison> {
        let filter = match self.0.get("lookup") {
            Some(Value::Text(text)) => filter_from_text(text),
            _ => None,
        };
        let Some(filter) = filter else {
            return self.take_choice("lookup", LOOKUPS);
        };
        self.take("lookup");
        let Filter {
            radius, samples, ..
        } = filter;
        ensure_value!(
            radius.is_finite() && radius >= 0.0,
            "radius must be finite and not negative, got {radius}"
        );
        ensure_value!(
            (1..=MAX_SAMPLES).contains(&samples),
            "samples must be from 1 to {MAX_SAMPLES}, got {samples}"
        );
        Ok(Comparison::filtered(filter))
    }

    /// One of a few words.
    pub fn take_choice<T: Copy>(&mut self, name: &str, choices: &[(&str, T)]) -> Result<T> {
        let value = self.take(name);
        if let Value::Text(text) = &value
            && let Some((_, choice)) = choices.iter().find(|(known, _)| known == text)
        {
            return Ok(*choice);
        }
        let known: Vec<_> = choices.iter().map(|(known, _)| *known).collect();
        Err(Error::Value(format!(
            "{name} must be one of {}, got {value}",
            known.join(", ")
        )))
    }
}

/// Depth tests of a pixel; with the rows of an invocation they stay below 65,535 iterations.
const MAX_SAMPLES: u32 = 1024;

fn filter_from_text(text: &str) -> Option<Filter> {
    let mut parts = text.strip_prefix("pcf(")?.strip_suffix(')')?.split(", ");
    let filter = Filter {
        radius: parts.next()?.strip_prefix("radius=")?.parse().ok()?,
        samples: parts.next()?.strip_prefix("samples=")?.parse().ok()?,
        is_unwarped: match parts.next()? {
            "space=warped" => false,
            "space=unwarped" => true,
            _ => return None,
        },
    };
    parts.next().is_none().then_some(filter)
}

/// Beyond this a map's texels would not count in 32 bits.
const LARGEST_RESOLUTION: u32 = 32768;

/// Parameters of every method that has a shadow map.
#[derive(Debug, Clone, PartialEq)]
pub struct MapParameters {
    /// Texels along each side.
    pub resolution: u32,
    pub rasterization: Rasterization,
    pub lookup: Comparison,
    pub bias: Bias,
    /// World units; `None` for the default of the kind of bias.
    pub constant_bias: Option<f64>,
    /// Texels.
    pub slope_bias: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bias {
    /// The receiver's plane on the texel's ray, less the width of a texel and a bound of the rounding.
    Auto,
    Constant,
    Slope,
    ReceiverPlane,
}

const BIASES: &[(&str, Bias)] = &[
    ("auto", Bias::Auto),
    ("constant", Bias::Constant),
    ("slope", Bias::Slope),
    ("receiver_plane", Bias::ReceiverPlane),
];

const fn comparison(reach: u8, triangles: bool, depths: bool) -> Comparison {
    Comparison {
        reach,
        triangles,
        depths,
        filter: None,
    }
}

const LOOKUPS: &[(&str, Comparison)] = &[
    ("auto", comparison(1, true, true)),
    ("auto_5x5", comparison(2, true, true)),
    ("depth", Comparison::DEPTH),
    ("triangle", comparison(1, true, false)),
    ("triangle_1x1", comparison(0, true, false)),
    ("triangle_5x5", comparison(2, true, false)),
];

impl MapParameters {
    /// With the defaults of the other parameters.
    pub fn new(resolution: u32) -> Self {
        Self {
            resolution,
            rasterization: Rasterization::Exact,
            lookup: LOOKUPS[0].1,
            bias: Bias::Auto,
            constant_bias: None,
            slope_bias: 1.0,
        }
    }

    /// For a first pass that asks where shadows are: each receiver lit or not.
    pub fn without_filter(&self) -> Self {
        let mut lookup = self.lookup;
        lookup.filter = None;
        Self {
            lookup,
            ..self.clone()
        }
    }

    pub fn defaults() -> Vec<(&'static str, Value)> {
        vec![
            ("resolution", Value::Int(1024)),
            ("rasterization", Value::Text("exact".to_string())),
            ("tessellation", Value::None),
            ("lookup", Value::Text("auto".to_string())),
            ("bias", Value::Text("auto".to_string())),
            ("constant_bias", Value::None),
            ("slope_bias", Value::Float(1.0)),
        ]
    }

    pub fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        Ok(Self {
            resolution: parameters.take_resolution("resolution")?,
            rasterization: parameters.take_rasterization()?,
            lookup: parameters.take_lookup()?,
            bias: parameters.take_choice("bias", BIASES)?,
            constant_bias: parameters.take_optional("constant_bias")?,
            slope_bias: parameters.take_non_negative("slope_bias")?,
        })
    }

    /// The bias of a map, whose positions are known to `rounding`.
    pub fn depth_bias(&self, projection: &Projection, rounding: f64) -> DepthBias {
        let texel_width = projection.beam_width();
        let plane = DepthBias {
            receiver_plane: true,
            rounding,
            ..DepthBias::NONE
        };
        let fixed = DepthBias {
            receiver_plane: false,
            ..plane
        };
        match self.bias {
            // Where triangles meet at an angle, a texel's ray meets the neighbour, off the receiver's
            // plane by about a texel. Measured over 16 views of 8 scenes: one texel leaves a quarter
            // of the wrong pixels of none, and no choice from half of one to four leaves fewer than
            // nine tenths of what one does.
            Bias::Auto => DepthBias {
                beam: texel_width,
                ..plane
            },
            Bias::Constant => DepthBias {
                constant: self.constant_bias.unwrap_or(0.0),
                beam: self.constant_bias.map_or(texel_width, |_| 0.0),
                rounding: 0.0,
                ..fixed
            },
            Bias::Slope => DepthBias {
                constant: self.constant_bias.unwrap_or(0.0),
                slope: self.slope_bias,
                ..fixed
            },
            Bias::ReceiverPlane => DepthBias {
                constant: self.constant_bias.unwrap_or(0.0),
                ..plane
            },
        }
    }
}

/// A bound of the error of a float32 position in the light's space: positions are sums of a few
/// terms, none larger than the distance of the eye and the size of the map's box together.
pub fn position_rounding(projection: &Projection, eye: DVec3) -> f64 {
    let depth = projection.far - projection.near;
    let size = match (projection.kind, projection.homography) {
        (Kind::Parallel, None) => {
            let steps = projection.steps();
            let width = steps.x_axis.length() * f64::from(projection.width);
            let height = steps.y_axis.length() * f64::from(projection.height);
            DVec3::new(width, height, depth).length()
        }
        (Kind::Parallel, Some(homography)) => homography.reach.hypot(depth),
        (Kind::Perspective | Kind::Paraboloid, _) => projection.far,
    };
    let scale = (eye - projection.origin).length() + size;
    8.0 * f64::from(f32::EPSILON / 2.0) * scale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::Method;

    fn message(name: &str, value: Value) -> String {
        let parameters = Parameters::from_iter([(name.to_string(), value)]);
        Method::new("uniform", parameters).unwrap_err().to_string()
    }

    #[test]
    fn errors_name_parameter_rule_and_value() {
        for (name, value, got) in [
            ("resolution", Value::Int(0), "got 0"),
            ("resolution", Value::Float(1.5), "got 1.5"),
            ("resolution", Value::Int(1 << 40), "got 1099511627776"),
            ("bias", Value::Text("none".into()), "got \"none\""),
            ("slope_bias", Value::Float(-1.0), "got -1"),
            ("lookup", Value::Text("pcf".into()), "got \"pcf\""),
            ("constant_bias", Value::Float(f64::NAN), "got NaN"),
            ("colour", Value::Int(1), "got \"colour\""),
        ] {
            let message = message(name, value);
            assert!(message.contains(got), "{message}");
            assert!(name == "colour" || message.starts_with(name), "{message}");
        }
    }

    #[test]
    fn unknown_methods_are_answered_with_the_known_ones() {
        let error = Method::new("best", Parameters::default()).unwrap_err();
        for method in Method::list() {
            assert!(error.to_string().contains(method.name), "{error}");
        }
    }
}
