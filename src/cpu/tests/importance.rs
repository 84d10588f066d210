//! Importance and warps against the passes of the other engine, and against what they are to be.

use super::*;
use crate::aliasing::RenderedLayer;
use crate::cpu::blend_importance::blend_importance;
use crate::cpu::boundary::boundary;
use crate::cpu::depth_image::DepthImage;
use crate::cpu::forward_importance::forward_importance;
use crate::cpu::importance_map::{Words, importance_map};
use crate::cpu::receivers::Receivers;
use crate::cpu::shadow_edge::shadow_edge;
use crate::cpu::warp_map::WarpMap;
use crate::engine::Engine;
use crate::fits::layer::Layer;
use crate::importance::{EdgeBias, Factors, Grid, Importance, ImportanceMap, OldImportance};
use crate::methods::Method;
use crate::reference::surface;
use crate::render::{Outputs, Rendered, SceneCache, render};
use crate::warp::{Axis, CountFit, Warp};
use glam::DMat3;

const CELLS: u32 = 512;

/// What `notw` takes where nothing is asked for.
pub(super) const FIT: CountFit = CountFit {
    smoothing: 0.0,
    exponent: 0.5,
    even_share: 0.1,
};

/// A floor with triangles over it, seen from above.
pub(super) fn view(random: &mut Random) -> (Scene, Camera) {
    let mut corners = floor(2.0);
    corners.extend(
        soup(random, 100)
            .into_iter()
            .map(|t| t.map(|v| 0.6 * v + DVec3::Y)),
    );
    let turn = DQuat::from_rotation_x(-0.6);
    let eye = DVec3::new(0.1, 2.0, 3.0);
    let camera = camera_at(eye, turn, (161, 90), (1e-3, f64::INFINITY));
    (scene_of(&corners), camera)
}

fn some_lights() -> [Light; 4] {
    let place = DVec3::new(0.3, 1.9, 0.7);
    [
        Light::directional(DVec3::new(0.5, -1.0, 0.3)).unwrap(),
        Light::point(place).unwrap(),
        Light::spot(place, -place, 0.5).unwrap(),
        Light::hemisphere(place, DVec3::NEG_Y).unwrap(),
    ]
}

fn by_the_shaders(scene: &Scene, camera: &Camera, light: &Light, method: &str) -> Rendered {
    let schema = Method::schema(method).unwrap();
    let method = Method::new(schema, &schema.defaults()).unwrap();
    let names = ["importance_map", "warp_map"].map(String::from);
    let outputs = Outputs::from_names(&names, true).unwrap();
    let engine = Engine::Gpu(crate::gpu::gpu("").unwrap());
    let cache = SceneCache::default();
    let rendered = render(&engine, scene, &cache, camera, &[light], &method, outputs);
    rendered.unwrap().remove(0)
}

fn fitted(layer: &RenderedLayer) -> Layer {
    Layer {
        projection: layer.projection.clone(),
        region: layer.region.clone(),
    }
}

fn values(map: &ImportanceMap<Words>) -> Vec<f64> {
    let values = map.values.iter().map(|&bits| map.value_from_bits(bits));
    values.map(f64::from).collect()
}

fn words(values: &[f32], count_unit: Option<f64>) -> ImportanceMap<Words> {
    let word = |&value: &f32| match count_unit {
        Some(_) => value as u32,
        None => value.to_bits(),
    };
    ImportanceMap {
        values: values.iter().map(word).collect(),
        cells: CELLS,
        count_unit,
    }
}

fn functions_of(layer: &RenderedLayer) -> &Warp {
    let warp = layer.warp.as_ref().unwrap();
    warp.functions().unwrap()
}

/// How far two warps are apart at each boundary of cells.
fn apart(found: &Warp, right: &Warp) -> Vec<f32> {
    assert_eq!(found.values.len(), right.values.len());
    let pairs = found.values.iter().zip(&right.values);
    pairs.map(|(a, b)| (a - b).abs()).collect()
}

