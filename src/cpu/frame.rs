//! A frame in the making on the CPU: what the camera sees, and what a method asks of it.

use super::filtered_texels::FilteredTexels;
use super::importance_map::{PlacedReceivers, Words};
use super::light_grids::Grids;
use super::map::Map;
use super::pages::kept::KeptPages;
use super::processor;
use super::rasterize::{Image, rasterize};
use super::receivers::Receivers;
use super::tiles::{TILE, TILE_PIXELS, Tiling};
use super::view::View;
use super::warp_map::CpuWarp;
use crate::bvh::Bvh;
use crate::camera::Camera;
use crate::edges::Edges;
use crate::error::{Error, Result, ensure_value};
use crate::instructions::level_name;
use crate::light::Light;
use crate::lock::Kept;
use crate::paging::PagedMaps;
use crate::projection::Projection;
use crate::scene::Scene;
use crate::stats::{Fact, Stats};
use crate::verbs::WarpedLayer;
use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

pub const VISIBILITY_LABEL: &str = "visibility";
pub const LIGHT_GRID_LABEL: &str = "light grid";
pub const CASTER_TESTS_LABEL: &str = "caster tests";
pub const HIERARCHY_LABEL: &str = "hierarchy (CPU)";
pub const SHADOW_RAYS_LABEL: &str = "shadow rays";
pub const RECEIVERS_LABEL: &str = "receivers";
pub const RECEIVER_TILES_LABEL: &str = "receiver tiles";
pub const OUTLINE_LABEL: &str = "outline";
pub const PAGE_REQUESTS_LABEL: &str = "page requests";
pub const SAMPLES_LABEL: &str = "samples";
pub const BOUNDARY_LABEL: &str = "boundary";
pub const SHADOW_MAP_LABEL: &str = "shadow map";
pub const SHADOW_EDGE_LABEL: &str = "shadow edge";
pub const IMPORTANCE_LABEL: &str = "importance map";
pub const FORWARD_LABEL: &str = "forward importance";
pub const BLEND_LABEL: &str = "blend importance";
pub const WARP_LABEL: &str = "warp map";
pub const LOOKUP_LABEL: &str = "lookup";
pub const MOMENTS_LABEL: &str = "moments";
pub const EDGES_LABEL: &str = "edges (CPU)";
pub const SHADOW_VOLUMES_LABEL: &str = "shadow volumes";

/// The keys of a frame's timers: those of the GPU engine where a pass does the same.
pub const LABELS: &[&str] = &[
    VISIBILITY_LABEL,
    LIGHT_GRID_LABEL,
    CASTER_TESTS_LABEL,
    HIERARCHY_LABEL,
    SHADOW_RAYS_LABEL,
    RECEIVERS_LABEL,
    OUTLINE_LABEL,
    PAGE_REQUESTS_LABEL,
    SAMPLES_LABEL,
    BOUNDARY_LABEL,
    SHADOW_MAP_LABEL,
    SHADOW_EDGE_LABEL,
    IMPORTANCE_LABEL,
    FORWARD_LABEL,
    BLEND_LABEL,
    WARP_LABEL,
    RECEIVER_TILES_LABEL,
    MOMENTS_LABEL,
    LOOKUP_LABEL,
    EDGES_LABEL,
    SHADOW_VOLUMES_LABEL,
];

/// Pixels of an image, its tiles filled up, at most: 12 bytes of each are in memory.
const MAX_PIXELS: usize = 1 << 28;

/// What one takes: the nearest triangle, its depth, and as much for what is made of both.
const BYTES_OF_PIXEL: usize = 16;

/// What is kept between frames of one scene.
#[derive(Default)]
pub struct KeptParts {
    seen: Kept<Seen>,
    hierarchy: Kept<OfVertices<Bvh>>,
    edges: Kept<OfVertices<Edges>>,
    /// Those of the last light.
    pub(super) grids: Kept<Grids>,
    /// Those of the last maps that held still.
    pub(super) pages: Kept<KeptPages>,
}

