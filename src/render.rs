//! Rendering a frame: from scene, camera, light and method to arrays.

mod outputs;

pub use outputs::{Output, Outputs};

use crate::aliasing::{self, RenderedLayer};
use crate::camera::Camera;
use crate::cpu;
use crate::engine::Engine;
use crate::error::{Error, Result};
use crate::fits::layer::Layer;
use crate::fits::receivers::Setting;
use crate::fits::uniform::uniform_along;
use crate::gpu::passes::importance_map::ImportanceMap;
use crate::gpu::passes::packed_image::ImageRead;
use crate::gpu::passes::warp_map::Layout;
use crate::gpu::passes::{inputs::Receivers, shadow_map, visibility};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{Read, ReadResults, Recording, Source, Timings};
use crate::gpu::scene_tables::{LightSides, Room, SceneTables};
use crate::gpu::unsure;
use crate::gpu::view::{PlannedLayer, RasterizedLayer, Recorded, RecordedPages, View};
use crate::gpu::{AdapterDescription, Gpu};
use crate::light::Light;
use crate::lock::lock;
use crate::methods::Method;
use crate::occlusion;
use crate::paging::{NO_LAYER, PagedMaps};
use crate::region::Region;
use crate::scene::Scene;
use crate::sides;
use crate::stats::{Fact, Stats};
use crate::warp::Warping;
use glam::DVec2;
use std::sync::{Arc, Mutex};
use std::time::Instant;

/// A rendered frame.
#[derive(Default)]
pub struct Rendered {
    /// Per pixel: 1 lit, 0 in shadow, NaN where no surface is seen.
    pub visibility: Vec<f32>,
    /// Per pixel, -1 where no surface is seen; empty unless it is read back.
    pub triangle_id: Vec<i32>,
    /// Depths in [0, 1] per texel, layer after layer; empty unless asked for.
    pub shadow_map: Vec<f32>,
    /// (rows, columns, values) of each layer that has one; empty unless asked for.
    pub importance_maps: Vec<(usize, usize, Vec<f32>)>,
    pub layers: Vec<RenderedLayer>,
    /// Where the layers are levels of maps in pages.
    pub pages: Option<PagedMaps>,
    /// Each `None` unless asked for.
    pub aliasing_error: Option<Vec<f32>>,
    pub largest_aliasing_error: Option<f64>,
    pub max_effective_resolution: Option<DVec2>,
    pub timings: Timings,
    pub stats: Stats,
    pub adapter: AdapterDescription,
}

impl Rendered {
    /// How coarse the map is where the camera looks, as far as it is asked for.
    fn measure(&mut self, scene: &Scene, camera: &Camera, light: &Light, outputs: Outputs) {
        let layers = &self.layers;
        let asks = |output| outputs.has(output).then_some(());
        if layers.is_empty() {
            // There is no map to measure.
            let pixels = camera.pixel_count();
            self.aliasing_error = asks(Output::AliasingError).map(|()| vec![f32::NAN; pixels]);
            self.largest_aliasing_error = asks(Output::LargestAliasingError).map(|()| f64::NAN);
        } else if outputs.has_any(&[Output::AliasingError, Output::LargestAliasingError]) {
            let pages = self.pages.as_ref();
            let layer_of_pixel = pages.map(|pages| &pages.layer_of_pixel[..]);
            let view = (scene, camera, light);
            let (errors, depths) =
                aliasing::aliasing_error(view, (layers, layer_of_pixel), &self.triangle_id);
            self.aliasing_error = asks(Output::AliasingError).map(|()| errors);
            // What a map holds where nobody looks at it is not known of pages.
            let layers = if pages.is_some() { &[] } else { &layers[..] };
            self.largest_aliasing_error = asks(Output::LargestAliasingError)
                .map(|()| aliasing::largest_aliasing_error(camera, layers, depths));
        }
        let setting = Setting {
            scene,
            camera,
            light,
        };
        let one_texel = |map: &_| uniform_along(setting, map);
        self.max_effective_resolution = asks(Output::MaxEffectiveResolution)
            .map(|()| aliasing::max_effective_resolution(one_texel, layers));
    }
}

