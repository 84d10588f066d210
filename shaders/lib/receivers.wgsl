// Receivers: what the camera sees, one point for each pixel, from the visibility buffer.
#import lib/normals

struct Receivers {
    // The camera's rays in world axes: ray(x, y) = ray_x * x + ray_y * y + ray_z in centred pixels.
    ray_x: vec3<f32>,
    width: u32,
    ray_y: vec3<f32>,
    height: u32,
    ray_z: vec3<f32>,
    rounding: f32,              // bound of the rounding error of a light-space position, world units
    centre: vec2<f32>,          // of the image, in pixels
    constant_bias: f32,         // world units
    slope_bias: f32,            // texels
    light_direction: vec3<f32>, // from the light towards the scene
    receiver_plane: f32,        // 1: compare with the receiver's plane on the texel's ray, 0: with the receiver
    // Rows of the affine map from camera projection space to the light's projection space.
    light_x: vec4<f32>,
    light_y: vec4<f32>,
    light_z: vec4<f32>,
}

// Load it once, before any loop, and pass it on: a software driver reads a uniform anew at each use.
@group(0) @binding(20) var<uniform> receivers_uniform: Receivers;
// Depth (high half) and triangle with inverted bits, as the rasterizer stores them; 0 where nothing is
// seen. One 64-bit load costs what a 32-bit one does.
@group(0) @binding(21) var<storage, read> visibility_buffer: array<u64>;

struct Receiver {
    is_seen: bool,
    faces_light: bool,
    q: vec3<f32>,               // position in the light's projection space
    normal: vec3<f32>,          // unit, in world axes, by the triangle's winding
    ray: vec3<f32>,             // from the camera, 1 along its viewing direction
    depth: f32,                 // along the viewing direction
    triangle: u32,
}

// `column` and `row` of a pixel inside the image.
fn load_receiver(receivers: Receivers, column: u32, row: u32) -> Receiver {
    let pixel = row * receivers.width + column;
    let key = ~visibility_buffer[pixel];
    let triangle = u32(key & 0xfffffffflu);
    var receiver: Receiver;
    receiver.is_seen = triangle != 0xffffffffu;
    if receiver.is_seen {
        let normal = normal_of_triangle(triangle);
        let xy = vec2<f32>(f32(column), f32(row)) + 0.5 - receivers.centre;
        let ray = receivers.ray_x * xy.x + receivers.ray_y * xy.y + receivers.ray_z;
        // The camera and the light see the same side of the triangle.
        receiver.faces_light = dot(normal, ray) * dot(normal, receivers.light_direction) > 0.0;
        let z = bitcast<f32>(u32(key >> 32u));
        let q = vec4<f32>(xy * z, z, 1.0);
        receiver.q = vec3<f32>(dot(receivers.light_x, q), dot(receivers.light_y, q), dot(receivers.light_z, q));
        receiver.normal = normal;
        receiver.ray = ray;
        receiver.depth = z;
        receiver.triangle = triangle;
    }
    return receiver;
}