pub(super) const COUNT: Importance = Importance::Count {
    along: Axis::X,
    unit: 1.0,
};

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn maps_and_warps_are_those_of_the_shaders() {
    let (scene, camera) = view(&mut Random(1));
    let image = rasterize(&View::of_camera(&camera), &scene);
    let mut compared = 0;
    for light in some_lights() {
        let receivers = Receivers::new(&scene, &image, &camera, &light);
        let map = |layer: &Layer, importance, factors, warp: Option<&Warp>| {
            importance_map(&receivers, layer, CELLS, importance, factors, (warp, None)).0
        };
        let shown = by_the_shaders(&scene, &camera, &light, "rtw");
        for (right, layer) in shown.importance_maps.iter().zip(&shown.layers) {
            let case = format!("rtw, {light:?}");
            let mut factors = Factors::NONE;
            factors.distance = true;
            let found = map(&fitted(layer), Importance::Maximum, factors, None);
            let pairs = values(&found).into_iter().zip(&right.2);
            // A receiver within rounding of a cell's border falls on either side.
            let wrong = pairs.filter(|&(a, &b)| (a - f64::from(b)).abs() > 1e-4 * a.max(b.into()));
            let wrong: Vec<_> = wrong.collect();
            assert!(
                wrong.len() * 200 < filled(&right.2) + 200,
                "{case}: {} of {}, {:?}",
                wrong.len(),
                filled(&right.2),
                &wrong[..wrong.len().min(10)]
            );
            let right = words(&right.2, None);
            let mut warp = WarpMap::new(1, CELLS);
            warp.fit_maxima(Axis::X, &right, 3.0);
            warp.fit_maxima(Axis::Y, &right, 3.0);
            let apart = apart(&warp.warp, functions_of(layer));
            assert!(apart.iter().all(|&apart| apart < 1e-5), "{case}");
        }
        let shown = by_the_shaders(&scene, &camera, &light, "notw");
        for (right, layer) in shown.importance_maps.iter().zip(&shown.layers) {
            let case = format!("notw, {light:?}");
            let found = map(&fitted(layer), COUNT, Factors::NONE, None);
            let pairs = values(&found).into_iter().zip(&right.2);
            let moved: f64 = pairs.map(|(a, &b)| (a - f64::from(b)).abs()).sum();
            let sum: f64 = values(&found).iter().sum();
            assert!(moved < 2.5 + 5e-3 * sum, "{case}: {moved} of {sum}");
            compared += usize::from(sum > 100.0);
            let mut warp = WarpMap::new(16, CELLS);
            warp.fit_counts(Axis::X, &words(&right.2, Some(1.0)), FIT);
            let along = Importance::Count {
                along: Axis::Y,
                unit: 1.0,
            };
            let found = map(&fitted(layer), along, Factors::NONE, Some(&warp.warp));
            warp.fit_counts(Axis::Y, &found, FIT);
            let apart = apart(&warp.warp, functions_of(layer));
            let (along_x, along_y) = apart.split_at(apart.len() / 2);
            assert!(along_x.iter().all(|&apart| apart < 1e-4), "{case}");
            let mean = along_y.iter().sum::<f32>() / along_y.len() as f32;
            // Where receivers are few, one of them on the other side of a border is a large share.
            assert!(mean < 1e-3 + 1.0 / sum as f32, "{case}: {mean}");
        }
    }
    assert!(compared >= 6, "{compared}");
}

fn filled(values: &[f32]) -> usize {
    values.iter().filter(|&&value| value > 0.0).count()
}

fn grid(columns: u32, rows: u32, random: &mut Random) -> Grid<Words> {
    let weight = |_| (0.5 + random.share() as f32).to_bits();
    Grid {
        values: (0..columns * rows).map(weight).collect(),
        columns,
        rows,
    }
}

