//! Parameters that methods share: of a shadow map and of a fit, each declared once.

use super::filters::default_filter;
use super::schema::{
    Choices, Entry, FRACTION, MAX_RESOLUTION, NON_NEGATIVE, POSITIVE, POSITIVE_FRACTION, Parameter,
    Rule, Schema, Typed, Value, chosen, count, flag, map_size, number, parameters, word,
};
use crate::error::{Error, Result};
use crate::fits::hull::MapFrame;
use crate::fits::improved_paraboloid::Splitting;
use crate::fits::matrix_layers::{Extent, Target};
use crate::light::Light;
use crate::map_settings::{Bias, BiasRule, Comparison, MapSettings, Rasterization};
use crate::map_size::MapSize;
use glam::DVec3;
use std::borrow::Cow;

const BIASES: Choices<Bias> = &[
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
        ..Comparison::DEPTH
    }
}

/// `None`: the filter of that name, as it is by default.
const LOOKUPS: Choices<Option<Comparison>> = &[
    ("auto", Some(comparison(1, true, true))),
    ("auto_5x5", Some(comparison(2, true, true))),
    ("depth", Some(Comparison::DEPTH)),
    ("triangle", Some(comparison(1, true, false))),
    ("triangle_1x1", Some(comparison(0, true, false))),
    ("triangle_5x5", Some(comparison(2, true, false))),
    ("revectorized", Some(Comparison::REVECTORIZED)),
    ("variance", None),
    ("exponential_variance", None),
    ("moments", None),
];

const RASTERIZATIONS: Choices<Rasterization> = &[
    ("exact", Rasterization::Exact),
    ("linear", Rasterization::Linear { longest_edge: None }),
];

parameters! {
    /// Parameters of every method that has a shadow map.
    pub struct MapParameters {
        pub resolution: MapSize = map_size(1024, MAX_RESOLUTION, "texels"),
        pub texels: TexelParameters,
    }
}

parameters! {
    /// How texels are made and looked at.
    pub struct TexelParameters {
        pub rasterization: Rasterization = choice(RASTERIZATIONS, "exact"),
        /// The longest edge of straight rasterization.
        pub tessellation: Option<f64> = number(None, POSITIVE_FRACTION, "sides of the map"),
        pub lookup: Comparison = word("auto", Rule::Lookup(&LOOKUPS)),
        pub bias: Bias = choice(BIASES, "auto"),
        /// `None` for the default of the kind of bias.
        pub constant_bias: Option<f64> = number(None, NON_NEGATIVE, "world units"),
        pub slope_bias: f64 = number(Some(1.0), NON_NEGATIVE, "texels"),
    }
}

impl Typed for Comparison {
    fn typed(value: &Value) -> Self {
        match value {
            Value::Filter(filter) => Self::filtered(*filter),
            Value::FilteredMap(map) => Self::of_moments(*map),
            other => {
                let word = Cow::typed(other);
                chosen(&word, LOOKUPS).unwrap_or_else(|| Self::typed(&default_filter(&word)))
            }
        }
    }
}

impl MapParameters {
    pub fn settings(&self) -> MapSettings {
        self.texels.settings()
    }
}

impl TexelParameters {
    pub fn settings(&self) -> MapSettings {
        MapSettings {
            rasterization: match self.rasterization {
                Rasterization::Exact => Rasterization::Exact,
                Rasterization::Linear { .. } => Rasterization::Linear {
                    longest_edge: self.tessellation,
                },
            },
            lookup: self.lookup,
            bias: BiasRule {
                kind: self.bias,
                constant: self.constant_bias,
                slope: self.slope_bias,
            },
        }
    }
}

/// Receivers looked at along the longer side of the image, as in Chong and Gortler, section 2.4.
pub const SAMPLE_RESOLUTION: Parameter = count(Some(180), MAX_RESOLUTION, "pixels");

/// By how much of its size a map is widened: between two samples something may stick out.
pub const MARGIN: Parameter = number(Some(0.02), FRACTION, "sides of the map");

/// Of the map's plane around the light's direction; `None` for off the scene's edges.
pub const ROTATION: Parameter = number(None, NON_NEGATIVE, "radians");

/// Which way the first of two paraboloids looks.
pub const SPLITTINGS: Choices<Splitting> =
    &[("light", Splitting::Light), ("view", Splitting::View)];

/// Whether texels hold still while the receivers move.
pub const SNAP: Parameter = flag(false);

const EXTENTS: Choices<Extent> = &[
    ("receivers", Extent::Receivers),
    ("frustum", Extent::Frustum),
];