/// What the last camera sees.
pub(super) struct Seen {
    generation: u64,
    camera: Camera,
    pub image: Image,
}

/// What was made of the vertices as they were.
pub struct OfVertices<T> {
    generation: u64,
    pub made: T,
}

impl<T> Kept<OfVertices<T>> {
    /// Made at first use and after the vertices moved; and whether it was made now.
    fn of_vertices(
        &self,
        scene: &Scene,
        make: impl FnOnce(&Scene) -> T,
    ) -> Result<(Arc<OfVertices<T>>, bool)> {
        let generation = scene.generation();
        let holds = |known: &OfVertices<T>| known.generation == generation;
        self.get(holds, |_| {
            let made = make(scene);
            Ok(OfVertices { generation, made })
        })
    }
}

impl KeptParts {
    /// What silhouettes are found on, and whether it was made now.
    pub fn edges(&self, scene: &Scene) -> Result<(Arc<OfVertices<Edges>>, bool)> {
        self.edges.of_vertices(scene, Edges::new)
    }

    /// What finds the triangles near a ray, and whether it was built now.
    pub fn hierarchy(&self, scene: &Scene) -> Result<(Arc<OfVertices<Bvh>>, bool)> {
        self.hierarchy.of_vertices(scene, Bvh::new)
    }

    /// What the camera sees, and whether it was drawn now.
    fn seen(&self, scene: &Scene, camera: &Camera, culls: bool) -> Result<(Arc<Seen>, bool)> {
        let generation = scene.generation();
        let holds =
            |known: &Seen| culls && known.generation == generation && known.camera == *camera;
        self.seen.get(holds, |_| {
            Ok(Seen {
                generation,
                camera: camera.clone(),
                image: rasterize(&View::of_camera(camera), scene),
            })
        })
    }
}

/// The scene, the camera and a light, and what was made of them so far.
pub struct Frame<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub light: &'a Light,
    pub(super) kept: &'a KeptParts,
    pub(super) seen: Arc<Seen>,
    /// The last samples' image.
    pub(super) sampled: Option<Image>,
    /// The receivers that were counted last, along x.
    pub(super) placed: Option<PlacedReceivers>,
    /// Whether what cannot change a picture is left out; `false` is for the proof that it cannot.
    pub(super) culls: bool,
    /// Whether somebody wants to see maps.
    draws_whole_maps: bool,
    /// Milliseconds of each pass.
    pub timings: Vec<(&'static str, f64)>,
    pub stats: Stats,
}

/// What a method answered: 1 lit, 0 in shadow, in between with a filter, NaN where nothing is seen, row by row; and the
/// layers that it was looked up in.
pub struct Recorded {
    pub visibility: Vec<f32>,
    pub layers: Vec<DrawnLayer>,
    /// Where the layers are levels of maps in pages.
    pub pages: Option<PagedMaps>,
}

/// A layer that has texels.
pub struct DrawnLayer {
    pub plan: PlannedLayer,
    pub map: Arc<Map>,
    pub moments: Option<FilteredTexels>,
}

/// A layer before it has texels.
pub type PlannedLayer = WarpedLayer<CpuWarp, Words>;

impl<'a> Frame<'a> {
    /// Draws what the camera sees, unless it is known. With `culls` what is known is taken.
    pub fn new(
        scene: &'a Scene,
        camera: &'a Camera,
        light: &'a Light,
        kept: &'a KeptParts,
        culls: bool,
    ) -> Result<Self> {
        check_image(camera)?;
        let start = Instant::now();
        let (seen, is_new) = kept.seen(scene, camera, culls)?;
        let mut frame = Self {
            scene,
            camera,
            light,
            kept,
            seen,
            sampled: None,
            placed: None,
            culls,
            draws_whole_maps: false,
            timings: Vec::new(),
            stats: Stats::new(scene),
        };
        frame.add_kept(VISIBILITY_LABEL, start, is_new);
        Ok(frame)
    }