/// What stays between frames of one scene, of each engine.
#[derive(Default)]
pub struct SceneCache {
    gpu: Mutex<Option<DeviceScene>>,
    pub cpu: cpu::KeptParts,
}

struct DeviceScene {
    gpu: Arc<Gpu>,
    tables: SceneTables,
    /// The last camera's visibility buffer.
    visibility: Option<(Camera, PooledBuffer)>,
}

impl Drop for DeviceScene {
    fn drop(&mut self) {
        // They may hold on to its tables.
        self.gpu.forget_bind_groups();
    }
}

impl DeviceScene {
    /// The scene's own device copy, made or brought up to date.
    fn prepare<'a>(
        cached: &'a mut Option<Self>,
        gpu: &Arc<Gpu>,
        scene: &Scene,
    ) -> Result<&'a mut Self> {
        if !cached
            .as_ref()
            .is_some_and(|known| Arc::ptr_eq(&known.gpu, gpu))
        {
            *cached = Some(Self {
                gpu: gpu.clone(),
                tables: SceneTables::new(gpu, scene)?,
                visibility: None,
            });
        }
        let device_scene = cached.as_mut().expect("just made");
        if device_scene.tables.generation != scene.generation() {
            device_scene.visibility = None;
            device_scene.tables.update(gpu, scene)?;
        }
        Ok(device_scene)
    }
}

/// Frames that are better not recorded side by side in greater number: they are in memory at once.
pub const MAX_TOGETHER: usize = 4;

/// Renders the shadows of each light: what the camera sees is found once, and what the lights submit goes
/// to the device together. The second call with the same scene and camera starts at the receivers.
pub fn render(
    engine: &Engine,
    scene: &Scene,
    cache: &SceneCache,
    camera: &Camera,
    lights: &[&Light],
    method: &Method,
    outputs: Outputs,
) -> Result<Vec<Rendered>> {
    let mut rendered = match engine {
        Engine::Gpu(gpu) => {
            check_image(gpu, camera)?;
            camera.check_float32(scene.bounds())?;
            let mut cached = lock(&cache.gpu);
            one_by_one_where_short(lights, |lights| {
                render_together(gpu, scene, &mut cached, camera, lights, method, outputs)
            })?
        }
        Engine::Cpu => {
            let lights = lights.iter();
            let rendered = lights.map(|light| {
                let frame = cpu::Frame::new(scene, camera, light, &cache.cpu, outputs.culls)?;
                let frame = frame.with_whole_maps(outputs.has(Output::ShadowMap));
                render_on_cpu(frame, method, outputs)
            });
            rendered.collect::<Result<_>>()?
        }
    };
    for (frame, light) in rendered.iter_mut().zip(lights) {
        frame.measure(scene, camera, light, outputs);
    }
    Ok(rendered)
}

fn render_on_cpu(mut frame: cpu::Frame, method: &Method, outputs: Outputs) -> Result<Rendered> {
    let mut recorded = method.record(&mut frame)?;
    let (scene, camera, light) = (frame.scene, frame.camera, frame.light);
    // What has no map knows all triangles.
    let at_light = match recorded.layers.is_empty() {
        true => vec![],
        false => sides::casters_at_light(scene, light, camera.eye),
    };
    let reads_triangles = outputs.reads_triangles() || !at_light.is_empty();
    let triangle_id = reads_triangles.then(|| frame.image().triangle_ids());
    let triangle_id = triangle_id.unwrap_or_default();
    if !at_light.is_empty() {
        let (view, lit) = ((scene, camera, light), &mut recorded.visibility);
        let (facts, milliseconds) = shadow_by(&at_light, view, &triangle_id, lit);
        frame.stats.facts.add(unsure::LABEL, facts);
        frame.timings.push((unsure::LABEL, milliseconds));
    }
    let mut rendered = Rendered {
        pages: recorded.pages,
        ..Rendered::default()
    };
    for layer in recorded.layers {
        let Layer { projection, region } = layer.plan.layer;
        if outputs.has(Output::ShadowMap) {
            rendered
                .shadow_map
                .extend(layer.map.stored_depths(&projection));
        }
        if let Some(map) = layer
            .plan
            .importance
            .filter(|_| outputs.has(Output::ImportanceMap))
        {
            let values = map.values.iter().map(|&bits| map.value_from_bits(bits));
            let cells = map.cells as usize;
            rendered
                .importance_maps
                .push((cells, cells, values.collect()));
        }
        rendered.layers.push(RenderedLayer {
            projection,
            region,
            warp: layer
                .plan
                .warp
                .map(|warp| warp.map_functions(|map| map.warp)),
        });
    }
    Ok(Rendered {
        visibility: recorded.visibility,
        triangle_id,
        timings: frame.timings,
        stats: frame.stats,
        adapter: Engine::Cpu.description(),
        ..rendered
    })
}

