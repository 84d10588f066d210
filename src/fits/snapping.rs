//! Texel snapping: sides of a map whose texels hold still while the box that it is for moves and grows.
//!
//! Michal Valient. Stable rendering of cascaded shadow maps. ShaderX6, 2008: corners on multiples of a
//! texel. The texel's size is a step of a geometric row, so that it rarely changes.

use crate::map_size::MapSize;
use glam::DVec2;

/// The fourth root of 2: each size is that many times the one before. A larger step changes less often, at
/// the price of wider texels, which is steep: with the square root, maps had twice the wrong pixels.
const STEP: f64 = 1.189_207_115_002_721;

/// The value rounded up to a step.
pub fn stepped(value: f64) -> f64 {
    STEP.powf((value.ln() / STEP.ln()).ceil())
}

/// The box of so many texels that holds another box; its corners are multiples of its texels.
pub fn snapped((low, high): (DVec2, DVec2), size: MapSize) -> (DVec2, DVec2) {
    let x = snapped_interval((low.x, high.x), size.width);
    let y = snapped_interval((low.y, high.y), size.height);
    (DVec2::new(x.0, y.0), DVec2::new(x.1, y.1))
}

fn snapped_interval((low, high): (f64, f64), texels: u32) -> (f64, f64) {
    // It begins up to a texel before.
    let room = f64::from(texels.max(2) - 1);
    // No narrower than float64 can tell from its neighbour there.
    let least = (8.0 * f64::EPSILON * low.abs().max(high.abs())).max(f64::MIN_POSITIVE);
    let texel = stepped(((high - low) / room).max(least));
    let first = (low / texel).floor() * texel;
    // A single texel cannot both begin at a multiple of its size and hold whatever it should.
    let last = first + f64::from(texels) * texel;
    (first, if texels > 1 { last } else { high.max(last) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_held_by_texels_on_multiples_of_their_size() {
        for texels in [2, 3, 64, 1024] {
            for i in 0..200 {
                let low = -37.0 + 0.37 * f64::from(i);
                let high = low + 0.01 * 1.17_f64.powi(i % 60);
                let (first, last) = snapped_interval((low, high), texels);
                let texel = (last - first) / f64::from(texels);
                assert!(first <= low && high <= last + 1e-12 * high.abs());
                let multiple = first / texel;
                assert!((multiple - multiple.round()).abs() < 1e-6, "{multiple}");
                let most = STEP * (high - low) / f64::from(texels - 1);
                assert!(texel <= 1.0001 * most, "{texel} {most}");
            }
        }
    }

    #[test]
    fn a_moving_box_keeps_its_texels_and_a_growing_one_mostly() {
        let places = (0..1000).map(|i| 0.003_7 * f64::from(i));
        let sizes = |widths: &dyn Fn(f64) -> f64| {
            let mut sizes: Vec<_> = places
                .clone()
                .map(|x| {
                    let (first, last) = snapped_interval((x, x + widths(x)), 512);
                    ((last - first) * 1e6).round() as u64
                })
                .collect();
            sizes.dedup();
            sizes.len()
        };
        assert_eq!(sizes(&|_| 3.1), 1);
        // Eight times as wide in the end: twelve steps.
        assert_eq!(sizes(&|x| 1.1 * 8_f64.powf(x / 3.7)), 13);
    }

    #[test]
    fn boxes_without_a_width_have_one() {
        for texels in [1, 2, 512] {
            let (low, high) = snapped((DVec2::ONE, DVec2::ONE), MapSize::square(texels));
            assert!(low.cmple(DVec2::ONE).all() && high.cmpge(DVec2::ONE).all());
            assert!((high - low).min_element() > 0.0 && high.is_finite());
        }
    }
}
