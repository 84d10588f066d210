//! What was found of triangles that were asked for before.

use super::rasterize::NONE;

/// Each at the rest of its number by `N`.
pub struct Known<T, const N: usize>([(u32, T); N]);

impl<T: Copy + Default, const N: usize> Default for Known<T, N> {
    fn default() -> Self {
        Self([(NONE, T::default()); N])
    }
}

impl<T, const N: usize> Known<T, N> {
    #[inline(always)]
    pub fn get(&mut self, triangle: u32, find: impl FnOnce() -> T) -> &T {
        let known = &mut self.0[triangle as usize % N];
        if known.0 != triangle {
            *known = (triangle, find());
        }
        &known.1
    }
}
