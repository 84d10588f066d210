// A projection takes a point to (texel, depth) and a texel to its ray. Both directions are pure
// functions; the parts that differ between kinds of projection are in projection/*.wgsl. A ray is a
// direction in projection space such that a point is its depth times the ray; for parallel rays it is
// (x, y, 1), where they meet the plane q.z = 1.
//
// Coordinates of a point in *projection space*: q = (x_axis.p, y_axis.p, z_axis.p), p relative to the
// projection's origin. Texel coordinates have their origin at the top left corner of the map, y down;
// *centred* ones are relative to `centre`, which keeps float32 precise in the middle of the map.
#import lib/rounding

struct Projection {
    origin_high: vec3<f32>,     // relative to the scene's origin, as a double-single number
    depth_offset: f32,          // stored depth = (q.z - depth_offset) * depth_scale
    origin_low: vec3<f32>,
    depth_scale: f32,
    x_axis: vec3<f32>,
    z_min: f32,                 // q.z outside [z_min, z_max] is not stored
    y_axis: vec3<f32>,
    z_max: f32,
    z_axis: vec3<f32>,
    least_w: f32,               // of a homography's map: nothing in it is nearer to the horizon
    centre: vec2<f32>,
    size: vec2<u32>,            // width, height in texels
    scale: vec2<f32>,           // texels per unit of a paraboloid's plane
    convergence: f32,           // of rays that are nearly parallel: one over how far before the origin they meet
    z_floor: f32,               // casters that are nearer are drawn here, of rays without an origin
    // World vectors of a unit step along each axis of projection space.
    step_x: vec4<f32>,
    step_y: vec4<f32>,
    step_z: vec4<f32>,
    // Rows of a homography: from (q.x, q.y, 1) to a homogeneous centred texel, and back.
    texel_from_place: array<vec4<f32>, 3>,
    place_from_texel: array<vec4<f32>, 3>,
}

// Whether the convergence may be above zero. Pipelines of parallel rays are spared it.
override converges: bool = true;

// Farther than any depth.
const FAR: f32 = 3e38;

// A box of centred texels.
struct Extent {
    low: vec2<f32>,
    high: vec2<f32>,
}

fn stored_depth(projection: Projection, z: f32) -> f32 {
    return (z - projection.depth_offset) * projection.depth_scale;
}

fn z_from_stored(projection: Projection, depth: f32) -> f32 {
    return depth / projection.depth_scale + projection.depth_offset;
}

fn projected_from_offset(projection: Projection, p: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(projection.x_axis, p),
        dot(projection.y_axis, p),
        dot(projection.z_axis, p),
    );
}

// A plane's normal as a covector of projection space.
fn projected_from_normal(projection: Projection, normal: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        dot(normal, projection.step_x.xyz),
        dot(normal, projection.step_y.xyz),
        dot(normal, projection.step_z.xyz),
    );
}
