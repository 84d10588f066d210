//! A frame in the making on the CPU: what the camera sees, and what a method asks of it.

use super::rasterize::{Image, rasterize};
use super::shadow_rays::shadow_rays;
use super::tiles::{TILE, TILE_PIXELS, Tiling};
use super::view::View;
use super::{exact, lanes, processor};
use crate::bvh::Bvh;
use crate::camera::Camera;
use crate::error::{Result, ensure_value};
use crate::light::Light;
use crate::lock::Kept;
use crate::scene::Scene;
use std::sync::Arc;
use std::time::Instant;

pub const VISIBILITY_LABEL: &str = "visibility";
pub const CASTER_TESTS_LABEL: &str = "caster tests";
pub const HIERARCHY_LABEL: &str = "hierarchy (CPU)";
pub const SHADOW_RAYS_LABEL: &str = "shadow rays";

/// The keys of a frame's timers: those of the GPU engine where a pass does the same.
pub const LABELS: &[&str] = &[
    VISIBILITY_LABEL,
    CASTER_TESTS_LABEL,
    HIERARCHY_LABEL,
    SHADOW_RAYS_LABEL,
];

/// Pixels of an image, its tiles filled up, at most: 12 bytes of each are in memory.
const MAX_PIXELS: usize = 1 << 28;

/// What is kept between frames of one scene.
#[derive(Default)]
pub struct KeptParts {
    seen: Kept<Seen>,
    hierarchy: Kept<Hierarchy>,
}

/// What the last camera sees.
struct Seen {
    generation: u64,
    camera: Camera,
    image: Image,
}

/// What finds the triangles near a ray.
pub struct Hierarchy {
    generation: u64,
    pub bvh: Bvh,
}

impl KeptParts {
    /// The scene's hierarchy, built at first use and after the vertices moved, and whether it was built now.
    pub fn hierarchy(&self, scene: &Scene) -> Result<(Arc<Hierarchy>, bool)> {
        let generation = scene.generation();
        let holds = |known: &Hierarchy| known.generation == generation;
        self.hierarchy.get(holds, |_| {
            let bvh = Bvh::new(scene);
            Ok(Hierarchy { generation, bvh })
        })
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
    scene: &'a Scene,
    camera: &'a Camera,
    light: &'a Light,
    kept: &'a KeptParts,
    seen: Arc<Seen>,
    /// Milliseconds of each pass.
    pub timings: Vec<(&'static str, f64)>,
    /// What passes counted: label, name and number.
    pub counts: Vec<(&'static str, &'static str, u64)>,
    /// Passes that this frame did not need.
    pub skipped: Vec<&'static str>,
}

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
            timings: Vec::new(),
            counts: Vec::new(),
            skipped: Vec::new(),
        };
        frame.add_kept(VISIBILITY_LABEL, start, is_new);
        Ok(frame)
    }

    /// Of each pixel the triangle that it shows, row by row; -1 where there is none.
    pub fn triangle_ids(&self) -> Vec<i32> {
        let Image { tiling, triangles } = &self.seen.image;
        let mut ids = Vec::with_capacity(tiling.width * tiling.height);
        for y in 0..tiling.height {
            for x in (0..tiling.width).step_by(TILE) {
                let first = tiling.index(x, y);
                let of_tile = &triangles[first..first + TILE.min(tiling.width - x)];
                ids.extend(of_tile.iter().map(|&id| id as i32));
            }
        }
        ids
    }

    /// The visibility image by testing every receiver against the triangles in its cell of the light's grid.
    pub fn exact(&mut self) -> Vec<f32> {
        let start = Instant::now();
        let visibility = exact::exact(self.scene, &self.seen.image, self.camera, self.light);
        self.add_time(CASTER_TESTS_LABEL, start);
        visibility
    }

    /// The visibility image by rays through the scene's hierarchy, which is built where it is missing.
    pub fn shadow_rays(&mut self) -> Result<Vec<f32>> {
        let start = Instant::now();
        let (hierarchy, is_new) = self.kept.hierarchy(self.scene)?;
        self.add_kept(HIERARCHY_LABEL, start, is_new);
        let start = Instant::now();
        let (scene, image, camera, light) = (self.scene, &self.seen.image, self.camera, self.light);
        let (visibility, rays) = shadow_rays(scene, image, camera, light, &hierarchy.bvh);
        self.add_time(SHADOW_RAYS_LABEL, start);
        self.counts.push((SHADOW_RAYS_LABEL, "rays", rays));
        Ok(visibility)
    }

    fn add_time(&mut self, label: &'static str, start: Instant) {
        self.timings
            .push((label, start.elapsed().as_secs_f64() * 1e3));
    }

    fn add_kept(&mut self, label: &'static str, start: Instant, is_new: bool) {
        match is_new {
            true => self.add_time(label, start),
            false => self.skipped.push(label),
        }
    }
}

fn check_image(camera: &Camera) -> Result<()> {
    let (width, height) = (camera.width as usize, camera.height as usize);
    let pixels = Tiling::new(width, height)
        .tiles()
        .saturating_mul(TILE_PIXELS);
    ensure_value!(
        pixels <= MAX_PIXELS,
        "image size must not exceed {MAX_PIXELS} pixels on the CPU engine, each side a multiple of {TILE}, got \
         width {width} and height {height}"
    );
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
        lanes: lanes::level_name(),
        threads: rayon::current_num_threads(),
    }
}