    /// With maps that somebody wants to see.
    pub fn with_whole_maps(self, draws_whole_maps: bool) -> Self {
        Self {
            draws_whole_maps,
            ..self
        }
    }

    /// Whether what nobody looks at is left out of maps.
    pub(super) fn draws_parts_of_maps(&self) -> bool {
        self.culls && !self.draws_whole_maps
    }

    /// What the camera sees.
    pub fn image(&self) -> &Image {
        &self.seen.image
    }

    /// What the camera sees, and the light may reach.
    pub(super) fn receivers(&self) -> Receivers<'_> {
        Receivers::new(self.scene, self.image(), self.camera, self.light)
    }

    /// What the work makes of the frame, timed.
    pub(super) fn timed<R>(&mut self, label: &'static str, work: impl FnOnce(&Self) -> R) -> R {
        let start = Instant::now();
        let made = work(self);
        self.add_time(label, start);
        made
    }

    fn add_time(&mut self, label: &'static str, start: Instant) {
        self.add_milliseconds(label, start.elapsed().as_secs_f64() * 1e3);
    }

    /// Those of a pass that is carried out again add up.
    pub(super) fn add_milliseconds(&mut self, label: &'static str, milliseconds: f64) {
        match self.timings.iter_mut().find(|(known, _)| *known == label) {
            Some((_, time)) => *time += milliseconds,
            None => self.timings.push((label, milliseconds)),
        }
    }

    pub(super) fn add_kept(&mut self, label: &'static str, start: Instant, is_new: bool) {
        match is_new {
            true => self.add_time(label, start),
            false => self.stats.skipped.push(label),
        }
    }

    /// Adds a number that a pass counted.
    pub(super) fn count(&mut self, label: &'static str, name: &'static str, count: u64) {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        self.stats.facts.add(label, vec![Fact::sum(name, count)]);
    }
}

pub(super) fn check_image(camera: &Camera) -> Result<()> {
    check_size("image size", [camera.width, camera.height])
}

/// Refuses a map that is beyond memory.
pub(super) fn check_map(projection: &Projection) -> Result<()> {
    check_map_of(projection, BYTES_OF_PIXEL)
}

/// The same where its texels take so many bytes more.
pub(super) fn check_map_of(projection: &Projection, bytes: usize) -> Result<()> {
    check_size_of("resolution", [projection.width, projection.height], bytes)
}

/// The same of so many pages.
pub(super) fn check_pages(count: usize, page_size: u32) -> Result<()> {
    // As many texels as a map that is a page wide.
    let height = u32::try_from(count * page_size as usize).unwrap_or(u32::MAX);
    check_size("the size of all pages", [page_size, height])
}

fn check_size(name: &str, size: [u32; 2]) -> Result<()> {
    check_size_of(name, size, BYTES_OF_PIXEL)
}

fn check_size_of(name: &str, [width, height]: [u32; 2], bytes_of_pixel: usize) -> Result<()> {
    let tiling = Tiling::new(width as usize, height as usize);
    let pixels = tiling.tiles().saturating_mul(TILE_PIXELS);
    ensure_value!(
        pixels <= MAX_PIXELS,
        "{name} must not exceed {MAX_PIXELS} pixels on the CPU engine, each side a multiple of {TILE}, got \
         width {width} and height {height}"
    );
    // An allocation that fails ends the process, so it is tried here.
    let bytes = pixels * bytes_of_pixel;
    let mut memory = Vec::<u8>::new();
    if black_box(&mut memory).try_reserve_exact(bytes).is_err() {
        return Err(Error::Device(format!(
            "{name} {width} x {height} needs {bytes} bytes of memory, more than there are now"
        )));
    }
    Ok(())
}

/// The engine: processor, instructions and threads.
#[derive(Debug, Clone, PartialEq)]
pub struct Description {
    pub processor: &'static str,
    pub lanes: &'static str,
    pub threads: usize,
}

pub fn description() -> Description {
    Description {
        processor: processor::name(),
        lanes: level_name(),
        threads: rayon::current_num_threads(),
    }
}
