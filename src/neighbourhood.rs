//! What the texels around a receiver say of it together: twin of functions of `shaders/lookup.wgsl`, which argues for
//! the numbers. A bit stands for each texel, row by row.

/// What share of the depth tests must agree, each by its bilinear weight; and where triangles are smaller than texels.
const AGREEING: f32 = 0.9;
const AGREEING_OF_SMALL: f32 = 0.6;

/// The bits of a receiver's own texel and of those beside it.
const NINE: u32 = 0x1ff;
const NINE_OF_25: u32 = 0x0007_39c0;

/// The texels around a receiver, so many on each side.
#[derive(Debug, Clone, Copy)]
pub struct Around {
    pub reach: usize,
    /// That are on the map and before the receiver's surface.
    pub texels: u32,
    /// Of these, that hold something before the receiver's plane.
    pub nearer: u32,
    /// That hold a triangle that was seen before.
    pub known: u32,
}

impl Around {
    /// Whether depths say that the receiver is in shadow. It lies so far aside of the middle of its own texel.
    pub fn is_behind(&self, aside: [f32; 2]) -> bool {
        let nine = if self.reach == 2 { NINE_OF_25 } else { NINE };
        let count = |bits: u32| (bits & nine).count_ones();
        let ninths = 9 * count(self.nearer) / count(self.texels).max(1);
        let are_small = self.nearer & self.known & nine == 0 && ninths >= 6;
        let agreeing = match are_small {
            true => AGREEING_OF_SMALL,
            false => AGREEING,
        };
        let share = |bits| bilinear_share(bits, aside, self.reach);
        ninths >= 4 && share(self.nearer) >= agreeing * share(self.texels)
    }
}

/// The weight of the texels whose bits are set, of which only the four around the receiver have any.
pub fn bilinear_share(bits: u32, aside: [f32; 2], reach: usize) -> f32 {
    let side = 2 * reach as i32 + 1;
    let middle = reach as i32 * (side + 1);
    let step = |aside: f32| (if aside > 0.0 { 1 } else { -1 }) * reach.min(1) as i32;
    let (beside, above) = (step(aside[0]), step(aside[1]) * side);
    let [x, y] = aside.map(|a| a.abs().min(0.5));
    let weight = |place: i32| (bits >> place & 1) as f32;
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let near = mix(weight(middle), weight(middle + beside), x);
    let far = mix(weight(middle + above), weight(middle + above + beside), x);
    mix(near, far, y)
}
