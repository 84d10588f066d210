//! Maps in pages against the same maps whole, and what of them is kept.

use super::*;
use crate::cpu::frame::{Frame, KeptParts, Recorded};
use crate::fits::layer::Layer;
use crate::fits::pages::{PagesOver, fit_pages};
use crate::map_settings::{Bias, BiasRule, Comparison, Filter, MapSettings, Rasterization};
use crate::paging::{NO_LAYER, Paging};
use crate::verbs::Verbs;

/// No multiple of the page's size, so that the last pages reach beyond the map; an odd number of pages along it.
const RESOLUTION: u32 = 2240;

const PAGING: Paging = Paging {
    page_size: 128,
    max_pages: 100_000,
    level_bias: 0.0,
    keeps: false,
};

fn filtered(radius: f64, is_unwarped: bool) -> Comparison {
    Comparison::filtered(Filter {
        radius,
        samples: 9,
        is_unwarped,
        is_gaussian: false,
        is_jittered: true,
    })
}

fn lookups() -> [Comparison; 6] {
    let auto = Comparison {
        reach: 1,
        triangles: true,
        ..Comparison::DEPTH
    };
    [
        auto,
        Comparison { reach: 2, ..auto },
        Comparison::DEPTH,
        Comparison {
            depths: false,
            ..auto
        },
        filtered(20.0, false),
        filtered(0.05, true),
    ]
}

fn settings(lookup: Comparison) -> MapSettings {
    MapSettings {
        rasterization: Rasterization::Exact,
        lookup,
        bias: BiasRule {
            kind: Bias::Auto,
            constant: None,
            slope: 1.0,
        },
    }
}

/// A floor with triangles over it, seen from above.
fn view(random: &mut Random) -> (Scene, Camera) {
    let mut corners = floor(3.0);
    let above = |t: [DVec3; 3]| t.map(|v| 0.6 * v + DVec3::Y);
    corners.extend(soup(random, 100).into_iter().map(above));
    let turn = DQuat::from_rotation_x(-0.6);
    let eye = DVec3::new(0.1, 2.0, 3.0);
    let camera = camera_at(eye, turn, (161, 90), (1e-3, f64::INFINITY));
    (scene_of(&corners), camera)
}

fn some_lights() -> [Light; 5] {
    let place = DVec3::new(0.3, 1.9, 0.7);
    [
        Light::directional(DVec3::new(0.5, -1.0, 0.3)).unwrap(),
        Light::point(place).unwrap(),
        Light::point(1e4 * place).unwrap(),
        Light::spot(place, -place, 0.5).unwrap(),
        Light::hemisphere(place, DVec3::NEG_Y).unwrap(),
    ]
}

fn fitted(frame: &mut Frame, over: PagesOver) -> Vec<Layer> {
    fit_pages(frame, over, RESOLUTION).unwrap()
}

fn same(a: &[f32], b: &[f32]) -> bool {
    let bits = |v: &[f32]| v.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    bits(a) == bits(b)
}

/// Where all receivers look into one level, that level as a whole map gives the same bytes: no texel that a lookup touches
/// is missing, at no edge of a page, whatever it looks at.
#[test]
fn pages_of_one_level_answer_as_the_whole_map() {
    let mut random = Random(11);
    let (scene, camera) = view(&mut random);
    for (light, page_size) in some_lights().iter().zip([128, 64, 256, 128, 128]) {
        for lookup in lookups() {
            let settings = settings(lookup);
            for (bias, level) in [(-100.0, 0), (100.0, usize::MAX)] {
                let kept = KeptParts::default();
                let mut frame = Frame::new(&scene, &camera, light, &kept, true).unwrap();
                let maps = fitted(&mut frame, PagesOver::Receivers);
                let paging = Paging {
                    level_bias: bias,
                    page_size,
                    ..PAGING
                };
                let sides = paging.sides(RESOLUTION);
                let side = sides[level.min(sides.len() - 1)];
                let whole = maps.iter().map(|map| map.with_resolution(side).into());
                let whole = whole.collect();
                let paged = frame.paged_shadows(settings, maps, paging).unwrap();
                let whole = frame.shadows(settings, whole).unwrap();
                let case = format!("{light:?}, {lookup:?}, bias {bias}");
                assert!(same(&paged.visibility, &whole.visibility), "{case}");
                let shadowed = whole.visibility.iter().filter(|v| **v < 1.0).count();
                assert!(shadowed > 500, "{case}: {shadowed}");
            }
        }
    }
}

