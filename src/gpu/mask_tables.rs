//! Masks on the device, as `shaders/mask/alpha.wgsl` reads them.

use super::device::Gpu;
use super::kernel::Kernel;
use super::tables::filled_table;
use crate::error::Result;
use crate::masks::{AlphaImage, Mask, Masks, Sampling, Wrap};
use glam::{DVec2, UVec4};
use rayon::prelude::*;
use wgpu::TextureFormat::{R32Uint, Rgba32Uint};

/// Rows of an image, and of a masked triangle, in the table of corners.
const ROWS_OF_IMAGE: usize = 2;
const ROWS_OF_TRIANGLE: usize = 3;

pub struct MaskTables {
    numbers: wgpu::TextureView,
    corners: wgpu::TextureView,
    texels: wgpu::TextureView,
}

impl MaskTables {
    pub fn new(gpu: &Gpu, masks: &Masks) -> Result<Self> {
        let mut rows = Vec::new();
        let mut bytes = Vec::new();
        for image in masks.images() {
            rows.extend(rows_of_image(image, bytes.len()));
            bytes.extend_from_slice(&image.texels);
        }
        bytes.resize(bytes.len().next_multiple_of(4), 0);
        let words = bytes.as_chunks::<4>().0.par_iter();
        let words = words.map(|bytes| u32::from_le_bytes(*bytes)).collect();
        drop(bytes);
        let first = rows.len();
        for (image, mask) in masks.masked() {
            rows.extend(rows_of_triangle(&mask, ROWS_OF_IMAGE * image));
        }
        let numbers = masks.numbers().map(|number| match number {
            Some(number) => (first + ROWS_OF_TRIANGLE * number) as u32,
            None => 0,
        });
        Ok(Self {
            numbers: filled_table(gpu, "numbers of masks", R32Uint, numbers.collect())?,
            corners: filled_table(gpu, "corners of masks", Rgba32Uint, rows)?,
            texels: filled_table(gpu, "alpha images", R32Uint, words)?,
        })
    }
}

fn rows_of_image(image: &AlphaImage, first: usize) -> [UVec4; ROWS_OF_IMAGE] {
    let [along_u, along_v] = image.wraps.map(|wrap| match wrap {
        Wrap::Repeat => 0,
        Wrap::Mirror => 1,
        Wrap::Clamp => 2,
    });
    let cutoff = (image.cutoff as f32).to_bits();
    [
        UVec4::new(
            first as u32,
            image.width,
            image.height,
            along_u | along_v << 2,
        ),
        UVec4::new(cutoff, u32::from(image.sampling == Sampling::Nearest), 0, 0),
    ]
}

/// Whole repetitions are taken off, so that float32 need not hold them.
fn rows_of_triangle(mask: &Mask, image_row: usize) -> [UVec4; ROWS_OF_TRIANGLE] {
    let image = mask.image;
    let period = |wrap: Wrap, count: u32| match wrap {
        Wrap::Repeat => f64::from(count),
        Wrap::Mirror => f64::from(2 * count),
        Wrap::Clamp => f64::INFINITY,
    };
    let [along_u, along_v] = image.wraps;
    let period = DVec2::new(period(along_u, image.width), period(along_v, image.height));
    let least = mask.corners.iter().map(|corner| corner.truncate());
    let least = least.fold(DVec2::INFINITY, DVec2::min);
    let whole = |least: f64, period: f64| match period.is_finite() {
        true => (least / period).floor() * period,
        false => 0.0,
    };
    let off = DVec2::new(whole(least.x, period.x), whole(least.y, period.y)).extend(0.0);
    mask.corners.map(|corner| {
        let [x, y, factor] = (corner - off).as_vec3().to_array().map(f32::to_bits);
        UVec4::new(x, y, factor, image_row as u32)
    })
}

impl Kernel {
    /// Binds which triangles are masked.
    pub fn mask_numbers(self, masks: Option<&MaskTables>) -> Self {
        match masks {
            Some(masks) => self.bind(23, &masks.numbers),
            None => self,
        }
    }

    /// Binds all of the masks.
    pub fn masks(self, masks: Option<&MaskTables>) -> Self {
        let kernel = self.mask_numbers(masks);
        match masks {
            Some(masks) => kernel.bind(24, &masks.corners).bind(25, &masks.texels),
            None => kernel,
        }
    }
}
