//! Tables in textures, `shaders/lib/tables.wgsl`: a binding of a buffer would hold fewer elements.

use super::device::Gpu;
use crate::error::{Error, Result};
use crate::scene::Scene;
use glam::UVec4;
use rayon::prelude::*;

/// Elements in a row of a table, as in `shaders/lib/tables.wgsl`.
const ROW: usize = 1 << 12;

pub fn new_table(
    gpu: &Gpu,
    what: &str,
    format: wgpu::TextureFormat,
    count: usize,
) -> Result<wgpu::TextureView> {
    let rows = count.div_ceil(ROW) as u64;
    let most = u64::from(gpu.limits.max_texture_dimension_2d);
    if rows > most {
        return Err(Error::Device(format!(
            "the scene's {what} have {count} rows, the device {} allows {}",
            gpu.adapter.name,
            most * ROW as u64
        )));
    }
    let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(what),
        size: wgpu::Extent3d {
            width: ROW as u32,
            height: rows as u32,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
        view_formats: &[],
    });
    Ok(texture.create_view(&wgpu::TextureViewDescriptor::default()))
}

/// The table may have room for more values.
pub fn write_table<T: bytemuck::Pod>(gpu: &Gpu, table: &wgpu::TextureView, mut values: Vec<T>) {
    let rows = table.texture().height() as usize;
    values.resize(rows * ROW, T::zeroed());
    gpu.queue.write_texture(
        table.texture().as_image_copy(),
        bytemuck::cast_slice(&values),
        wgpu::TexelCopyBufferLayout {
            offset: 0,
            bytes_per_row: Some((ROW * size_of::<T>()) as u32),
            rows_per_image: None,
        },
        table.texture().size(),
    );
}

/// A table of these values, or of one zero.
pub fn filled_table<T: bytemuck::Pod>(
    gpu: &Gpu,
    what: &str,
    format: wgpu::TextureFormat,
    values: Vec<T>,
) -> Result<wgpu::TextureView> {
    let table = new_table(gpu, what, format, values.len().max(1))?;
    write_table(gpu, &table, values);
    Ok(table)
}

/// A table of triangles in the order of a search.
pub fn triangle_items(gpu: &Gpu, count: usize) -> Result<wgpu::TextureView> {
    let whole_numbers = wgpu::TextureFormat::Rgba32Uint;
    new_table(gpu, "searched triangles", whole_numbers, count.max(1))
}

/// (vertex, vertex, vertex, triangle) of each.
pub fn write_items(gpu: &Gpu, table: &wgpu::TextureView, scene: &Scene, order: &[u32]) {
    let items = order.par_iter().map(|&t| {
        let [a, b, c] = scene.triangles()[t as usize];
        UVec4::new(a, b, c, t)
    });
    write_table(gpu, table, items.collect());
}
