//! Pass "receivers": the box around the receivers that face the light, in texels and depth of a
//! projection, by a parallel reduction.

use super::inputs::Receivers;
use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::recording::{Read, Recording, Source};
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;
use glam::{DVec3, Vec3};

pub const LABEL: &str = "receivers";

shader_struct! {
    pub struct Bounds is Bounds in "receivers" {
        extremes: [u32; 6],
        /// Pixels whose surface faces the light.
        pub facing: u32,
    }
}

impl Bounds {
    /// Least and greatest corner, (x, y) in centred texels and depth in the projection's `unit`; `None`
    /// where no receiver faces the light.
    pub fn corners(&self) -> Option<(DVec3, DVec3)> {
        if self.facing == 0 {
            return None;
        }
        let [x, y, z, u, v, w] = self.extremes.map(float_from_ordered);
        let low = -Vec3::new(x, y, z);
        Some((low.as_dvec3(), Vec3::new(u, v, w).as_dvec3()))
    }
}

fn float_from_ordered(bits: u32) -> f32 {
    f32::from_bits(if bits >> 31 == 1 {
        bits & 0x7fff_ffff
    } else {
        !bits
    })
}

/// The size and the centre of the projection play no part.
pub fn receivers(
    frame: &mut Recording,
    seen: Receivers,
    projection: &Projection,
) -> Result<Read<Bounds>> {
    let bounds = frame.storage("receiver bounds", size_of::<Bounds>() as u64)?;
    frame.clear(&bounds);
    // Rows that an invocation reduces before its workgroup does.
    let rows = frame.gpu.work_per_invocation(16, 32);
    let kernel = Kernel::new("receivers")
        .projection(0, projection, seen.scene.origin)
        .bind(1, &bounds)
        .receivers(seen, &seen.uniform(projection))
        .tiles(seen, rows);
    frame.pass(LABEL, &[kernel.dispatch(seen.groups(rows))]);
    frame.read(Source::Taken(bounds), 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As `ordered_from_float` in the shader.
    fn ordered_from_float(value: f32) -> u32 {
        let bits = value.to_bits();
        if bits >> 31 == 1 {
            !bits
        } else {
            bits | 0x8000_0000
        }
    }

    #[test]
    fn ordered_integers_keep_the_order_of_floats_and_come_back() {
        let values = [
            -f32::MAX,
            -2.5,
            -f32::MIN_POSITIVE,
            0.0,
            1e-30,
            1.0,
            f32::MAX,
        ];
        for pair in values.windows(2) {
            assert!(ordered_from_float(pair[0]) < ordered_from_float(pair[1]));
        }
        for value in values {
            assert_eq!(float_from_ordered(ordered_from_float(value)), value);
            assert!(
                ordered_from_float(value) > 0,
                "zero means that there is none"
            );
        }
    }
}
