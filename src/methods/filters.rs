//! Parameters of filters, which are values of `lookup`, each declared once.

use super::schema::{
    Choices, FRACTION, Least, NON_NEGATIVE, Parameter, ParameterGroup, Parameters, Rule, Schema,
    Value, count, flag, number, number_or_none, parameters, word,
};
use crate::map_settings::Filter;
use crate::moments::{FilteredMap, Kernel, MAX_EXPONENT, Moments};

/// Depth tests of a pixel; with the rows of an invocation they stay below 65,535 iterations.
const MAX_SAMPLES: u32 = 1024;

/// Each with whether the disc lies across the light's rays, before the warp.
const SPACES: Choices<bool> = &[("warped", false), ("unwarped", true)];

/// Each with whether a test weighs less the farther it is from the receiver.
const WEIGHTS: Choices<bool> = &[("even", false), ("gaussian", true)];

parameters! {
    /// Of percentage closer filtering.
    pub struct FilterParameters {
        pub radius: f64 = number(Some(2.0), NON_NEGATIVE, "texels or world units"),
        pub samples: u32 = count(Some(16), MAX_SAMPLES, "points"),
        pub space: bool = choice(SPACES, "warped"),
        pub weights: bool = choice(WEIGHTS, "even"),
        pub jitter: bool = flag(false),
    }
}

const KERNELS: Choices<Kernel> = &[("gaussian", Kernel::Gaussian), ("box", Kernel::Box)];

/// Texels on each side; the time grows with it.
const BLUR: Rule = up_to(256.0);

const EXPONENT: Rule = Rule::Number {
    least: Least::AboveZero,
    max: MAX_EXPONENT,
};

const fn up_to(max: f64) -> Rule {
    Rule::Number {
        least: Least::Zero,
        max,
    }
}

/// In squares of the layer's range of depths.
const fn least_variance(default: f64) -> Parameter {
    number(Some(default), FRACTION, "squares of the depth range")
}

parameters! {
    /// Of every filtered map.
    pub struct BlurParameters {
        pub blur: f64 = number(Some(2.0), BLUR, "texels"),
        pub kernel: Kernel = choice(KERNELS, "gaussian"),
        pub mips: bool = flag(false),
        pub bleeding_reduction: f64 = number(Some(0.0), up_to(0.99), ""),
    }
}

parameters! {
    /// Of variance shadow maps.
    pub struct VarianceParameters {
        pub blur: BlurParameters,
        /// Ten times what float32 rounds of a mean square.
        pub min_variance: f64 = least_variance(1e-6),
    }
}

parameters! {
    /// Of exponential variance shadow maps.
    pub struct ExponentialParameters {
        pub blur: BlurParameters,
        pub exponent: f64 = number(Some(40.0), EXPONENT, ""),
        pub negative_exponent: Option<f64> = number_or_none(5.0, EXPONENT, ""),
        /// Less, since it grows with the exponent: at 40 it lights every shadow by 6e-5 if nothing else darkens it.
        pub min_variance: f64 = least_variance(1e-8),
    }
}

parameters! {
    /// Of moment shadow maps.
    pub struct MomentParameters {
        pub blur: BlurParameters,
        pub moment_bias: f64 = number(Some(3e-6), FRACTION, ""),
    }
}

/// What a filter is from its parameters.
type Make = fn(&Parameters) -> Value;

/// The filters: parameters, and the value of `lookup` that they make.
pub const FILTERS: [(Schema, Make); 4] = [
    (schema::<FilterParameters>("pcf"), |values| {
        let parameters = FilterParameters::from_parameters(values);
        Value::Filter(Filter {
            radius: parameters.radius,
            samples: parameters.samples,
            is_unwarped: parameters.space,
            is_gaussian: parameters.weights,
            is_jittered: parameters.jitter,
        })
    }),
    (schema::<VarianceParameters>("variance"), |values| {
        let parameters = VarianceParameters::from_parameters(values);
        let least = parameters.min_variance;
        parameters.blur.of(Moments::Variance { least })
    }),
    (
        schema::<ExponentialParameters>("exponential_variance"),
        |values| {
            let parameters = ExponentialParameters::from_parameters(values);
            parameters.blur.of(Moments::Exponential {
                exponent: parameters.exponent,
                negative: parameters.negative_exponent,
                least: parameters.min_variance,
            })
        },
    ),
    (schema::<MomentParameters>("moments"), |values| {
        let parameters = MomentParameters::from_parameters(values);
        let bias = parameters.moment_bias;
        parameters.blur.of(Moments::Four { bias })
    }),
];

/// The filter of that name with the defaults of its parameters.
pub fn default_filter(name: &str) -> Value {
    let mut filters = FILTERS.iter();
    let found = filters.find(|(schema, _)| schema.name == name);
    let (schema, make) = found.expect("a lookup without a comparison is a filter");
    make(&schema.defaults())
}

const fn schema<P: ParameterGroup>(name: &'static str) -> Schema {
    Schema {
        name,
        entries: P::ENTRIES,
    }
}

impl BlurParameters {
    fn of(self, moments: Moments) -> Value {
        Value::FilteredMap(FilteredMap {
            moments,
            blur: self.blur,
            kernel: self.kernel,
            mips: self.mips,
            bleeding_reduction: self.bleeding_reduction,
        })
    }
}
