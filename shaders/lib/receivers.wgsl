// Receivers: what the camera sees, one point for each pixel, from the visibility buffer.
#import lib/light_sides
#import lib/normals
#import lib/rounding
#import lib/pairs

struct Receivers {
    // The camera's rays in world axes: ray(x, y) = ray_x * x + ray_y * y + ray_z in centred pixels, times the depth. Of an
    // orthographic camera only the last term is.
    ray_x: vec3<f32>,
    width: u32,
    ray_y: vec3<f32>,
    height: u32,
    ray_z: vec3<f32>,
    rounding: f32,              // bound of the rounding error of a light-space position, world units
    centre: vec2<f32>,          // of the image, in pixels
    constant_bias: f32,         // world units
    slope_bias: f32,            // texels
    // From the light to a receiver: this, plus the receiver relative to the eye where `is_local` is 1.
    from_light: vec3<f32>,
    is_local: f32,
    cone_axis: vec3<f32>,       // the light reaches directions within its cone
    cone_cosine: f32,
    // Which receivers the layer is for: half-spaces, (normal, offset), in world axes relative to the eye.
    region: array<vec4<f32>, 5>,
    beam_bias: f32,             // world units per growth of a texel's beam
    receiver_plane: f32,        // 1: compare with the receiver's plane on the texel's ray, 0: with the receiver
    filter_radius: f32,         // of percentage closer filtering: texels of the warped map, or world units
    cone_at_eye: f32,           // how far the eye is inside the cone, see `depth_in_cone`
    eye_from_axis: vec3<f32>,   // of the cone
    cone_sine: f32,
    margin: f32,                // what rounding may move a position across its surface, world units
    padding: f32,
    more_padding: vec2<f32>,
    // Rows of the affine map from camera projection space to the light's projection space.
    light_x: vec4<f32>,
    light_y: vec4<f32>,
    light_z: vec4<f32>,
}

// Load it once, before any loop, and pass it on: a software driver reads a uniform anew at each use.
@group(0) @binding(20) var<uniform> receivers_uniform: Receivers;
// Depth (high half) and triangle with inverted bits, as the rasterizer stores them; 0 where nothing is
// seen.
@group(0) @binding(21) var<storage, read> visibility_buffer: array<Pair>;

// True where the light has a cone, and where the layer is not for all receivers.
override has_cone: bool = false;
override has_region: bool = false;

// Whether the camera's rays are parallel.
override is_orthographic: bool = false;

struct Receiver {
    is_seen: bool,
    // Whether it is to be tested: it faces the light, is in its cone and in the layer's region.
    faces_light: bool,
    is_at_rim: bool,            // of the light's cone, within rounding: float64 knows on which side
    q: vec3<f32>,               // position in the light's projection space
    normal: vec3<f32>,          // unit, in world axes, by the triangle's winding
    ray: vec3<f32>,             // from the camera, 1 along its viewing direction
    point: vec3<f32>,           // in world axes relative to the eye
    from_light: vec3<f32>,      // in world axes; a unit vector where the light is at infinity
    depth: f32,                 // along the viewing direction
    triangle: u32,
}

// What a visibility image holds, as bits: compilers may take it that no float is a NaN.
const NO_SURFACE: u32 = 0x7fc00000u;   // a quiet NaN
const LIT: u32 = 0x3f800000u;           // 1
const IN_SHADOW: u32 = 0u;

// How far a point is inside the cone's surface: what it is for the eye, and what a step from there adds. Of a light far
// away, or a narrow cone, both are small differences of large distances.
fn depth_in_cone(receivers: Receivers, from_eye: vec3<f32>) -> f32 {
    let along = dot(from_eye, receivers.cone_axis);
    let step_aside = from_eye - along * receivers.cone_axis;
    let from_axis = receivers.eye_from_axis + step_aside;
    let sum = max(length(receivers.eye_from_axis) + length(from_axis), 1e-30);
    let aside = dot(step_aside / sum, receivers.eye_from_axis + from_axis);
    return receivers.cone_at_eye + receivers.cone_sine * along - receivers.cone_cosine * aside;
}

// How many times as wide as at a depth of 1 the camera's image is.
fn image_width_at(depth: f32) -> f32 {
    return select(depth, 1.0, is_orthographic);
}

// The camera's ray at a centred place of the image, 1 along the viewing direction.
fn camera_ray(receivers: Receivers, place: vec2<f32>) -> vec3<f32> {
    if is_orthographic {
        return receivers.ray_z;
    }
    return receivers.ray_x * place.x + receivers.ray_y * place.y + receivers.ray_z;
}

// The point on it at a depth, relative to the eye.
fn point_on_ray(receivers: Receivers, place: vec2<f32>, ray: vec3<f32>, depth: f32) -> vec3<f32> {
    if is_orthographic {
        return receivers.ray_x * place.x + receivers.ray_y * place.y + ray * depth;
    }
    return ray * depth;
}

// `column` and `row` of a pixel inside the image.
fn load_receiver(receivers: Receivers, column: u32, row: u32) -> Receiver {
    let pixel = row * receivers.width + column;
    let key = visibility_buffer[pixel];
    let triangle = ~first_of(key);
    var receiver: Receiver;
    receiver.is_seen = triangle != 0xffffffffu;
    if receiver.is_seen {
        let normal = normal_of_triangle(triangle);
        let xy = vec2<f32>(f32(column), f32(row)) + 0.5 - receivers.centre;
        let ray = camera_ray(receivers, xy);
        let z = bitcast<f32>(~second_of(key));
        let from_eye = point_on_ray(receivers, xy, ray, z);
        let from_light = receivers.from_light + receivers.is_local * from_eye;
        // The camera and the light see the same side of the triangle.
        let side = light_side(triangle);
        let away_from_light = select(-f32(side), dot(normal, from_light), side == FOUND_IN_FLOAT32);
        receiver.faces_light = dot(normal, ray) * away_from_light > 0.0;
        if has_cone {
            let inside = depth_in_cone(receivers, from_eye);
            // Seen along its plane a receiver moves farther.
            let moved = length(from_eye) * (1.0 + length(ray) / max(abs(dot(normal, ray)), 1e-30));
            let room = 4.0 * ROUNDING * (moved + abs(receivers.cone_at_eye));
            receiver.is_at_rim = receiver.faces_light && abs(inside) <= room;
            receiver.faces_light = receiver.faces_light && inside >= -room;
        }
        if has_region {
            let point = vec4<f32>(from_eye, 1.0);
            let sides = vec4<f32>(
                dot(receivers.region[0], point),
                dot(receivers.region[1], point),
                dot(receivers.region[2], point),
                dot(receivers.region[3], point),
            );
            let is_inside = all(sides >= vec4<f32>(0.0)) && dot(receivers.region[4], point) >= 0.0;
            receiver.faces_light = receiver.faces_light && is_inside;
        }
        let q = vec4<f32>(xy * image_width_at(z), z, 1.0);
        receiver.q = vec3<f32>(dot(receivers.light_x, q), dot(receivers.light_y, q), dot(receivers.light_z, q));
        receiver.normal = normal;
        receiver.ray = ray;
        receiver.point = from_eye;
        receiver.from_light = from_light;
        receiver.depth = z;
        receiver.triangle = triangle;
    }
    return receiver;
}
