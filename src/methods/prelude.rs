//! What nearly every method names.

pub(crate) use super::method::{ShadowMethod, mapped_shadows};
pub(crate) use super::parameters::{
    FitParameters, MARGIN, MapParameters, ROTATION, SAMPLE_RESOLUTION, SNAP, position_of,
};
pub(crate) use super::schema::{
    Choices, FRACTION, NON_NEGATIVE, ParameterGroup, Rule, count, flag, number, optional,
    parameters, word,
};
pub(crate) use crate::error::{Error, Result, ensure_value};
pub(crate) use crate::fits::boxes::{Cut, Turn, cut_layers, fit_boxes};
pub(crate) use crate::fits::layer::Layer;
pub(crate) use crate::fits::receivers::ReceiverQueries;
pub(crate) use crate::map_size::MapSize;
pub(crate) use crate::verbs::{FitQueries, LayerOf, Verbs};
