// The light's grid: receivers are listed in its texels, casters look for them there.
//
// Grid space: axes of unit length relative to the eye, the third one towards the light. A receiver and a
// caster are put into grid space alike, and all that is decided there is decided with room for `rounding`.
#import lib/triangles
#import lib/pairs

struct LightGrid {
    x_axis: vec3<f32>,
    rounding: f32,              // of a position in grid space, world units
    y_axis: vec3<f32>,
    z_near: f32,                // casters are cut there, where they are not at the light, world units
    z_axis: vec3<f32>,
    size: u32,                  // texels along each side
    light: vec3<f32>,           // of a local light, in grid space; of one far away, see `slope_of_ray`
    tiles: u32,                 // along each side
    // Texels from grid space, or from slopes where the light is local.
    scale: vec2<f32>,
    offset: vec2<f32>,
    // The eye relative to the scene's origin, double-single.
    eye_high: vec3<f32>,
    end_triangle: u32,
    eye_low: vec3<f32>,
    coarse_shift: u32,          // binary logarithm of the side of a coarse tile
    first_row: u32,             // of the image's rows in the lists
    row_count: u32,
    map_size: u32,              // texels along each side of the shadow map
    first_triangle: u32,        // of those that are taken as casters now
}

@group(0) @binding(0) var<uniform> light_grid_uniform: LightGrid;

// Whether the light is at a point, and whether at one so far away that rays are nearly parallel.
override is_local: bool = false;
override is_far_away: bool = false;

// Texels along the side of a tile.
const GRID_TILE_SHIFT: u32 = 4u;

fn grid_from_offset(grid: LightGrid, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(grid.x_axis, p), dot(grid.y_axis, p), dot(grid.z_axis, p));
}

// How far the ray through a point goes aside per unit towards the light. Of a light far away, x and y are that of the
// ray through the eye, and z is one over how far the light is from the eye.
fn slope_of_ray(grid: LightGrid, q: vec3<f32>) -> vec2<f32> {
    if is_local {
        return (grid.light.xy - q.xy) / (grid.light.z - q.z);
    }
    if is_far_away {
        return (grid.light.xy - grid.light.z * q.xy) / (1.0 - grid.light.z * q.z);
    }
    return vec2<f32>(0.0);
}

// Before the warp, in texels.
fn linear_from_grid(grid: LightGrid, q: vec3<f32>) -> vec2<f32> {
    if is_local {
        return (q.xy - grid.light.xy) / (grid.light.z - q.z) * grid.scale + grid.offset;
    }
    if is_far_away {
        return (q.xy - grid.light.xy * q.z) / (1.0 - grid.light.z * q.z) * grid.scale + grid.offset;
    }
    return q.xy * grid.scale + grid.offset;
}

fn corners_in_grid(grid: LightGrid, id: u32) -> array<vec3<f32>, 3> {
    let vertices = vertices_of_triangle(id);
    return array<vec3<f32>, 3>(
        grid_from_offset(grid, offset_from_vertex(vertices.x, grid.eye_high, grid.eye_low)),
        grid_from_offset(grid, offset_from_vertex(vertices.y, grid.eye_high, grid.eye_low)),
        grid_from_offset(grid, offset_from_vertex(vertices.z, grid.eye_high, grid.eye_low)),
    );
}