fn sun_layer(scene: &Scene, camera: &Camera, light: &Light) -> Layer {
    let shown = by_the_shaders(scene, camera, light, "notw");
    fitted(&shown.layers[0])
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn importance_is_the_product_of_its_factors() {
    let mut random = Random(2);
    let (scene, camera) = view(&mut random);
    let image = rasterize(&View::of_camera(&camera), &scene);
    let light = &some_lights()[0];
    let layer = sun_layer(&scene, &camera, light);
    let receivers = Receivers::new(&scene, &image, &camera, light);
    let [pixels, blocks] = [(161, 90), (41, 23)].map(|(x, y)| grid(x, y, &mut random));
    let [edges, weights] = [(32, 32), (7, 5)].map(|(x, y)| grid(x, y, &mut random));
    let factors = Factors {
        distance: true,
        normal: Some(2.0),
        shadow_edge: Some(&edges),
        boundary: Some(&blocks),
        pixel_weights: Some(&pixels),
        map_weights: Some(&weights),
    };
    let cells = 32;
    let unit = 1e4;
    let counted = Importance::Count {
        along: Axis::X,
        unit,
    };
    let maxima = importance_map(
        &receivers,
        &layer,
        cells,
        Importance::Maximum,
        factors,
        (None, None),
    )
    .0;
    let counts = importance_map(&receivers, &layer, cells, counted, factors, (None, None)).0;
    let mut right = [vec![0.0; 1024], vec![0.0; 1024]];
    let (points, normals, depths) = surface(&scene, &camera, &triangle_ids(&image));
    for (pixel, (&point, &normal)) in points.iter().zip(&normals).enumerate() {
        let (point, normal) = (DVec3::from(point), DVec3::from(normal.map(f64::from)));
        if point.is_nan() || normal.dot(light.vector_from_point(point)) <= 0.0 {
            continue;
        }
        let uv = layer.projection.texel_from_point(point) / f64::from(layer.projection.width);
        let at = |grid: &Grid<Words>, [x, y]: [usize; 2]| {
            f64::from(f32::from_bits(grid.values[y * grid.columns as usize + x]))
        };
        let cell = |columns: u32, rows: u32| {
            [
                (uv.x * f64::from(columns)) as usize,
                (uv.y * f64::from(rows)) as usize,
            ]
        };
        let place = [pixel % 161, pixel / 161];
        let cosine = normal.dot((camera.eye - point).normalize());
        let value = (1.0 + 2.0 * cosine) / depths[pixel]
            * at(&edges, cell(32, 32))
            * at(&weights, cell(7, 5))
            * at(&pixels, place)
            * at(&blocks, place.map(|p| p / 4));
        let [column, row] = cell(cells, cells);
        let (most, sum) = (&mut right[0][row * 32 + column], value);
        *most = f64::max(*most, sum);
        right[1][row * 32 + column] += value;
    }
    for (found, right) in [maxima, counts].iter().zip(&right) {
        let pairs = values(found).into_iter().zip(right);
        let wrong = pairs.filter(|(a, b)| (a - *b).abs() > 1e-3 * b.max(1.0));
        let filled = right.iter().filter(|&&value| value > 0.0).count();
        assert!(filled > 200 && wrong.count() < 3);
    }
}

/// Counts that are random in some cells.
fn counts(cells: u32, random: &mut Random) -> ImportanceMap<Words> {
    let mut count = |_| [0, 0, 1, random.below(100)][random.below(4)] as u32;
    let mut values: Vec<_> = (0..cells * cells).map(&mut count).collect();
    // A function of one cell, and one of nothing.
    values[..cells as usize].fill(0);
    values[cells as usize / 2] = 7;
    let last = values.len().saturating_sub(3 * cells as usize);
    values[last.max(1)..].fill(0);
    ImportanceMap {
        values,
        cells,
        count_unit: Some(1.0),
    }
}

#[test]
fn functions_are_prefix_sums_of_what_they_serve() {
    let mut random = Random(3);
    for (cells, functions) in [(37, 37), (64, 16), (48, 5), (1, 1), (30, 1)] {
        for (smoothing, exponent, even_share) in [(0.0, 1.0, 0.0), (2.0, 0.5, 0.1), (9.0, 0.0, 1.0)]
        {
            let fit = CountFit {
                smoothing,
                exponent,
                even_share,
            };
            let counts = counts(cells, &mut random);
            let mut map = WarpMap::new(functions, cells);
            map.fit_counts(Axis::Y, &counts, fit);
            let (n, window) = (cells as usize, fit.window(cells) as usize);
            let averaged = |rows: &[Vec<f64>]| -> Vec<Vec<f64>> {
                let near = |i: usize| &rows[i.saturating_sub(window)..(i + window + 1).min(n)];
                let sum = |i: usize, cell: usize| near(i).iter().map(|row| row[cell]).sum();
                (0..n)
                    .map(|i| (0..n).map(|cell| sum(i, cell)).collect())
                    .collect()
            };
            let mut rows: Vec<Vec<f64>> = counts
                .values
                .chunks(n)
                .map(|row| row.iter().copied().map(f64::from).collect())
                .collect();
            if window > 0 {
                rows = averaged(&averaged(&rows));
            }
            let count = functions as usize;
            let values = map.warp.values.split_at(count * (n + 1)).1;
            for (function, found) in values.chunks(n + 1).enumerate() {
                let served = &rows[function * n / count..(function + 1) * n / count];
                let worth = |cell: usize| {
                    let sum: f64 = served.iter().map(|row| row[cell]).sum();
                    if sum == 0.0 { 0.0 } else { sum.powf(exponent) }
                };
                let total: f64 = (0..n).map(worth).sum();
                assert!(found.windows(2).all(|pair| pair[0] <= pair[1]));
                assert_eq!((found[0], found[n]), (0.0, 1.0));
                for (cell, &value) in found.iter().enumerate() {
                    let identity = cell as f64 / n as f64;
                    let sum: f64 = (0..cell).map(worth).sum();
                    let right = match total {
                        0.0 => identity,
                        _ => sum / total * (1.0 - even_share) + even_share * identity,
                    };
                    // Powers are rounded to integers.
                    assert!((f64::from(value) - right).abs() < 5e-4, "{value} {right}");
                }
            }
        }
    }
}

#[test]
fn the_function_of_maxima_is_their_blurred_prefix_sum() {
    let mut random = Random(4);
    let cells = 40;
    let values = (0..cells * cells).map(|_| (random.share().powi(3) as f32).to_bits());
    let importance = ImportanceMap {
        values: values.collect(),
        cells,
        count_unit: None,
    };
    for sigma in [0.0, 1.5, 100.0] {
        let mut map = WarpMap::new(1, cells);
        map.fit_maxima(Axis::X, &importance, sigma);
        map.fit_maxima(Axis::Y, &importance, sigma);
        for (axis, found) in map.warp.values.chunks(41).enumerate() {
            let at = |i: usize, k: usize| if axis == 0 { k * 40 + i } else { i * 40 + k };
            let most = |i: usize| {
                let values = (0..40).map(|k| f32::from_bits(importance.values[at(i, k)]));
                f64::from(values.fold(0.0, f32::max))
            };
            let blurred = |i: usize| {
                let weight = |k: usize| {
                    let apart = i.abs_diff(k) as f64;
                    // Wider than the map it is even.
                    let sigma = sigma.clamp(1e-3, 40.0);
                    if apart > 3.0 * sigma + 1.0 {
                        0.0
                    } else {
                        (-0.5 * (apart / sigma).powi(2)).exp()
                    }
                };
                let sum: f64 = (0..40).map(|k| weight(k) * most(k)).sum();
                sum / (0..40).map(weight).sum::<f64>()
            };
            let total: f64 = (0..40).map(blurred).sum();
            for (cell, &value) in found.iter().enumerate() {
                let right = (0..cell).map(blurred).sum::<f64>() / total;
                assert!(
                    (f64::from(value) - right).abs() < 2e-3,
                    "{sigma}: {value} {right}"
                );
            }
            assert_eq!((found[0], found[40]), (0.0, 1.0));
        }
    }
    let nothing = ImportanceMap {
        values: vec![0; 1600],
        ..importance
    };
    let mut map = WarpMap::new(1, cells);
    map.fit_maxima(Axis::X, &nothing, 3.0);
    assert_eq!(map.warp, WarpMap::new(1, cells).warp);
}

#[test]
fn blending_takes_the_old_map_along() {
    let mut random = Random(5);
    let cells = 32;
    let old: Vec<_> = (0..1024).map(|_| random.below(50) as f32).collect();
    let blended = |unit: Option<f64>, old_from_new, share, warp: Option<&Warp>| {
        let mut map = ImportanceMap {
            values: vec![if unit.is_none() { 2.0_f32.to_bits() } else { 2 }; 1024],
            cells,
            count_unit: unit,
        };
        let old = OldImportance {
            values: &old,
            columns: 32,
            rows: 32,
            old_from_new,
            share,
        };
        blend_importance(&mut map, old, warp);
        values(&map)
    };
    // The same place: a mean of both, of maxima and of counts.
    for unit in [None, Some(1.0)] {
        let found = blended(unit, DMat3::IDENTITY, 0.25, None);
        let pairs = found.iter().zip(&old);
        let room = if unit.is_none() { 1e-5 } else { 0.51 };
        assert!(
            pairs
                .clone()
                .all(|(a, b)| (a - (1.5 + 0.25 * f64::from(*b))).abs() < room)
        );
    }
    // Half as wide a map: each cell has a quarter of what an old one had.
    let half = DMat3::from_scale(DVec2::splat(0.5));
    let found: f64 = blended(Some(1.0), half, 1.0, None).iter().sum();
    let quarter = old
        .iter()
        .enumerate()
        .filter(|(i, _)| i % 32 < 16 && i / 32 < 16);
    let right: f64 = quarter.map(|(_, &count)| f64::from(count)).sum();
    assert!((found / right - 1.0).abs() < 0.1, "{found} {right}");
    // Through functions along x, nothing of the old map is lost.
    let mut map = WarpMap::new(4, cells);
    map.fit_counts(Axis::X, &counts(cells, &mut random), FIT);
    let found: f64 = blended(Some(1.0), DMat3::IDENTITY, 1.0, Some(&map.warp))
        .iter()
        .sum();
    let right: f64 = old.iter().copied().map(f64::from).sum();
    assert_eq!(found, right);
}

#[test]
fn boundaries_are_near_lit_and_shadowed_receivers() {
    let (scene, camera) = view(&mut Random(6));
    let image = rasterize(&View::of_camera(&camera), &scene);
    let light = &some_lights()[2];
    let receivers = Receivers::new(&scene, &image, &camera, light);
    let visibility = exact(&scene, &image, &camera, light, None).visibility;
    let found = boundary(&receivers, &visibility, 20.0);
    assert_eq!((found.columns, found.rows), (41, 23));
    let is_facing = |pixel: usize| {
        let id = triangle_ids(&image)[pixel];
        let place = (pixel % 161, pixel / 161);
        id >= 0 && receivers.ray(place, id as u32).is_facing(light)
    };
    let facing: Vec<_> = (0..161 * 90).map(is_facing).collect();
    let mut near = 0;
    for (block, &bits) in found.values.iter().enumerate() {
        let (x, y) = (block % 41, block / 41);
        let mut holds = [false; 2];
        for row in (4 * y).saturating_sub(4)..(4 * y + 8).min(90) {
            for column in (4 * x).saturating_sub(4)..(4 * x + 8).min(161) {
                if facing[row * 161 + column] {
                    holds[visibility[row * 161 + column] as usize] = true;
                }
            }
        }
        let is_near = holds == [true; 2];
        assert_eq!(f32::from_bits(bits), if is_near { 20.0 } else { 1.0 });
        near += usize::from(is_near);
    }
    assert!(near > 20 && near < 800, "{near}");
}

/// What a light sees of the floor at y = 0, but for a hole.
fn depth_image(layer: &Layer) -> DepthImage {
    let side = layer.projection.width as usize;
    let mut image = DepthImage {
        depths: vec![f32::INFINITY; side * side],
        triangles: vec![NONE; side * side],
    };
    for i in 0..side * side {
        let texel = DVec2::new((i % side) as f64, (i / side) as f64) + 0.5;
        let (start, ray) = layer.projection.ray_from_texel(texel);
        if i / side > side / 4 {
            image.depths[i] = (-start.y / ray.y) as f32;
            image.triangles[i] = 0;
        }
    }
    image
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn forward_importance_is_backward_importance_of_a_floor() {
    let scene = scene_of(&floor(0.9));
    let down = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let camera = camera_at(DVec3::Y * 2.5, down, (300, 300), (1e-3, f64::INFINITY));
    let image = rasterize(&View::of_camera(&camera), &scene);
    for light in some_lights() {
        let receivers = Receivers::new(&scene, &image, &camera, &light);
        let layers = by_the_shaders(&scene, &camera, &light, "rtw").layers;
        for layer in layers
            .iter()
            .map(|layer| fitted(layer).with_resolution(256))
        {
            let seen = depth_image(&layer);
            let factors = Factors {
                distance: true,
                normal: Some(2.0),
                ..Factors::NONE
            };
            let cells = 16;
            let back = importance_map(
                &receivers,
                &layer,
                cells,
                Importance::Maximum,
                factors,
                (None, None),
            )
            .0;
            let projection = &layer.projection;
            let forth = forward_importance(&scene, &camera, projection, &seen, cells, factors);
            let pairs: Vec<_> = values(&back).into_iter().zip(values(&forth)).collect();
            let compared = pairs.iter().filter(|(a, b)| *a > 0.0 && *b > 0.0);
            let near = compared.clone().filter(|(a, b)| (a / b - 1.0).abs() < 0.03);
            assert!(
                near.count() * 10 >= compared.clone().count() * 9,
                "{light:?}"
            );
            assert!(compared.count() * layers.len() > 30, "{light:?}");
        }
    }
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn shadow_edges_are_steps_of_depth_beyond_a_slope() {
    let scene = scene_of(&floor(0.9));
    let down = DQuat::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let camera = camera_at(DVec3::Y * 2.5, down, (300, 300), (1e-3, f64::INFINITY));
    for light in some_lights() {
        let layers = by_the_shaders(&scene, &camera, &light, "rtw").layers;
        for layer in layers.iter().map(|layer| fitted(layer).with_resolution(64)) {
            let mut seen = depth_image(&layer);
            // A step that is far higher than the slope of the floor.
            let place = 40 * 64 + 20;
            seen.depths[place] *= 0.5;
            let found = shadow_edge(&layer.projection, &seen, EdgeBias::Texels(4.0), 0.25);
            for (i, &bits) in found.values.iter().enumerate() {
                let (x, y) = (i % 64, i / 64);
                let at_step = x.abs_diff(20) <= 1 && y.abs_diff(40) <= 1;
                let at_hole = y == 16 || y == 17;
                let right = if at_step || at_hole { 1.0 } else { 0.25 };
                let is_far_off = !seen.depths[i].is_finite() || seen.depths[i] < 0.0;
                assert!(
                    f32::from_bits(bits) == right || is_far_off && !at_hole,
                    "{light:?} {x} {y}"
                );
            }
        }
    }
}

#[test]
#[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
fn importance_does_not_depend_on_the_number_of_threads() {
    let (scene, camera) = view(&mut Random(7));
    let image = rasterize(&View::of_camera(&camera), &scene);
    let light = &some_lights()[0];
    let receivers = Receivers::new(&scene, &image, &camera, light);
    let layer = sun_layer(&scene, &camera, light);
    let of_threads = [1, 2, 5].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build().unwrap().install(|| {
            let counts = importance_map(
                &receivers,
                &layer,
                CELLS,
                COUNT,
                Factors::NONE,
                (None, None),
            )
            .0;
            let mut warp = WarpMap::new(16, CELLS);
            warp.fit_counts(Axis::X, &counts, FIT);
            let mut factors = Factors::NONE;
            factors.distance = true;
            let most = Importance::Maximum;
            let maxima = importance_map(&receivers, &layer, CELLS, most, factors, (None, None)).0;
            warp.fit_maxima(Axis::Y, &maxima, 3.0);
            let bits = warp.warp.values.iter().map(|v| v.to_bits());
            (counts.values, maxima.values, bits.collect::<Vec<_>>())
        })
    });
    assert!(of_threads.iter().all(|other| *other == of_threads[0]));
}
