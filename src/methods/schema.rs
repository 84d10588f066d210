//! What a parameter is: its name, its rule, its default and its unit, declared once as data.
//!
//! A rule checks a value and words its own error. Python's classes hold fields and docstrings; their
//! values are checked here too, so that both entries refuse the same values in the same words.

use super::arrays::{Array, Fault, OldMap, WarpFunctions, WarpSamples};
use crate::error::{Error, Result};
use crate::fits::given::GivenLayers;
use crate::map_settings::Filter;
use crate::map_size::MapSize;
use crate::moments::FilteredMap;
use crate::region::MAX_HALF_SPACES;
use crate::warp::MAX_CELLS;
use crate::warp::tables::MAX_SAMPLES;
use glam::{DMat4, DVec4};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt;
use std::sync::Arc;

/// A parameter of a method.
pub struct Parameter {
    pub name: &'static str,
    pub rule: Rule,
    /// What it is where it is left out; where this is `None` the parameter may be `None`, too.
    pub default: Value,
    /// Whether it may be `None` though its default is not.
    may_be_none: bool,
    /// Empty where it has none.
    pub unit: &'static str,
}

/// What the values of a parameter must be.
#[derive(Clone, Copy)]
pub enum Rule {
    Flag,
    /// A whole number from 1.
    Count {
        max: u32,
    },
    /// A whole number from 1, of each side of a map, or two of them.
    MapSize {
        max: u32,
    },
    /// A finite number from the least one to `max`.
    Number {
        least: Least,
        max: f64,
    },
    /// Such a number, or one of a few words.
    NumberOr {
        least: Least,
        max: f64,
        words: &'static [&'static str],
    },
    /// One of a few words.
    Choice(&'static dyn Words),
    /// One of a few words, or a filter.
    Lookup(&'static dyn Words),
    /// A product of words, `"a*b"`.
    Product(&'static [&'static str]),
    /// An array of weights.
    Weights,
    Matrix,
    Maps,
    /// One of a few words, or light matrices.
    Fit(&'static dyn Words),
    /// Light matrices, one for each layer.
    Matrices,
    /// Planes around what each layer is for.
    Regions,
    /// Functions of a warp.
    Functions,
    /// Tables of a warp.
    Samples,
}

/// Where the values of a number begin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Least {
    Zero,
    AboveZero,
    Any,
}

impl Least {
    fn allows(self, number: f64) -> bool {
        match self {
            Self::Zero => number >= 0.0,
            Self::AboveZero => number > 0.0,
            Self::Any => true,
        }
    }
}

/// What a number must be, in words.
fn rule_of_numbers(least: Least, max: f64) -> String {
    match (least, max.is_finite()) {
        (Least::Zero, false) => "a finite number, at least 0".to_string(),
        (Least::AboveZero, false) => "a finite number above 0".to_string(),
        (Least::Any, false) => "a finite number".to_string(),
        (Least::Zero, true) => format!("a number from 0 to {max}"),
        (Least::AboveZero, true) => format!("a number above 0 and at most {max}"),
        (Least::Any, true) => format!("a number of at most {max}"),
    }
}

/// Words, each with what it stands for.
pub type Choices<T> = &'static [(&'static str, T)];

/// The words of a choice, whatever they stand for.
pub trait Words: Sync {
    fn words(&self) -> Vec<&'static str>;
}

impl<T: Sync> Words for Choices<T> {
    fn words(&self) -> Vec<&'static str> {
        self.iter().map(|(word, _)| *word).collect()
    }
}

pub const NON_NEGATIVE: Rule = Rule::Number {
    least: Least::Zero,
    max: f64::INFINITY,
};
pub const POSITIVE: Rule = Rule::Number {
    least: Least::AboveZero,
    max: f64::INFINITY,
};
pub const FRACTION: Rule = Rule::Number {
    least: Least::Zero,
    max: 1.0,
};
pub const POSITIVE_FRACTION: Rule = Rule::Number {
    least: Least::AboveZero,
    max: 1.0,
};

/// Of light matrices that somebody gives.
const MAX_LAYERS: usize = 64;