/// Shadows lit pixels by some triangles, in float64: what was counted, and milliseconds.
fn shadow_by(
    casters: &[u32],
    view: (&Scene, &Camera, &Light),
    triangle_id: &[i32],
    lit: &mut [f32],
) -> (Vec<Fact>, f64) {
    let start = Instant::now();
    let [tests, found] = occlusion::shadow_by(casters, view, triangle_id, lit);
    let facts = vec![
        Fact::sum("tests", tests),
        Fact::sum("found_in_shadow", found),
    ];
    (facts, start.elapsed().as_secs_f64() * 1e3)
}

/// What the work makes of all items at once, or of one at a time: there may be memory for that.
fn one_by_one_where_short<T, R>(
    items: &[T],
    mut work: impl FnMut(&[T]) -> Result<Vec<R>>,
) -> Result<Vec<R>> {
    match work(items) {
        Err(Error::Device(_)) if items.len() > 1 => {
            let made = items.chunks(1).map(work).collect::<Result<Vec<_>>>()?;
            Ok(made.into_iter().flatten().collect())
        }
        outcome => outcome,
    }
}

fn render_together(
    gpu: &Arc<Gpu>,
    scene: &Scene,
    cached: &mut Option<DeviceScene>,
    camera: &Camera,
    lights: &[&Light],
    method: &Method,
    outputs: Outputs,
) -> Result<Vec<Rendered>> {
    let device_scene = DeviceScene::prepare(cached, gpu, scene)?;
    // Each try makes room for what the last one lacked; a third is only needed where the map's list
    // grows after the visibility buffer's did, and some more where triangles are split.
    for _ in 0..8 {
        match try_render(device_scene, scene, camera, lights, method, outputs) {
            Ok(Some(rendered)) => {
                gpu.save_pipelines();
                return Ok(rendered);
            }
            Ok(None) => device_scene.visibility = None,
            Err(error) => {
                if matches!(error, Error::Device(_)) {
                    // It may have had no memory for the scene's tables.
                    *cached = None;
                }
                return Err(error);
            }
        }
    }
    Err(Error::Device(format!(
        "the work list of the rasterizer did not settle on the device {}",
        gpu.adapter.name
    )))
}

/// `None` where a work list was too short.
fn try_render(
    device_scene: &mut DeviceScene,
    scene: &Scene,
    camera: &Camera,
    lights: &[&Light],
    method: &Method,
    outputs: Outputs,
) -> Result<Option<Vec<Rendered>>> {
    let gpu = device_scene.gpu.clone();
    let mut frames = Recording::together(&gpu, lights.len(), outputs.culls);
    let tables = &device_scene.tables;
    let known = device_scene
        .visibility
        .take()
        .filter(|(known, _)| known == camera && outputs.culls);
    let mut is_known = known.is_some();
    let visibility_buffer = match known {
        Some((_, buffer)) => buffer,
        None => {
            let first = &mut frames[0];
            let buffer = visibility::visibility(first, tables, camera)?;
            if lights.len() > 1 {
                first.send();
            }
            buffer
        }
    };
    let everywhere = Region::EVERYWHERE;
    let sides = lights
        .iter()
        .map(|light| LightSides::new(&gpu, scene, light, camera.eye))
        .collect::<Result<Vec<_>>>()?;
    let views: Vec<_> = frames
        .into_iter()
        .zip(lights.iter().zip(&sides))
        .map(|(frame, (light, light_sides))| {
            let draws_whole_maps = outputs.has(Output::ShadowMap);
            let seen = Receivers {
                scene: tables,
                camera,
                visibility_buffer: &visibility_buffer,
                light,
                light_sides,
                region: &everywhere,
                tiles: None,
            };
            let mut view = View::new(frame, seen, scene, draws_whole_maps);
            if is_known {
                view.skip(visibility::LABEL);
            }
            // By the other lights.
            is_known = true;
            view
        })
        .collect();
    let record = |view| record(view, &visibility_buffer, &tables.room, method, outputs);
    let rendered = side_by_side(views, record)
        .into_iter()
        .collect::<Result<_>>()?;
    device_scene.visibility = Some((camera.clone(), visibility_buffer));
    Ok(rendered)
}

