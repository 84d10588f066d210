//! Rendering a frame: from scene, camera, light and method to arrays.

use crate::camera::Camera;
use crate::error::{Error, Result};
use crate::gpu::frame::{Frame, Read, Source, Timings};
use crate::gpu::passes::rasterize::Target;
use crate::gpu::passes::{FactsOfPasses, Inputs, shadow_map, visibility};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::{self, AdapterDescription, Gpu, lock};
use crate::light::Light;
use crate::methods::{Fitted, Layer, Method, Plan, ReceiverCounts, Recorded, View};
use crate::scene::Scene;
use crate::warp::Warp;
use std::sync::{Arc, Mutex};

/// What is read back beside the visibility image, and how it is made.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Outputs {
    pub triangle_id: bool,
    pub shadow_map: bool,
    pub importance_map: bool,
    pub warp_map: bool,
    /// Whether nothing is left out, not even what cannot change a picture.
    pub without_culling: bool,
}

/// A rendered frame.
pub struct Rendered {
    /// Per pixel: 1 lit, 0 in shadow, NaN where no surface is seen.
    pub visibility: Vec<f32>,
    /// Per pixel, -1 where no surface is seen; empty unless asked for.
    pub triangle_id: Vec<i32>,
    /// Depths in [0, 1] per texel, layer after layer; empty unless asked for.
    pub shadow_map: Vec<f32>,
    /// (rows, columns, values) of each layer that has one; empty unless asked for.
    pub importance_maps: Vec<(usize, usize, Vec<f32>)>,
    pub layers: Vec<RenderedLayer>,
    pub timings: Timings,
    pub stats: Stats,
    pub adapter: AdapterDescription,
}

/// Where a layer took the light's rays.
pub struct RenderedLayer {
    pub fitted: Fitted,
    /// None where it has none, or it was not asked for.
    pub warp: Option<Warp>,
}