/// Beyond this a map's texels would not count in 32 bits.
pub const MAX_RESOLUTION: u32 = 32768;

pub const fn flag(default: bool) -> Parameter {
    parameter(Rule::Flag, Value::Bool(default), "")
}

pub const fn count(default: Option<u32>, max: u32, unit: &'static str) -> Parameter {
    let default = match default {
        Some(value) => Value::Int(value as i64),
        None => Value::None,
    };
    parameter(Rule::Count { max }, default, unit)
}

/// The size of a map, which is a square where nothing is said.
pub const fn map_size(default: u32, max: u32, unit: &'static str) -> Parameter {
    parameter(Rule::MapSize { max }, Value::Int(default as i64), unit)
}

/// A count that may also be `None`.
pub const fn count_or_none(default: u32, max: u32, unit: &'static str) -> Parameter {
    let mut parameter = count(Some(default), max, unit);
    parameter.may_be_none = true;
    parameter
}

pub const fn number(default: Option<f64>, rule: Rule, unit: &'static str) -> Parameter {
    let default = match default {
        Some(value) => Value::Float(value),
        None => Value::None,
    };
    parameter(rule, default, unit)
}

/// A number that may also be `None`.
pub const fn number_or_none(default: f64, rule: Rule, unit: &'static str) -> Parameter {
    let mut parameter = number(Some(default), rule, unit);
    parameter.may_be_none = true;
    parameter
}

/// A number, one of a few words, or `None`, which is the default.
pub const fn number_or_word(
    rule: Rule,
    words: &'static [&'static str],
    unit: &'static str,
) -> Parameter {
    let Rule::Number { least, max } = rule else {
        panic!("the rule is one of numbers")
    };
    parameter(Rule::NumberOr { least, max, words }, Value::None, unit)
}

pub const fn word(default: &'static str, rule: Rule) -> Parameter {
    parameter(rule, Value::Text(Cow::Borrowed(default)), "")
}

/// One that may be left out.
pub const fn optional(rule: Rule) -> Parameter {
    parameter(rule, Value::None, "")
}

const fn parameter(rule: Rule, default: Value, unit: &'static str) -> Parameter {
    Parameter {
        name: "",
        rule,
        default,
        may_be_none: false,
        unit,
    }
}

/// A value of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    None,
    Bool(bool),
    Int(i64),
    /// Width and height, where they differ.
    Pair([i64; 2]),
    Float(f64),
    Text(Cow<'static, str>),
    Filter(Filter),
    FilteredMap(FilteredMap),
    Array(Array),
    Matrix(DMat4),
    Maps(Arc<[OldMap]>),
    Layers(GivenLayers),
    Matrices(Arc<[DMat4]>),
    Regions(Arc<[Vec<DVec4>]>),
    Functions(WarpFunctions),
    Samples(WarpSamples),
}

impl Parameter {
    pub const fn named(mut self, name: &'static str) -> Self {
        self.name = name;
        self
    }

    pub fn is_optional(&self) -> bool {
        self.may_be_none || self.default == Value::None
    }

