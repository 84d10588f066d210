//! Counts of receivers whose places are kept from one pass to the next.

use super::importance::{COUNT, FIT, view};
use super::*;
use crate::cpu::importance_map::importance_map;
use crate::cpu::queries::bounds;
use crate::cpu::receivers::Receivers;
use crate::cpu::warp_map::WarpMap;
use crate::fits::boxes::parallel_layer;
use crate::fits::layer::Layer;
use crate::fits::receivers::Setting;
use crate::importance::{Factors, Importance};
use crate::map_size::MapSize;
use crate::region::{HalfSpace, Region};
use crate::warp::Axis;

#[test]
fn counts_along_y_are_the_same_of_receivers_that_were_placed_before() {
    let (scene, camera) = view(&mut Random(8));
    let image = rasterize(&View::of_camera(&camera), &scene);
    let light = Light::directional(DVec3::new(0.5, -1.0, 0.3)).unwrap();
    let receivers = Receivers::new(&scene, &image, &camera, &light);
    let half = |side: f64| HalfSpace {
        origin: DVec3::ZERO,
        normal: side * DVec3::X,
    };
    // Some receivers lie beside the map.
    let setting = Setting {
        scene: &scene,
        camera: &camera,
        light: &light,
    };
    let size = MapSize {
        width: 64,
        height: 48,
    };
    let axes = parallel_layer(setting);
    let (low, high) =
        bounds(&receivers, std::slice::from_ref(&axes)).0[0].expect("some face the light");
    let [middle, across] = [0.5 * (low + high), 0.7 * (high - low)].map(DVec3::truncate);
    let projection = axes.projection.around(middle, size.texels() / across, size);
    let [whole, right, left] = [vec![], vec![half(1.0)], vec![half(-1.0)]].map(|sides| Layer {
        projection: projection.clone(),
        region: Region::new(sides),
    });
    let along_y = Importance::Count {
        along: Axis::Y,
        unit: 1.0,
    };
    let mut found = vec![];
    for (layer, other) in [(&whole, &right), (&right, &left)] {
        let count = |layer, importance, warp, placed| {
            let from = (warp, placed);
            importance_map(&receivers, layer, 32, importance, Factors::NONE, from)
        };
        let (counts, placed) = count(layer, COUNT, None, None);
        let mut warp = WarpMap::new(4, 32);
        warp.fit_counts(Axis::X, &counts, FIT);
        let again = |placed| count(layer, along_y, Some(&warp.warp), placed).0.values;
        let anew = again(None);
        assert!(anew == again(placed));
        // Those of another layer are not taken for its own.
        assert!(anew == again(count(other, COUNT, None, None).1));
        let sums = [&anew, &counts.values].map(|values| values.iter().sum::<u32>());
        assert_eq!(sums[0], sums[1]);
        found.push(sums[0]);
    }
    assert!(found[0] > found[1] && found[1] > 500, "{found:?}");
}
