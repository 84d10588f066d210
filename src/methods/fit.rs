//! Fits of one map to the receivers: the step before a map or a warp.

use super::View;
use super::desired_view::fit_receivers;
use super::parallel_fit::axes_at;
use super::parameters::Value;
use crate::error::Result;
use crate::geometry::smallest_rectangle;
use crate::light::Light;
use crate::passes::outline::Points;
use crate::projection::Projection;
use glam::{DMat2, DVec2};

/// How a map is turned around the light's direction, before its sides are fitted to the receivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The world's Y is up in the map.
    DesiredView,
    /// As the smallest rectangle around the receivers.
    MinSm,
    /// Along the principal axes of the receivers.
    PrincipalAxes,
}

impl Fit {
    pub const NAME: &'static str = "fit";

    pub const CHOICES: &'static [(&'static str, Self)] = &[
        ("desired_view", Self::DesiredView),
        ("min_sm", Self::MinSm),
        ("principal_axes", Self::PrincipalAxes),
    ];

    pub fn default_value() -> Value {
        Value::Text("desired_view".to_string())
    }

    /// The map around the receivers that face the light, `None` where there are none. Submits what was
    /// recorded so far.
    pub fn fit(self, view: &mut View, resolution: u32) -> Result<Option<Projection>> {
        let Light::Directional { direction } = *view.light;
        // Around the eye float32 resolves what the camera sees best.
        let mut axes = axes_at(view.camera.eye, direction);
        let turn = match self {
            Self::DesiredView => DVec2::X,
            Self::MinSm => {
                let points = view.outline(&axes, Points::Extremes)?;
                smallest_rectangle(&points).map_or(DVec2::X, |rectangle| rectangle.axis)
            }
            Self::PrincipalAxes => principal_axis(&view.outline(&axes, Points::Samples)?),
        };
        // Less than a quarter of a turn, so that no map lies on its side or its head without a need.
        let turn = quarter_turned(turn);
        let (right, down) = (axes.x_axis, axes.y_axis);
        axes.x_axis = right * turn.x + down * turn.y;
        axes.y_axis = down * turn.x - right * turn.y;
        fit_receivers(view, &axes, resolution)
    }
}

/// The direction turned by the quarters that bring it nearest to x.
fn quarter_turned(direction: DVec2) -> DVec2 {
    let turned = if direction.x.abs() < direction.y.abs() {
        direction.perp()
    } else {
        direction
    };
    if turned.x < 0.0 { -turned } else { turned }
}

/// The direction along which points scatter most; x where there is none.
fn principal_axis(points: &[DVec2]) -> DVec2 {
    let mean = points.iter().sum::<DVec2>() / (points.len().max(1) as f64);
    let covariance = points.iter().fold(DMat2::ZERO, |sum, &point| {
        let offset = point - mean;
        sum + DMat2::from_cols(offset * offset.x, offset * offset.y)
    });
    let difference = covariance.x_axis.x - covariance.y_axis.y;
    DVec2::from_angle(0.5 * (2.0 * covariance.x_axis.y).atan2(difference))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_principal_axis_is_that_of_a_long_row() {
        for turn in -8..8 {
            let axis = DVec2::from_angle(f64::from(turn) * 0.19);
            let points: Vec<_> = (0..60)
                .map(|i| DVec2::splat(5.0) + axis * f64::from(i) + axis.perp() * f64::from(i % 3))
                .collect();
            assert!(principal_axis(&points).dot(axis).abs() > 0.999);
            assert!(quarter_turned(axis).x >= 0.7);
        }
        assert_eq!(principal_axis(&[]), DVec2::X);
        assert_eq!(principal_axis(&[DVec2::ONE]), DVec2::X);
    }
}