    /// The value as the parameter keeps it: an integer as a number where a number is asked for.
    pub fn check(&self, value: Value) -> Result<Value, Fault> {
        match (self.rule, value) {
            (_, Value::None) if self.is_optional() => Ok(Value::None),
            (Rule::Flag, Value::Bool(flag)) => Ok(Value::Bool(flag)),
            (Rule::Count { max }, Value::Int(count)) => {
                Fault::unless((1..=i64::from(max)).contains(&count))?;
                Ok(Value::Int(count))
            }
            (Rule::MapSize { max }, Value::Int(side)) => {
                Fault::unless((1..=i64::from(max)).contains(&side))?;
                Ok(Value::Int(side))
            }
            (Rule::MapSize { max }, Value::Pair([width, height])) => {
                let sides = 1..=i64::from(max);
                Fault::unless(sides.contains(&width) && sides.contains(&height))?;
                Ok(match width == height {
                    true => Value::Int(width),
                    false => Value::Pair([width, height]),
                })
            }
            (Rule::Number { .. }, Value::Int(number)) => self.check(Value::Float(number as f64)),
            (Rule::NumberOr { words, .. }, Value::Text(text)) => {
                Fault::unless(words.contains(&&*text))?;
                Ok(Value::Text(text))
            }
            (Rule::NumberOr { .. }, Value::Int(number)) => self.check(Value::Float(number as f64)),
            (
                Rule::Number { least, max } | Rule::NumberOr { least, max, .. },
                Value::Float(number),
            ) => {
                Fault::unless(number.is_finite() && least.allows(number) && number <= max)?;
                Ok(Value::Float(number))
            }
            (Rule::Choice(known) | Rule::Lookup(known) | Rule::Fit(known), Value::Text(text)) => {
                Fault::unless(known.words().contains(&&*text))?;
                Ok(Value::Text(text))
            }
            (Rule::Lookup(_), filter @ (Value::Filter(_) | Value::FilteredMap(_))) => Ok(filter),
            (Rule::Product(known), Value::Text(text)) => {
                let factors: Vec<_> = text.split('*').map(str::trim).collect();
                if let Some(unknown) = factors.iter().find(|factor| !known.contains(factor)) {
                    return Err(Fault::RangeOf(format!("'{unknown}'")));
                }
                let own = known.iter().copied().filter(|word| factors.contains(word));
                Ok(Value::Text(own.collect::<Vec<_>>().join("*").into()))
            }
            (Rule::Weights, Value::Array(array)) => {
                array.check()?;
                Ok(Value::Array(array))
            }
            (Rule::Matrix, Value::Matrix(matrix)) => {
                Fault::unless(matrix.is_finite())?;
                Ok(Value::Matrix(matrix))
            }
            (Rule::Maps, Value::Maps(maps)) => {
                for map in maps.iter() {
                    map.importance.check()?;
                    Fault::unless(map.map_from_world.is_finite())?;
                }
                Ok(Value::Maps(maps))
            }
            (Rule::Fit(_), Value::Layers(layers)) => Ok(Value::Layers(layers)),
            (Rule::Matrices, Value::Matrices(matrices)) => {
                Fault::unless((1..=MAX_LAYERS).contains(&matrices.len()))?;
                Fault::unless(matrices.iter().all(|matrix| matrix.is_finite()))?;
                Ok(Value::Matrices(matrices))
            }
            (Rule::Regions, Value::Regions(regions)) => {
                for planes in regions.iter() {
                    Fault::unless(planes.len() <= MAX_HALF_SPACES)?;
                    let is_plane =
                        |plane: &DVec4| plane.is_finite() && plane.truncate().length() > 0.0;
                    Fault::unless(planes.iter().all(is_plane))?;
                }
                Ok(Value::Regions(regions))
            }
            (Rule::Functions, Value::Functions(functions)) => {
                functions.check()?;
                Ok(Value::Functions(functions))
            }
            (Rule::Samples, Value::Samples(samples)) => {
                samples.check()?;
                Ok(Value::Samples(samples))
            }
            _ => Err(Fault::Kind),
        }
    }

    /// The error of a value that `check` refused.
    pub fn error(&self, fault: Fault, got: &str) -> Error {
        let (kind, got): (fn(String) -> Error, _) = match fault {
            Fault::Kind => (Error::Type, got.to_string()),
            Fault::Range => (Error::Value, got.to_string()),
            Fault::RangeOf(part) => (Error::Value, part),
        };
        kind(format!("{} must be {self}, got {got}", self.name))
    }
}