parameters! {
    /// Parameters of the methods that fit a light matrix.
    pub struct FitParameters {
        pub fit: Extent = choice(EXTENTS, "receivers"),
        pub sample_resolution: u32 = SAMPLE_RESOLUTION,
        pub margin: f64 = MARGIN,
    }
}

impl FitParameters {
    /// What the matrices of a map of that size are fitted to, and into.
    pub fn target(&self, size: MapSize) -> Target {
        Target {
            extent: self.fit,
            sample_resolution: self.sample_resolution,
            frame: MapFrame {
                size,
                margin: self.margin,
            },
        }
    }
}

/// Of the choice of a method, which Python makes.
pub const AUTO: Schema = Schema {
    name: "auto",
    entries: &[
        Entry::One(number(Some(0.001), FRACTION, "of the covered pixels").named("max_error")),
        Entry::One(number(None, POSITIVE, "milliseconds").named("max_ms")),
    ],
};

/// The light's position; an error where it is at infinity, which the method is not made for.
pub fn position_of(light: &Light, method: &str) -> Result<DVec3> {
    light.position().ok_or_else(|| {
        Error::Value(format!(
            "method {method:?} needs a light with a position, got a {} light",
            light.kind()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use crate::methods::Method;
    use crate::methods::arrays::Fault;
    use crate::methods::filters::FILTERS;

    fn refused(name: &str, value: Value) -> Error {
        let parameter = Method::schema("uniform").unwrap().parameter(name).unwrap();
        let got = format!("{value:?}");
        parameter.error(parameter.check(value).unwrap_err(), &got)
    }

    #[test]
    fn errors_name_parameter_rule_and_value() {
        for (name, value, words) in [
            (
                "resolution",
                Value::Int(0),
                "a whole number of texels from 1 to 32768, or (width, height) of such numbers, got Int(0)",
            ),
            ("resolution", Value::Int(1 << 40), "got Int(1099511627776)"),
            ("resolution", Value::Pair([512, 0]), "got Pair([512, 0])"),
            ("resolution", Value::Pair([-3, 512]), "got Pair([-3, 512])"),
            (
                "resolution",
                Value::Pair([32769, 1]),
                "got Pair([32769, 1])",
            ),
            (
                "bias",
                Value::Text("none".into()),
                "one of 'auto', 'constant', 'slope', 'receiver_plane', got",
            ),
            (
                "slope_bias",
                Value::Float(-1.0),
                "a finite number, at least 0, got Float(-1.0)",
            ),
            (
                "lookup",
                Value::Text("pcf".into()),
                "'moments' or a lixel.Pcf, Variance, ExponentialVariance or Moments, got",
            ),
            (
                "constant_bias",
                Value::Float(f64::NAN),
                "a finite number, at least 0 or None, got Float(NaN)",
            ),
            (
                "tessellation",
                Value::Int(0),
                "a number above 0 and at most 1 or None, got Int(0)",
            ),
        ] {
            let error = refused(name, value);
            assert!(matches!(error, Error::Value(_)), "{error:?}");
            assert!(
                error.to_string().starts_with(&format!("{name} must be ")),
                "{error}"
            );
            assert!(error.to_string().contains(words), "{error}");
        }
        for (name, value) in [
            ("resolution", Value::Float(1.5)),
            ("slope_bias", Value::None),
            ("bias", Value::Int(1)),
        ] {
            assert!(matches!(refused(name, value), Error::Type(_)), "{name}");
        }
        let error = Method::schema("uniform").unwrap().parameter("colour").err();
        assert!(error.unwrap().to_string().contains("got 'colour'"));
    }

    #[test]
    fn every_default_obeys_its_rule() {
        let methods = Method::list().into_iter().map(|method| method.schema);
        let filters = FILTERS.map(|(schema, _)| schema);
        for schema in methods.chain(filters).chain([AUTO]) {
            for parameter in schema.parameters() {
                let default = parameter.default.clone();
                assert_eq!(
                    parameter.check(default.clone()),
                    Ok(default),
                    "{}",
                    parameter.name
                );
                if let Rule::Count { max } | Rule::MapSize { max } = parameter.rule {
                    assert!(!parameter.unit.is_empty(), "{}", parameter.name);
                    let above = Value::Int(i64::from(max) + 1);
                    assert_eq!(parameter.check(above), Err(Fault::Range));
                }
            }
        }
    }

    #[test]
    fn unknown_methods_are_answered_with_the_known_ones() {
        let error = Method::schema("best").err().unwrap();
        for method in Method::list() {
            assert!(error.to_string().contains(method.schema.name), "{error}");
        }
    }
}
