// Of each receiver of a map the level that it looks into: the coarsest whose texels are no larger than its pixel.
#import lib/receivers
#import lib/image_tiles
#import lib/footprint

struct PageLevels {
    image: Density,
    map: Density,
    first_number: u32,                  // of the map's levels among those of all maps, from 1 on
    least_texels: f32,                  // no pixel is taken for a smaller one
    padding: vec2<f32>,
    // Four by four, the least areas in texels of the finest level of what looks into each coarser one.
    least: array<vec4<f32>, 3>,
}

@group(0) @binding(0) var<uniform> page_levels: PageLevels;
// Zero where none is chosen yet. Where several maps meet the first one is.
@group(0) @binding(1) var<storage, read_write> level_of_pixel: array<u32>;

@compute @workgroup_size(IMAGE_TILE.x)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let levels = page_levels;
    let first = first_pixel(group, local);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        let pixel = row * receivers.width + first.x;
        if first.x < receivers.width && row < receivers.height && level_of_pixel[pixel] == 0u {
            let receiver = load_receiver(receivers, first.x, row);
            if receiver.faces_light {
                let point = receiver.point;
                let texels = texels_of_pixel(levels.image, levels.map, receiver.ray, receiver.from_light, point);
                level_of_pixel[pixel] = levels.first_number + level_of_texels(levels, texels);
            }
        }
    }
}

// How many levels are finer than the one for a pixel of so many texels.
fn level_of_texels(levels: PageLevels, texels: f32) -> u32 {
    let area = vec4<f32>(max(texels, levels.least_texels));
    let one = vec4<u32>(1u);
    let finer = select(vec4<u32>(0u), one, levels.least[0] <= area)
        + select(vec4<u32>(0u), one, levels.least[1] <= area)
        + select(vec4<u32>(0u), one, levels.least[2] <= area);
    return finer.x + finer.y + finer.z + finer.w;
}
