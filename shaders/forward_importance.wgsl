// Importance of the cells of a grid over the light's map, from what the light sees (Rosen, "Rectilinear
// texture warping", forward analysis): the greatest of the texels of a depth image in each cell.
#import projection
#import stored
#import lib/importance
#import lib/normals

struct Forward {
    // Rows of the affine map from the light's projection space to the camera's.
    camera_x: vec4<f32>,
    camera_y: vec4<f32>,
    camera_z: vec4<f32>,
    // The camera in the light's projection space: the eye and 1, or the way that an orthographic one looks and 0.
    eye: vec4<f32>,
    centre: vec2<f32>,                  // of the camera's image, in pixels
    image: vec2<f32>,                   // width, height in pixels
    near: f32,
    far: f32,
    cells: u32,
    normal_bonus: f32,                  // Rosen's beta
    map_weights: vec2<u32>,             // columns, rows
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> forward_uniform: Forward;
@group(0) @binding(2) var<storage, read_write> importance_map: array<atomic<u32>>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let projection = projection_uniform;
    let forward = forward_uniform;
    if invocation.x >= projection.size.x {
        return;
    }
    let texel = invocation.y * projection.size.x + invocation.x;
    let stored = load_stored(texel);
    if stored.triangle == NO_TRIANGLE {
        return;
    }
    let place = vec2<f32>(invocation.xy) + 0.5;
    let depth = z_from_stored(projection, stored.depth);
    let q = projected_from_ray(projection, ray_from_texel(projection, place - projection.centre), depth);
    let point = vec4<f32>(q, 1.0);
    let z = dot(forward.camera_z, point);
    let width = select(1.0, z, forward.eye.w > 0.0);
    let pixel = vec2<f32>(dot(forward.camera_x, point), dot(forward.camera_y, point)) / width + forward.centre;
    // Desired view (5.1).
    if z <= forward.near || z > forward.far || any(pixel < vec2<f32>(0.0)) || any(pixel > forward.image) {
        return;
    }
    var cosine = 0.0;
    if uses_normal {
        let normal = projected_from_normal(projection, normal_of_triangle(stored.triangle));
        // In world axes: the steps take the covector back.
        let from_eye = q * forward.eye.w - forward.eye.xyz;
        let world = projection.step_x.xyz * from_eye.x + projection.step_y.xyz * from_eye.y
            + projection.step_z.xyz * from_eye.z;
        cosine = abs(dot(normal, from_eye)) / max(length(world), 1e-30);
    }
    var value = importance_of_surface(width, texel_width(projection, q), cosine, forward.normal_bonus);
    let uv = place / vec2<f32>(projection.size);
    if uses_shadow_edge {
        value *= shadow_edges[texel];
    }
    value *= weight_of_place(uv, forward.map_weights);
    let cell = vec2<u32>(uv * f32(forward.cells));
    // Positive floats are ordered as their bits are.
    atomicMax(&importance_map[cell.y * forward.cells + cell.x], bitcast<u32>(value));
}