/// What the work makes of each item, each on a thread of its own; they may wait for each other.
fn side_by_side<T: Send, R: Send>(
    items: Vec<T>,
    work: impl Fn(T) -> Result<R> + Sync,
) -> Vec<Result<R>> {
    if items.len() == 1 {
        return items.into_iter().map(work).collect();
    }
    let work = &work;
    std::thread::scope(|scope| {
        let threads: Vec<_> = items
            .into_iter()
            .map(|item| std::thread::Builder::new().spawn_scoped(scope, move || work(item)))
            .collect();
        let outcomes = threads.into_iter().map(|thread| match thread {
            Ok(thread) => thread
                .join()
                .unwrap_or_else(|panic| std::panic::resume_unwind(panic)),
            Err(error) => Err(Error::Device(format!("no thread for a light: {error}"))),
        });
        outcomes.collect()
    })
}

/// Records and submits the frame of one light, and reads it back. `None` where a work list was too short.
fn record(
    mut view: View,
    visibility_buffer: &PooledBuffer,
    room: &Room,
    method: &Method,
    outputs: Outputs,
) -> Result<Option<Rendered>> {
    let Recorded {
        visibility,
        layers,
        pages,
    } = method.record(&mut view)?;

    let pixels = view.camera.pixel_count();
    let at_light = view.casters_at_light();
    let frame = view.frame();
    let gpu = frame.gpu.clone();
    let is_filtered = layers.iter().any(|layer| layer.comparison.is_filtered());
    let visibility = ImageRead::new(frame, visibility, pixels, is_filtered)?;
    let keys = (outputs.reads_triangles() || !at_light.is_empty())
        .then(|| frame.read::<u64>(Source::Kept(visibility_buffer), pixels))
        .transpose()?;
    let unsure = view.read_unsure()?;
    let frame = view.frame();
    let layers = layers.into_iter();
    let layers = layers.map(|layer| LayerReads::new(frame, layer, outputs));
    let layers = layers.collect::<Result<Vec<_>>>()?;
    let pages = pages.map(|pages| PageReads::new(view.frame(), pages, pixels, outputs));
    let pages = pages.transpose()?;
    let results = view.submit()?;
    let (scene, camera, light) = (view.scene, view.camera, view.light);
    let (mut frame, mut stats) = view.finish();
    if !frame.had_room {
        return Ok(None);
    }
    let mut lit = visibility.take(&results)?;
    if let Some(unsure) = unsure {
        let start = Instant::now();
        let view = (scene, camera, light);
        let Some(facts) = unsure.decide(&results, room, view, &mut lit)? else {
            return Ok(None);
        };
        if !facts.is_empty() {
            frame.facts.add(unsure::LABEL, facts);
            frame.add_time(unsure::LABEL, start.elapsed().as_secs_f64() * 1e3);
        }
    }
    let triangle_id = match &keys {
        Some(keys) => {
            let keys = results.take(keys)?.into_iter();
            keys.map(visibility::triangle_from_key).collect()
        }
        None => Vec::new(),
    };
    if !at_light.is_empty() {
        let view = (scene, camera, light);
        let (facts, milliseconds) = shadow_by(at_light, view, &triangle_id, &mut lit);
        frame.facts.add(unsure::LABEL, facts);
        frame.add_time(unsure::LABEL, milliseconds);
    }
    stats.facts = frame.facts.clone();
    stats.layers = layers.len();
    let mut rendered = Rendered {
        visibility: lit,
        triangle_id,
        timings: frame.timings(),
        stats,
        adapter: gpu.adapter.clone(),
        ..Rendered::default()
    };
    for layer in layers {
        layer.take(&results, &mut rendered)?;
    }
    rendered.pages = pages.map(|pages| pages.take(&results)).transpose()?;
    Ok(Some(rendered))
}