fn paged(frame: &mut Frame, over: PagesOver, paging: Paging) -> Recorded {
    let maps = fitted(frame, over);
    let settings = settings(lookups()[0]);
    frame.paged_shadows(settings, maps, paging).unwrap()
}

fn measured_bias(frame: &Frame) -> f64 {
    let mut measures = frame.stats.measures.iter();
    measures.find(|(name, _)| *name == "level_bias").unwrap().1
}

#[test]
fn the_bound_is_met_by_coarser_levels_and_every_receiver_has_one() {
    let mut random = Random(12);
    let (scene, camera) = view(&mut random);
    for light in some_lights() {
        let mut before = f64::INFINITY;
        for max_pages in [6, 9, 20, 40, 1000] {
            let kept = KeptParts::default();
            let mut frame = Frame::new(&scene, &camera, &light, &kept, true).unwrap();
            let paging = Paging {
                max_pages,
                page_size: 64,
                ..PAGING
            };
            let found = paged(&mut frame, PagesOver::Receivers, paging);
            let record = found.pages.unwrap();
            assert!(record.pages.len() <= max_pages as usize);
            let bias = measured_bias(&frame);
            assert!(bias <= before, "{light:?}: {bias} with {max_pages} pages");
            before = bias;
            let looks = record.layer_of_pixel.iter().filter(|n| **n != NO_LAYER);
            let facing = frame.stats.receivers.unwrap().facing;
            // Those where two faces meet are counted in both.
            assert!((0..=40).contains(&(facing as i64 - looks.count() as i64)));
        }
        assert_eq!(before, 0.0, "{light:?}");
    }
}

/// A camera that moves on, over a map that holds still.
#[test]
fn kept_pages_change_no_byte() {
    let mut random = Random(13);
    let (scene, camera) = view(&mut random);
    let paging = Paging {
        keeps: true,
        page_size: 64,
        ..PAGING
    };
    for light in some_lights() {
        let kept = KeptParts::default();
        for step in 0..4 {
            let eye = camera.eye + DVec3::X * 0.05 * f64::from(step);
            let camera = Camera {
                eye,
                ..camera.clone()
            };
            let rendered = [true, false].map(|culls| {
                let mut frame = Frame::new(&scene, &camera, &light, &kept, culls).unwrap();
                let found = paged(&mut frame, PagesOver::Scene, paging);
                (found.visibility, found.pages.unwrap().pages)
            });
            let [(visibility, pages), (anew, drawn)] = rendered;
            assert!(same(&visibility, &anew), "{light:?}");
            let count = pages.iter().filter(|page| page.is_kept).count();
            let enough = if step == 0 { 0 } else { pages.len() / 2 };
            assert!(count >= enough, "{light:?}: {count} of {}", pages.len());
            assert!(step > 0 || count == 0);
            assert!(drawn.iter().all(|page| !page.is_kept));
        }
        // Of a scene whose vertices moved, or under another light, nothing is taken.
        let mut moved = scene_of(&soup(&mut random, 30));
        let corners = moved.vertices().to_vec();
        moved.update_vertices(corners).unwrap();
        let mut frame = Frame::new(&moved, &camera, &light, &kept, true).unwrap();
        let found = paged(&mut frame, PagesOver::Scene, paging);
        let pages = found.pages.unwrap().pages;
        assert!(pages.iter().all(|page| !page.is_kept));
    }
}