/// What a value must be.
impl fmt::Display for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let one_of = |words: &[&str]| format!("'{}'", words.join("', '"));
        match self.rule {
            Rule::Flag => write!(f, "True or False"),
            Rule::Count { max } => write!(f, "a whole number of {} from 1 to {max}", self.unit),
            Rule::MapSize { max } => write!(
                f,
                "a whole number of {} from 1 to {max}, or (width, height) of such numbers",
                self.unit
            ),
            Rule::Number { least, max } => write!(f, "{}", rule_of_numbers(least, max)),
            Rule::NumberOr { least, max, words } => {
                write!(f, "{} or {}", rule_of_numbers(least, max), one_of(words))
            }
            Rule::Choice(known) => write!(f, "one of {}", one_of(&known.words())),
            Rule::Lookup(known) => write!(
                f,
                "one of {} or a lixel.Pcf, Variance, ExponentialVariance or Moments",
                one_of(&known.words())
            ),
            Rule::Product(known) => write!(f, "a product of {}", one_of(known)),
            Rule::Weights => write!(f, "an array (h, w) of finite numbers, at least 0"),
            Rule::Matrix => write!(f, "a frame or a finite matrix of shape (4, 4)"),
            Rule::Maps => write!(f, "a frame with finite maps and matrices"),
            Rule::Fit(known) => {
                write!(
                    f,
                    "one of {} or a lixel.LightMatrix",
                    one_of(&known.words())
                )
            }
            Rule::Matrices => write!(
                f,
                "a finite matrix of shape (4, 4), or (layers, 4, 4) for up to {MAX_LAYERS} layers"
            ),
            Rule::Regions => write!(
                f,
                "for each layer up to {MAX_HALF_SPACES} finite planes (a, b, c, d), a, b, c not all 0"
            ),
            Rule::Functions => write!(
                f,
                "an array (2, n, cells + 1), or (layers, 2, n, cells + 1), that runs from 0 to 1 and nowhere falls along \
                 its last axis, with n functions along x and n along y, at most as many as cells, which are at most \
                 {MAX_CELLS}"
            ),
            Rule::Samples => write!(
                f,
                "an array (h, w, 2), or (layers, h, w, 2), of places (x, y) from 0 to 1, h and w from 2 to \
                 {MAX_SAMPLES}, that is neither folded nor torn"
            ),
        }?;
        if self.is_optional() {
            write!(f, " or None")?;
        }
        Ok(())
    }
}

/// A parameter, or those of a group that methods share.
pub enum Entry {
    One(Parameter),
    Group(Entries),
}

pub type Entries = &'static [Entry];

/// The parameters of a method.
#[derive(Clone, Copy)]
pub struct Schema {
    pub name: &'static str,
    pub entries: Entries,
}

/// A struct whose fields are parameters; [`parameters`] declares one.
pub trait ParameterGroup: Sized {
    const ENTRIES: Entries;

    /// The values obey their rules.
    fn from_parameters(parameters: &Parameters) -> Self;

    /// With the default of every parameter.
    fn defaults() -> Self {
        let (name, entries) = ("", Self::ENTRIES);
        Self::from_parameters(&Schema { name, entries }.defaults())
    }
}