/// What is read back of a layer.
struct LayerReads {
    fitted: Layer,
    /// Words of a texel, of which the last one is the depth.
    map: Option<(usize, Read<u32>)>,
    importance: Option<(ImportanceMap, Read<u32>)>,
    warp: Option<(Layout, Read<f32>)>,
}

impl LayerReads {
    fn new(frame: &mut Recording, layer: RasterizedLayer, outputs: Outputs) -> Result<Self> {
        let target = layer.comparison.target();
        let PlannedLayer {
            layer: fitted,
            warp,
            importance,
        } = layer.plan;
        let texels = layer.texel_count;
        let mut reads = Self {
            fitted,
            map: None,
            importance: None,
            warp: None,
        };
        if outputs.has(Output::ShadowMap) {
            let words = target.texel_bytes() / 4;
            let read = frame.read(Source::Taken(layer.texels), words * texels)?;
            reads.map = Some((words, read));
        }
        if let Some(importance) = importance.filter(|_| outputs.has(Output::ImportanceMap)) {
            let count = (importance.cells as usize).pow(2);
            let read = frame.read(Source::Kept(&importance.values), count)?;
            reads.importance = Some((importance, read));
        }
        if let Some(warp) = warp.filter(|_| outputs.reads_warps()) {
            reads.warp = Some((warp.layout, warp.read(frame)?));
        }
        Ok(reads)
    }

    /// Adds the layer to a frame.
    fn take(self, results: &ReadResults, rendered: &mut Rendered) -> Result<()> {
        if let Some((words, read)) = &self.map {
            let keys = results.take(read)?.into_iter();
            let keys = keys.skip(words - 1).step_by(*words);
            rendered
                .shadow_map
                .extend(keys.map(shadow_map::depth_from_key));
        }
        if let Some((map, read)) = &self.importance {
            let bits = results.take(read)?.into_iter();
            let values = bits.map(|bits| map.value_from_bits(bits)).collect();
            let cells = map.cells as usize;
            rendered.importance_maps.push((cells, cells, values));
        }
        let warp = match &self.warp {
            Some((layout, read)) => {
                let functions = layout.functions_of(results.take(read)?);
                Some(Warping::Functions(functions))
            }
            None => None,
        };
        let Layer { projection, region } = self.fitted;
        rendered.layers.push(RenderedLayer {
            projection,
            region,
            warp,
        });
        Ok(())
    }
}

/// What is read back of maps in pages.
struct PageReads {
    maps: PagedMaps,
    layer_of_level: Vec<u8>,
    level_of_pixel: Option<Read<u32>>,
}

impl PageReads {
    fn new(
        frame: &mut Recording,
        pages: RecordedPages,
        pixels: usize,
        outputs: Outputs,
    ) -> Result<Self> {
        let asks = outputs.has_any(&[Output::PageLevels, Output::AliasingError]);
        let read = asks.then(|| frame.read(Source::Taken(pages.level_of_pixel), pixels));
        Ok(Self {
            maps: pages.maps,
            layer_of_level: pages.layer_of_level,
            level_of_pixel: read.transpose()?,
        })
    }

    fn take(self, results: &ReadResults) -> Result<PagedMaps> {
        let mut maps = self.maps;
        if let Some(read) = &self.level_of_pixel {
            let numbers = results.take(read)?.into_iter();
            let layer_of = |number: u32| match number {
                0 => NO_LAYER,
                number => self.layer_of_level[number as usize - 1],
            };
            maps.layer_of_pixel = numbers.map(layer_of).collect();
        }
        Ok(maps)
    }
}

fn check_image(gpu: &Gpu, camera: &Camera) -> Result<()> {
    // The visibility buffer holds 8 bytes for each pixel.
    let most = gpu.largest_storage() / 8;
    if camera.pixel_count() as u64 > most {
        return Err(Error::Value(format!(
            "image size must not exceed {most} pixels on the device {}, got width {} and height {}",
            gpu.adapter.name, camera.width, camera.height
        )));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod variants;
