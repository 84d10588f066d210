//! The search for the light matrix that serves samples best.
//!
//! Hamilton Yu-Ik Chong, Steven J. Gortler. Scene optimized shadow mapping. Harvard University, technical report
//! TR-07-07, 2007, section 2.4.

use super::hull::{Hull, MapFrame, across};
use super::light_matrix::LightMatrix;
use super::light_rays::Sample;
use argmin::core::{CostFunction, Executor};
use argmin::solver::neldermead::NelderMead;
use glam::{DQuat, DVec3};

/// Rotations of the optical axis that an iteration tries, degrees (section 2.4).
const ANGLES: [f64; 9] = [-10.0, 3.0, 5.0, 9.0, 16.0, 23.0, 30.0, 40.0, 50.0];

/// The paper's iterations.
const ITERATIONS: usize = 3;

/// The paper's Algorithm 1, step 4: from an optical axis along the negative gradient, the best of all.
/// `None` where the first axis does not hold the hull; never worse than that axis.
pub fn optimize(
    axis: DVec3,
    hull: &Hull,
    samples: &[Sample],
    frame: MapFrame,
) -> Option<LightMatrix> {
    let mut best = hull.focused_along(axis, frame)?;
    let mut least = best.h(samples);
    for _ in 0..ITERATIONS {
        let down = -best.gradient(samples);
        let Some(rotation_axis) = best.w.cross(down).try_normalize() else {
            break;
        };
        let start = best.w;
        let before = least;
        for degrees in ANGLES {
            let w = DQuat::from_axis_angle(rotation_axis, degrees.to_radians()) * start;
            let Some(candidate) = hull.focused_along(w.normalize(), frame) else {
                continue;
            };
            let h = candidate.h(samples);
            if h < least {
                (best, least) = (candidate, h);
            }
        }
        if least == before {
            break;
        }
    }
    Some(best)
}

/// h over the optical axes around one, as offsets across it.
struct Landscape<'a> {
    axis: DVec3,
    across: [DVec3; 2],
    hull: &'a Hull,
    samples: &'a [Sample],
    frame: MapFrame,
}

impl Landscape<'_> {
    fn matrix(&self, offsets: &[f64]) -> Option<LightMatrix> {
        let [x, y] = self.across;
        let w = self.axis + x * offsets[0] + y * offsets[1];
        self.hull.focused_along(w.try_normalize()?, self.frame)
    }
}

impl CostFunction for Landscape<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, offsets: &Vec<f64>) -> std::result::Result<f64, argmin::core::Error> {
        let matrix = self.matrix(offsets);
        Ok(matrix.map_or(f64::INFINITY, |matrix| matrix.h(self.samples)))
    }
}

/// Steps of the downhill simplex, of one or two axes tried each.
const STEPS: u64 = 25;

/// First side of the downhill simplex, about radians.
const REACH: f64 = 0.1;

/// What a downhill simplex (J. A. Nelder, R. Mead. A simplex method for function minimization. The
/// Computer Journal 7(4), 1965; argmin's) makes of a light matrix; never worse than it.
pub fn descend(
    start: LightMatrix,
    hull: &Hull,
    samples: &[Sample],
    frame: MapFrame,
) -> LightMatrix {
    let landscape = || Landscape {
        axis: start.w,
        across: across(start.w),
        hull,
        samples,
        frame,
    };
    let corners = vec![vec![0.0, 0.0], vec![REACH, 0.0], vec![0.0, REACH]];
    let run = Executor::new(landscape(), NelderMead::new(corners))
        .configure(|state| state.max_iters(STEPS))
        .timer(false)
        .run();
    let found = run
        .ok()
        .and_then(|mut result| result.state.take_best_param());
    let candidate = found.and_then(|offsets| landscape().matrix(&offsets));
    candidate
        .filter(|candidate| candidate.h(samples) < start.h(samples))
        .unwrap_or(start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::fixtures::{FRAME, bundles, camera, seen};

    #[test]
    fn optimized_matrices_hold_every_sample_and_are_not_worse() {
        for pitch in [-0.2, -0.6, 0.0] {
            let camera = camera(pitch);
            let (mut before, mut after, mut lowest) = (0.0, 0.0, 0.0);
            for rays in bundles() {
                let (samples, hull) = seen(&rays, &camera);
                let focused = hull.focused_along(DVec3::Z, FRAME).unwrap();
                let best = optimize(DVec3::Z, &hull, &samples, FRAME).unwrap();
                assert!(best.matrix().is_finite());
                for sample in &samples {
                    let place = best.place(sample.ray);
                    assert!(place.abs().cmple(FRAME.size.middle()).all(), "{place}");
                }
                assert!(best.h(&samples) <= focused.h(&samples));
                let lower = descend(best, &hull, &samples, FRAME);
                assert!(lower.h(&samples) <= best.h(&samples));
                before += focused.h(&samples);
                after += best.h(&samples);
                lowest += lower.h(&samples);
            }
            assert!(lowest < 0.9 * after, "{lowest} {after}");
            assert!(after < 0.8 * before, "{after} {before}");
        }
    }
}
