//! Parameters that methods share: of a shadow map, of a fit, of a filter, each declared once.

use super::schema::{
    Choices, FRACTION, MAX_RESOLUTION, NON_NEGATIVE, POSITIVE, POSITIVE_FRACTION, Parameter,
    Parameters, Rule, Schema, Value, count, flag, number, word,
};
use crate::error::{Error, Result};
use crate::fits::boxes::Cut;
use crate::fits::hull::MapSize;
use crate::fits::matrix_layers::Extent;
use crate::gpu::passes::bias::{Bias, BiasRule};
use crate::gpu::passes::lookup::{Comparison, Filter};
use crate::gpu::passes::rasterize::Rasterization;
use crate::gpu::view::MapSettings;
use crate::light::Light;
use glam::DVec3;

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
        filter: None,
    }
}

const LOOKUPS: Choices<Comparison> = &[
    ("auto", comparison(1, true, true)),
    ("auto_5x5", comparison(2, true, true)),
    ("depth", Comparison::DEPTH),
    ("triangle", comparison(1, true, false)),
    ("triangle_1x1", comparison(0, true, false)),
    ("triangle_5x5", comparison(2, true, false)),
];

/// Each with whether edges are straight in the map.
const RASTERIZATIONS: Choices<bool> = &[("exact", false), ("linear", true)];

impl MapParameters {
    pub const PARAMETERS: &'static [Parameter] = &[
        count("resolution", Some(1024), MAX_RESOLUTION, "texels"),
        word("rasterization", "exact", Rule::Choice(&RASTERIZATIONS)),
        number("tessellation", None, POSITIVE_FRACTION, "sides of the map"),
        word("lookup", "auto", Rule::Lookup(&LOOKUPS)),
        word("bias", "auto", Rule::Choice(&BIASES)),
        number("constant_bias", None, NON_NEGATIVE, "world units"),
        number("slope_bias", Some(1.0), NON_NEGATIVE, "texels"),
    ];

    pub fn from_parameters(parameters: &Parameters) -> Self {
        let longest_edge = parameters.get("tessellation");
        let is_linear = parameters.choice("rasterization", RASTERIZATIONS);
        Self {
            resolution: parameters.get("resolution"),
            rasterization: match is_linear {
                true => Rasterization::Linear { longest_edge },
                false => Rasterization::Exact,
            },
            lookup: match parameters.value("lookup") {
                Value::Filter(filter) => Comparison::filtered(*filter),
                _ => parameters.choice("lookup", LOOKUPS),
            },
            bias: parameters.choice("bias", BIASES),
            constant_bias: parameters.get("constant_bias"),
            slope_bias: parameters.get("slope_bias"),
        }
    }

    /// With the defaults of the other parameters.
    pub fn new(resolution: u32) -> Self {
        let groups = &[Self::PARAMETERS];
        let schema = Schema {
            name: "map",
            groups,
        };
        Self {
            resolution,
            ..Self::from_parameters(&schema.defaults())
        }
    }

    pub fn settings(&self) -> MapSettings {
        MapSettings {
            rasterization: self.rasterization,
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
pub const SAMPLE_RESOLUTION: Parameter =
    count("sample_resolution", Some(180), MAX_RESOLUTION, "pixels");

/// By how much of its size a map is widened: between two samples something may stick out.
pub const MARGIN: Parameter = number("margin", Some(0.02), FRACTION, "sides of the map");

/// Whether texels hold still while the receivers move.
pub const SNAP: Parameter = flag("snap", false);

/// What a layer is cut to: `cut`, one of a few words, and `snap`.
pub fn cut_from(parameters: &Parameters, cuts: Choices<Cut>) -> Cut {
    match parameters.choice("cut", cuts) {
        Cut::Receivers => Cut::to_receivers(parameters.get("snap")),
        cut => cut,
    }
}

/// Parameters of the methods that fit a light matrix.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitParameters {
    pub extent: Extent,
    /// Receivers looked at along the longer side of the image.
    pub sample_resolution: u32,
    /// By how much of its size the map is widened.
    pub margin: f64,
}

const EXTENTS: Choices<Extent> = &[
    ("receivers", Extent::Receivers),
    ("frustum", Extent::Frustum),
];

impl FitParameters {
    pub const PARAMETERS: &'static [Parameter] = &[
        word("fit", "receivers", Rule::Choice(&EXTENTS)),
        SAMPLE_RESOLUTION,
        MARGIN,
    ];

    pub fn from_parameters(parameters: &Parameters) -> Self {
        Self {
            extent: parameters.choice("fit", EXTENTS),
            sample_resolution: parameters.get("sample_resolution"),
            margin: parameters.get("margin"),
        }
    }

    /// What the matrices of a map with that resolution are fitted into.
    pub fn size(&self, resolution: u32) -> MapSize {
        MapSize {
            resolution,
            margin: self.margin,
        }
    }
}

/// Depth tests of a pixel; with the rows of an invocation they stay below 65,535 iterations.
const MAX_SAMPLES: u32 = 1024;

/// Each with whether the disc lies across the light's rays, before the warp.
const SPACES: Choices<bool> = &[("warped", false), ("unwarped", true)];

/// Of percentage closer filtering, a value of `lookup`.
pub const FILTER: Schema = Schema {
    name: "pcf",
    groups: &[&[
        number("radius", Some(2.0), NON_NEGATIVE, "texels or world units"),
        count("samples", Some(16), MAX_SAMPLES, "points"),
        word("space", "warped", Rule::Choice(&SPACES)),
    ]],
};

impl Filter {
    pub fn from_parameters(parameters: &Parameters) -> Self {
        Self {
            radius: parameters.get("radius"),
            samples: parameters.get("samples"),
            is_unwarped: parameters.choice("space", SPACES),
        }
    }
}

/// Of the choice of a method, which Python makes.
pub const AUTO: Schema = Schema {
    name: "auto",
    groups: &[&[
        number("max_error", Some(0.001), FRACTION, "of the covered pixels"),
        number("max_ms", None, POSITIVE, "milliseconds"),
    ]],
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
    use crate::methods::schema::Fault;

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
                "a whole number of texels from 1 to 32768, got Int(0)",
            ),
            ("resolution", Value::Int(1 << 40), "got Int(1099511627776)"),
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
                "'triangle_5x5' or a lixel.Pcf, got",
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
        for schema in methods.chain([FILTER, AUTO]) {
            for parameter in schema.parameters() {
                let default = parameter.default.clone();
                assert_eq!(
                    parameter.check(default.clone()),
                    Ok(default),
                    "{}",
                    parameter.name
                );
                if let Rule::Count { max } = parameter.rule {
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