/// Counters of a frame.
#[derive(Debug, Clone, Default)]
pub struct Stats {
    pub triangles: usize,
    pub degenerate_triangles: usize,
    /// Of passes, by their labels.
    pub facts: FactsOfPasses,
    /// Where a method counts them.
    pub receivers: Option<ReceiverCounts>,
    /// Stages that this frame did not need.
    pub skipped: Vec<&'static str>,
    pub layers: usize,
    /// Layers that no receiver fell in.
    pub skipped_layers: usize,
    /// What the method measured, by name.
    pub measures: Vec<(&'static str, f64)>,
}

/// What stays on the device between frames of one scene.
#[derive(Default)]
pub struct SceneCache(Mutex<Option<DeviceScene>>);

struct DeviceScene {
    gpu: Arc<Gpu>,
    tables: SceneTables,
    /// The last camera's visibility buffer.
    visibility: Option<(Camera, PooledBuffer)>,
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
    scene: &Scene,
    cache: &SceneCache,
    camera: &Camera,
    lights: &[&Light],
    method: &Method,
    outputs: Outputs,
) -> Result<Vec<Rendered>> {
    let gpu = gpu::gpu()?;
    check_image(&gpu, camera)?;
    let mut cached = lock(&cache.0);
    one_by_one_where_short(lights, |lights| {
        render_together(&gpu, scene, &mut cached, camera, lights, method, outputs)
    })
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
            Ok(Some(rendered)) => return Ok(rendered),
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

/// The texels of a layer, as its target stores them.
enum MapRead {
    Depth(Read<u32>),
    DepthTriangle(Read<u64>),
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
    let mut frames = Frame::together(&gpu, lights.len(), !outputs.without_culling);
    let inputs = Inputs {
        scene: &device_scene.tables,
        camera,
    };
    let known = device_scene
        .visibility
        .take()
        .filter(|(known, _)| known == camera && !outputs.without_culling);
    let (visibility_buffer, mut work) = match known {
        Some((_, buffer)) => (buffer, None),
        None => {
            let first = &mut frames[0];
            let rasterized = visibility::visibility(first, inputs)?;
            if lights.len() > 1 {
                first.send();
            }
            (rasterized.texels, Some(rasterized.work))
        }
    };
    let views: Vec<_> = frames
        .into_iter()
        .zip(lights)
        .map(|(frame, light)| {
            let draws_whole_maps = outputs.shadow_map;
            let buffer = &visibility_buffer;
            let mut view = View::new(frame, inputs, scene, light, buffer, draws_whole_maps);
            match work.take() {
                Some(work) => view.keep_work(work),
                None => view.skip(visibility::LABEL),
            }
            view
        })
        .collect();
    let record = |view| record(view, &visibility_buffer, method, outputs);
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
    method: &Method,
    outputs: Outputs,
) -> Result<Option<Rendered>> {
    let Recorded { visibility, layers } = method.record(&mut view)?;

    let (scene, pixels) = (view.scene, view.camera.pixel_count());
    let tables = view.tables();
    let frame = view.frame();
    let gpu = frame.gpu.clone();
    let visibility = frame.read::<f32>(Source::Taken(visibility), pixels)?;
    let keys = outputs
        .triangle_id
        .then(|| frame.read::<u64>(Source::Kept(visibility_buffer), pixels))
        .transpose()?;
    let mut rendered_layers = Vec::new();
    let mut maps = Vec::new();
    let mut importance_maps = Vec::new();
    for Layer {
        plan,
        comparison,
        texels,
    } in layers
    {
        let Plan {
            fitted,
            warp,
            importance,
        } = plan;
        if outputs.shadow_map {
            let count = fitted.projection.texel_count();
            maps.push(match comparison.target() {
                Target::Depth => MapRead::Depth(frame.read(Source::Taken(texels), count)?),
                Target::DepthTriangle => {
                    MapRead::DepthTriangle(frame.read(Source::Taken(texels), count)?)
                }
            });
        }
        if let Some(importance) = importance.filter(|_| outputs.importance_map) {
            let count = (importance.cells as usize).pow(2);
            let read = frame.read::<u32>(Source::Kept(&importance.buffer), count)?;
            importance_maps.push((importance, read));
        }
        let warp = match warp.filter(|_| outputs.warp_map) {
            Some(warp) => {
                let layout = warp.layout;
                let count = layout.functions[0] as usize * (layout.cells[0] as usize + 1);
                let read = frame.read::<f32>(Source::Kept(&warp.table), 2 * count)?;
                Some((layout, read))
            }
            None => None,
        };
        rendered_layers.push((fitted, warp));
    }
    let results = view.submit()?;
    let finished = view.finish();
    for (had_room, counters) in &finished.counters {
        if !had_room(&gpu, tables, counters)? {
            return Ok(None);
        }
    }

    let mut shadow_map = Vec::new();
    for map in &maps {
        match map {
            MapRead::Depth(read) => {
                let keys = results.take(read)?;
                shadow_map.extend(keys.into_iter().map(shadow_map::depth_from_key));
            }
            MapRead::DepthTriangle(read) => {
                let keys = results
                    .take(read)?
                    .into_iter()
                    .map(|key| (key >> 32) as u32);
                shadow_map.extend(keys.map(shadow_map::depth_from_key));
            }
        }
    }
    let mut importances = Vec::new();
    for (map, read) in &importance_maps {
        let bits = results.take(read)?;
        let values = bits.into_iter().map(|bits| map.value_from_bits(bits));
        let cells = map.cells as usize;
        importances.push((cells, cells, values.collect()));
    }
    let mut layers = Vec::new();
    for (fitted, warp) in rendered_layers {
        let warp = match warp {
            Some((layout, read)) => Some(Warp {
                functions: layout.functions[0] as usize,
                boundaries: layout.cells[0] as usize + 1,
                values: results.take(&read)?,
            }),
            None => None,
        };
        layers.push(RenderedLayer { fitted, warp });
    }
    let triangle_id = match &keys {
        Some(keys) => {
            let keys = results.take(keys)?;
            keys.into_iter()
                .map(visibility::triangle_from_key)
                .collect()
        }
        None => Vec::new(),
    };
    Ok(Some(Rendered {
        visibility: results.take(&visibility)?,
        triangle_id,
        shadow_map,
        importance_maps: importances,
        stats: Stats {
            triangles: scene.triangles().len(),
            degenerate_triangles: scene.degenerate_count(),
            facts: finished.facts,
            receivers: finished.receiver_counts,
            skipped: finished.skipped,
            layers: layers.len(),
            skipped_layers: finished.skipped_layers,
            measures: finished.measures,
        },
        layers,
        timings: finished.frame.timings(),
        adapter: gpu.adapter.clone(),
    }))
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
mod tests {
    use super::*;
    use glam::{DMat4, DQuat, DVec2, DVec3};
    use std::f64::consts::FRAC_PI_2;
    use std::sync::atomic::Ordering;

    /// A floor, and over it rows of small squares.
    fn floor_and_squares() -> Scene {
        let mut vertices = Vec::new();
        let mut triangles = Vec::new();
        let mut add = |centre: DVec3, side: f64| {
            let first = vertices.len() as u32;
            for (x, z) in [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)] {
                vertices.push(centre + DVec3::new(x, 0.0, z) * side);
            }
            triangles.extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|i| first + i)));
        };
        add(DVec3::ZERO, 4.0);
        for i in 0..100 {
            let (x, z) = (f64::from(i % 10), f64::from(i / 10));
            add(DVec3::new(0.6 * x - 2.7, 1.0, 0.6 * z - 2.7), 0.15);
        }
        Scene::new(vertices, triangles).unwrap()
    }

    #[test]
    fn what_has_no_room_together_is_done_one_by_one() {
        let mut calls = Vec::new();
        let mut work = |items: &[i32]| {
            calls.push(items.len());
            match items {
                [0] => Err(Error::Value("zero".to_string())),
                [one] => Ok(vec![-one]),
                _ => Err(Error::Device("no memory".to_string())),
            }
        };
        assert_eq!(
            one_by_one_where_short(&[1, 2, 3], &mut work),
            Ok(vec![-1, -2, -3])
        );
        assert!(one_by_one_where_short(&[1, 0], &mut work).is_err());
        assert_eq!(calls, [3, 1, 1, 1, 2, 1, 1]);
    }

    #[test]
    fn casters_in_parts_cast_the_same_shadows() {
        let scene = floor_and_squares();
        let looking_down = DQuat::from_rotation_x(-FRAC_PI_2);
        let camera = Camera::new(
            DMat4::from_rotation_translation(looking_down, DVec3::new(0.0, 6.0, 0.0)),
            DVec2::splat(60.0),
            DVec2::splat(48.0),
            (96, 96),
            (1e-3, f64::INFINITY),
        )
        .unwrap();
        let light = Light::directional(DVec3::new(0.3, -1.0, 0.2)).unwrap();
        let exact = Method::schema("exact").unwrap();
        let method = Method::new(exact, &exact.defaults()).unwrap();
        let cache = SceneCache::default();
        let render = || {
            let outputs = Outputs::default();
            let rendered = render(&scene, &cache, &camera, &[&light], &method, outputs);
            rendered.unwrap().remove(0)
        };
        let whole = render();
        let in_shadow = whole.visibility.iter().filter(|v| **v == 0.0).count();
        assert!((200..5000).contains(&in_shadow), "{in_shadow}");
        let cached = lock(&cache.0);
        let tables = &cached.as_ref().unwrap().tables;
        tables.room.caster_parts.store(5, Ordering::Relaxed);
        drop(cached);
        let parted = render();
        let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&parted.visibility), bits(&whole.visibility));
        // Each part lists fewer.
        let items = |rendered: &Rendered| {
            let mut passes = rendered.stats.facts.0.iter();
            let of_pass = passes.find(|(label, _)| *label == "caster tests");
            let mut facts = of_pass.unwrap().1.iter();
            facts.find(|fact| fact.name == "work_items").unwrap().value
        };
        assert!(2 * items(&parted) < items(&whole) + 2);
    }
}