/// Declares a struct of parameters. A field is the parameter of its name: its default, rule and unit follow the `=`.
/// `choice(WORDS, "default")` is what one of the words stands for. A field without `=` is a group of parameters.
macro_rules! parameters {
    (
        $(#[$of_struct:meta])*
        pub struct $name:ident {
            $($(#[$of_field:meta])* pub $field:ident: $type:ty $(= $kind:ident $(($($argument:tt)*))?)?,)*
        }
    ) => {
        $(#[$of_struct])*
        #[derive(Debug, Clone)]
        pub struct $name {
            $($(#[$of_field])* pub $field: $type,)*
        }

        impl $crate::methods::schema::ParameterGroup for $name {
            const ENTRIES: $crate::methods::schema::Entries =
                &[$(parameters!(@entry $field $type $(= $kind $(($($argument)*))?)?),)*];

            fn from_parameters(_values: &$crate::methods::schema::Parameters) -> Self {
                Self {
                    $($field: parameters!(@value _values $field $type $(= $kind $(($($argument)*))?)?),)*
                }
            }
        }
    };
    (@entry $field:ident $type:ty) => {
        $crate::methods::schema::Entry::Group(<$type>::ENTRIES)
    };
    (@entry $field:ident $type:ty = choice($words:ident, $default:literal)) => {
        parameters!(@entry $field $type = word($default, Rule::Choice(&$words)))
    };
    (@entry $field:ident $type:ty = $declared:expr) => {
        $crate::methods::schema::Entry::One($declared.named(stringify!($field)))
    };
    (@value $values:ident $field:ident $type:ty) => {
        <$type>::from_parameters($values)
    };
    (@value $values:ident $field:ident $type:ty = choice($words:ident, $default:literal)) => {
        $values.choice(stringify!($field), $words)
    };
    (@value $values:ident $field:ident $type:ty = $declared:expr) => {
        $values.get(stringify!($field))
    };
}
pub(crate) use parameters;

impl Schema {
    pub fn parameters(self) -> impl Iterator<Item = &'static Parameter> {
        fn all(entries: Entries) -> Vec<&'static Parameter> {
            let all = entries.iter().flat_map(|entry| match entry {
                Entry::One(parameter) => vec![parameter],
                Entry::Group(entries) => all(entries),
            });
            all.collect()
        }
        all(self.entries).into_iter()
    }

    pub fn parameter(self, name: &str) -> Result<&'static Parameter> {
        let mut all = self.parameters();
        all.find(|parameter| parameter.name == name).ok_or_else(|| {
            let known: Vec<_> = self.parameters().map(|parameter| parameter.name).collect();
            let (method, known) = (self.name, known.join(", "));
            Error::Value(format!(
                "'{method}' has the parameters {known}, got '{name}'"
            ))
        })
    }

    pub fn defaults(self) -> Parameters {
        let all = self.parameters();
        Parameters(
            all.map(|known| (known.name, known.default.clone()))
                .collect(),
        )
    }
}

/// A value for each parameter of a schema, by its rule.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameters(BTreeMap<&'static str, Value>);

impl Parameters {
    /// `value` is one that `parameter` checked.
    pub fn set(&mut self, parameter: &Parameter, value: Value) {
        self.0.insert(parameter.name, value);
    }

    pub fn value(&self, name: &str) -> &Value {
        &self.0[name]
    }

    /// Whether there is a parameter of that name with that word.
    pub fn says(&self, name: &str, word: &str) -> bool {
        matches!(self.0.get(name), Some(Value::Text(text)) if text == word)
    }

    pub fn get<T: Typed>(&self, name: &str) -> T {
        T::typed(self.value(name))
    }

    /// What the parameter's word stands for.
    pub fn choice<T: Copy>(&self, name: &str, choices: Choices<T>) -> T {
        chosen(&self.get::<Cow<str>>(name), choices)
    }
}

/// What a word stands for, which is one of them.
pub fn chosen<T: Copy>(word: &str, choices: Choices<T>) -> T {
    let chosen = choices.iter().find(|(known, _)| *known == word);
    chosen.expect("the rule has passed").1
}

/// What a value becomes once its rule has passed.
pub trait Typed: Sized {
    fn typed(value: &Value) -> Self;
}

macro_rules! typed {
    ($($type:ty: $($pattern:pat => $value:expr),+;)+) => {
        $(impl Typed for $type {
            fn typed(value: &Value) -> Self {
                match value {
                    $($pattern => $value,)+
                    other => unreachable!("{other:?} has passed the rule of another kind"),
                }
            }
        })+
    };
}

typed! {
    bool: Value::Bool(value) => *value;
    u32: Value::Int(value) => *value as u32;
    f64: Value::Float(value) => *value;
    MapSize:
        Value::Int(side) => MapSize::square(*side as u32),
        Value::Pair([width, height]) => MapSize {
            width: *width as u32,
            height: *height as u32,
        };
    Cow<'static, str>: Value::Text(value) => value.clone();
    Array: Value::Array(value) => value.clone();
    DMat4: Value::Matrix(value) => *value;
    Arc<[OldMap]>: Value::Maps(value) => value.clone(), Value::None => Arc::default();
    Arc<[DMat4]>: Value::Matrices(value) => value.clone(), Value::None => Arc::default();
    Arc<[Vec<DVec4>]>: Value::Regions(value) => value.clone();
    WarpFunctions: Value::Functions(value) => value.clone();
    WarpSamples: Value::Samples(value) => value.clone();
}

impl<T: Typed> Typed for Option<T> {
    fn typed(value: &Value) -> Self {
        (*value != Value::None).then(|| T::typed(value))
    }
}
