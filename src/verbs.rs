//! What a method asks of a frame in the making. Each engine answers in its own way; a method is written once.

use crate::error::{Error, Result};
use crate::fits::layer::Layer;
use crate::fits::receivers::ReceiverQueries;
use crate::fits::samples::SampledReceivers;
use crate::importance::{EdgeBias, Factors, Grid, Importance, ImportanceMap, OldImportance};
use crate::map_settings::MapSettings;
use crate::map_size::MapSize;
use crate::paging::Paging;
use crate::warp::tables::Table;
use crate::warp::{Axis, CountFit, Warp};

/// Who searches for the triangles that a ray may meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Traversal {
    /// Ray queries on a GPU that has them, else compute.
    Auto,
    Compute,
    Hardware,
}

impl Traversal {
    /// What is said where there is no hardware for it.
    pub fn is_missing(self, reason: &str) -> Error {
        Error::Device(format!(
            "traversal='hardware' cannot be: {reason}; take traversal='compute' or 'auto'"
        ))
    }
}

/// What a fit asks and tells, whichever engine renders.
pub trait FitQueries<'a>: ReceiverQueries<'a> {
    /// What maps without a warp answer for samples of the image, in their order: 1 lit, 0 in shadow.
    fn sampled_visibility(
        &mut self,
        samples: &SampledReceivers,
        map: MapSettings,
        layers: Vec<Layer>,
    ) -> Result<Vec<f32>>;

    /// Names a stage that this frame does not need.
    fn skip(&mut self, stage: &'static str);

    /// Adds a number that the method found to the statistics, by its name.
    fn measure(&mut self, name: &'static str, value: f64);

    /// Adds to a timer what the method itself took.
    fn add_time(&mut self, label: &'static str, milliseconds: f64);
}

/// A layer and its warp, before it has texels.
pub struct WarpedLayer<Warp, Values> {
    pub layer: Layer,
    pub warp: Option<Warp>,
    /// What the warp was made from.
    pub importance: Option<ImportanceMap<Values>>,
}

impl<Warp, Values> From<Layer> for WarpedLayer<Warp, Values> {
    fn from(layer: Layer) -> Self {
        Self {
            layer,
            warp: None,
            importance: None,
        }
    }
}

/// The layers of an engine.
pub type LayerOf<'a, V> = WarpedLayer<<V as Verbs<'a>>::Warp, <V as Verbs<'a>>::Values>;

/// The passes, bound to the scene, camera and light.
pub trait Verbs<'a>: FitQueries<'a> + Sized {
    /// What a method gives back: the visibility image and the layers it was looked up in.
    type Recorded;
    /// Functions along both axes of a map, or a table.
    type Warp;
    /// Numbers in the engine's memory.
    type Values;
    /// What the light sees of a layer.
    type Analysed;

    /// The last two steps of every method with maps: casters into each layer, receivers against it. Without a layer
    /// nothing is lit.
    fn shadows(
        &mut self,
        map: MapSettings,
        layers: Vec<LayerOf<'a, Self>>,
    ) -> Result<Self::Recorded>;

    /// The same of maps in pages: each receiver asks for those of the level that matches its pixel, and only these are drawn.
    /// A map's resolution is that of its finest level.
    fn paged_shadows(
        &mut self,
        map: MapSettings,
        maps: Vec<Layer>,
        paging: Paging,
    ) -> Result<Self::Recorded>;

    /// Receivers that face the light in all layers, once their bounds were asked for.
    fn facing_count(&self) -> u32;

    /// Shadows without an error. An engine that lists receivers in the texels of layers asks for these.
    fn exact(
        &mut self,
        layers: impl FnOnce(&mut Self) -> Result<Vec<LayerOf<'a, Self>>>,
    ) -> Result<Self::Recorded>;

    /// Shadows by rays through a hierarchy of boxes.
    fn shadow_rays(&mut self, traversal: Traversal) -> Result<Self::Recorded>;

    fn shadow_volumes(&mut self) -> Result<Self::Recorded>;

    /// Weights that a user gave, named for errors.
    fn weights(&mut self, what: &str, values: &[f32], size: [u32; 2])
    -> Result<Grid<Self::Values>>;

    /// Weights of the receivers near the boundaries of the shadows that maps without a warp answer: `weight` there, 1
    /// elsewhere.
    fn boundary(
        &mut self,
        map: MapSettings,
        layers: Vec<Layer>,
        weight: f64,
    ) -> Result<Grid<Self::Values>>;

    fn depth_image(&mut self, layer: Layer) -> Result<Self::Analysed>;

    /// The shadow edges of what the light sees: 1 where a depth differs from a neighbour's by more than the bias, else
    /// `floor`.
    fn shadow_edges(
        &mut self,
        analysed: &Self::Analysed,
        bias: EdgeBias,
        floor: f64,
    ) -> Result<Grid<Self::Values>>;

    /// The importance of the cells of a layer's map, from the receivers.
    fn importance_map(
        &mut self,
        layer: &Layer,
        cells: u32,
        importance: Importance,
        factors: Factors<Self::Values>,
        warp: Option<&Self::Warp>,
    ) -> Result<ImportanceMap<Self::Values>>;

    /// The same from what the light sees.
    fn forward_importance(
        &mut self,
        analysed: &Self::Analysed,
        cells: u32,
        factors: Factors<Self::Values>,
    ) -> Result<ImportanceMap<Self::Values>>;

    /// Blends in that of the frame before; see `blend_importance`.
    fn blend_importance(
        &mut self,
        importance: &mut ImportanceMap<Self::Values>,
        old: OldImportance,
        warp: Option<&Self::Warp>,
    ) -> Result<()>;

    /// Room for functions of so many cells along each axis of a map of so many texels.
    fn warp(&mut self, functions: u32, cells: u32, size: MapSize) -> Result<Self::Warp>;

    /// The functions along one axis from counts of receivers (Milet et al.).
    fn fit_counts(
        &mut self,
        warp: &mut Self::Warp,
        axis: Axis,
        size: MapSize,
        counts: &ImportanceMap<Self::Values>,
        fit: CountFit,
    ) -> Result<()>;

    /// The function along one axis from the maxima of an importance map (Rosen), blurred by a Gaussian of `sigma` cells.
    fn fit_maxima(
        &mut self,
        warp: &mut Self::Warp,
        axis: Axis,
        size: MapSize,
        importance: &ImportanceMap<Self::Values>,
        sigma: f64,
    ) -> Result<()>;

    /// Functions as somebody gives them: their values along x, then along y.
    fn set_functions(&mut self, warp: &mut Self::Warp, values: &[f32]);

    /// A warp by a table of samples, finished.
    fn sampled_warp(&mut self, table: &Table, size: MapSize) -> Result<Self::Warp>;

    /// What the cells of an importance map hold, by the engine's own words: their bits.
    fn read_importance(&mut self, importance: &ImportanceMap<Self::Values>) -> Result<Vec<u32>>;

    /// The functions of a warp, whether it is finished or not.
    fn read_functions(&mut self, warp: &Self::Warp) -> Result<Warp>;

    /// Inverses, once the functions along both axes are there.
    fn finish_warp(&mut self, warp: &mut Self::Warp, size: MapSize);
}
