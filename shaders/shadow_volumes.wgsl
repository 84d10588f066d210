// The shadow of every pixel by counting the faces of shadow volumes beyond its point (Crow 1977), on
// the rasterization hardware.
//
// A triangle, turned to face the light, shades what is behind it: a volume between the triangle, the
// planes through its edges and the light, and infinity. A point is in as many volumes as its line of
// sight leaves, less those that it enters, beyond the point (z-fail: Bilodeau and Songy 1999, Carmack
// 2000), wherever the camera and the light are. The volumes of all triangles are drawn as one:
//
//   light caps   the triangles themselves;
//   sides        of the edges where the triangles, each turned to the light, do not cancel: an edge with
//                any number of triangles counts their sum (Kim, Kim and Turk, "A shadow-volume algorithm
//                for opaque and transparent nonmanifold casters", 2008), so meshes may be open;
//   dark caps    the triangles seen from the light, at infinity: homogeneous points with w = 0 (McGuire et
//                al., "Fast, practical, and robust shadows", 2003). For a light at infinity they are one
//                point, where all sides meet.
//
// Every face is closed by its neighbours with the same corners, so the rasterizer leaves no gap and
// counts no pixel twice. Whether a side is beyond the point is asked of the plane through edge and
// light, where it is decided in float32 relative to the eye, and of no depth buffer. A light cap needs no
// such care: nothing visible is nearer than the point, so a triangle is at the point, or beyond it.
#import lib/invocations
#import lib/receivers
#import lib/triangles
#import lib/unsure
#import lib/pairs

struct ShadowVolumes {
    // The eye relative to the scene's origin, double-single.
    eye_high: vec3<f32>,
    triangle_count: u32,
    eye_low: vec3<f32>,
    edge_count: u32,
    // Rows of the camera's projection, for points relative to the eye.
    clip_x: vec3<f32>,
    far: f32,                   // length of vectors to infinity, world units
    clip_y: vec3<f32>,
    // Of an orthographic camera: the volumes that a line of sight is in at last.
    count_at_infinity: i32,
    clip_w: vec3<f32>,
    padding: u32,
    clip_offset: vec3<f32>,     // of points, to be added to x, y and w
    more_padding: u32,
}

// A side: the edge, and how many volumes it bounds, negative where they lie to its other side.
struct Silhouette {
    edge: u32,
    crossings: i32,
}

struct DrawArguments {
    vertex_count: atomic<u32>,
    instance_count: u32,
    first_vertex: u32,
    first_instance: u32,
}

@group(0) @binding(0) var<uniform> shadow_volumes_uniform: ShadowVolumes;
// (vertex, vertex, first use, uses), and the uses: triangle times two, one more where it is backward.
@group(0) @binding(4) var edges: texture_2d<u32>;
@group(0) @binding(5) var edge_uses: texture_2d<u32>;
// 1 where a triangle's normal is on the light's side, -1 where it is not, 0 where the light is in its plane.
@group(0) @binding(6) var<storage, read_write> sides_of_triangles: array<i32>;
@group(0) @binding(7) var<storage, read> sides: array<i32>;
@group(0) @binding(8) var<storage, read_write> found_silhouettes: array<Silhouette>;
@group(0) @binding(9) var<storage, read> silhouettes: array<Silhouette>;
@group(0) @binding(13) var<storage, read_write> draw_arguments: DrawArguments;
// The visibility buffer, zero where a pixel does not face the light.
@group(0) @binding(14) var<storage, read_write> points: array<Pair>;
@group(0) @binding(15) var<storage, read> asking: array<Pair>;
@group(0) @binding(16) var<storage, read_write> counts: array<atomic<i32>>;
@group(0) @binding(17) var<storage, read_write> visibility: array<u32>;

// 6: two triangles, 3: one, where the light is at infinity.
override vertices_per_side: u32 = 6u;

// The rasterizer rounds corners to a fraction of a pixel, so that a triangle may cover a pixel beyond its
// edge. One that is nearer than the point by this share of the depth is such a triangle.
const NEARER: f32 = 1.0 / 1024.0;

// A triangle is stored with inverted bits, and none has the greatest number.
fn has_point(key: Pair) -> bool {
    return first_of(key) != 0u;
}

// Away from the light.
fn vector_from_light(receivers: Receivers, p: vec3<f32>) -> vec3<f32> {
    return receivers.from_light + receivers.is_local * p;
}

fn offset_of_vertex(volumes: ShadowVolumes, vertex: u32) -> vec3<f32> {
    return offset_from_vertex(vertex, volumes.eye_high, volumes.eye_low);
}

// ---- what is drawn ----

@compute @workgroup_size(8, 8)
fn find_points(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    if invocation.x >= receivers.width || invocation.y >= receivers.height {
        return;
    }
    let receiver = load_receiver(receivers, invocation.x, invocation.y);
    let pixel = invocation.y * receivers.width + invocation.x;
    points[pixel] = select(Pair(), visibility_buffer[pixel], receiver.faces_light);
    leave_open_if(receiver.is_at_rim, pixel, receiver.triangle, NO_CASTER);
}

// One side for a whole triangle, or its volume would not be closed.
@compute @workgroup_size(GROUP)
fn find_sides(invocation: Invocation) {
    let volumes = shadow_volumes_uniform;
    let receivers = receivers_uniform;
    let id = index_of_invocation(invocation, GROUP);
    if id >= volumes.triangle_count {
        return;
    }
    let vertices = vertices_of_triangle(id);
    let a = vector_from_light(receivers, offset_of_vertex(volumes, vertices.x));
    let b = vector_from_light(receivers, offset_of_vertex(volumes, vertices.y));
    let c = vector_from_light(receivers, offset_of_vertex(volumes, vertices.z));
    // By the corner nearest to the light; with the light in a corner there is no volume.
    var nearest = a;
    nearest = select(nearest, b, dot(b, b) < dot(nearest, nearest));
    nearest = select(nearest, c, dot(c, c) < dot(nearest, nearest));
    let side = light_side(id);
    sides_of_triangles[id] = select(side, i32(sign(-dot(normal_of_triangle(id), nearest))), side == FOUND_IN_FLOAT32);
}

@compute @workgroup_size(GROUP)
fn find_silhouettes(invocation: Invocation) {
    let id = index_of_invocation(invocation, GROUP);
    if id >= shadow_volumes_uniform.edge_count {
        return;
    }
    let edge = textureLoad(edges, place_from_index(id), 0);
    var crossings = 0;
    for (var i = edge.z; i < edge.z + edge.w; i += 1u) {
        let triangle = textureLoad(edge_uses, place_from_index(i), 0).x;
        let side = sides[triangle >> 1u];
        crossings += select(side, -side, (triangle & 1u) == 1u);
    }
    if crossings != 0 {
        let slot = atomicAdd(&draw_arguments.vertex_count, vertices_per_side) / vertices_per_side;
        found_silhouettes[slot] = Silhouette(id, crossings);
    }
}

@compute @workgroup_size(1)
fn begin() {
    atomicStore(&draw_arguments.vertex_count, 0u);
    draw_arguments.instance_count = 1u;
    draw_arguments.first_vertex = 0u;
    draw_arguments.first_instance = 0u;
}

// ---- caps ----

// All faces are inside the depth range, so that they are clipped by the image alone; w is zero at infinity.
fn clip_from_vector(volumes: ShadowVolumes, p: vec3<f32>, is_point: bool) -> vec4<f32> {
    let scaled = select(p * (volumes.far / max(length(p), 1e-30)), p, is_point);
    var clip = vec3<f32>(dot(volumes.clip_x, scaled), dot(volumes.clip_y, scaled), dot(volumes.clip_w, scaled));
    if is_orthographic {
        clip += select(vec3<f32>(0.0), volumes.clip_offset, is_point);
    }
    return vec4<f32>(clip.xy, 0.5 * clip.z, clip.z);
}

struct CapCorner {
    @builtin(position) @invariant place: vec4<f32>,
    @location(0) @interpolate(flat) triangle: u32,
    @location(1) depth: f32,
}

fn cap_corner(index: u32, is_dark: bool) -> CapCorner {
    let volumes = shadow_volumes_uniform;
    let triangle = index / 3u;
    let side = sides[triangle];
    let turned = select(index % 3u, 2u - index % 3u, side < 0);
    let p = offset_of_vertex(volumes, vertices_of_triangle(triangle)[turned]);
    let end = select(p, vector_from_light(receivers_uniform, p), is_dark);
    let depth = dot(receivers_uniform.ray_z, p);
    var corner = CapCorner(clip_from_vector(volumes, end, !is_dark), triangle, depth);
    if side == 0 {
        // Outside of the image.
        corner.place = vec4<f32>(2.0, 2.0, 0.5, 1.0);
    }
    return corner;
}

@vertex
fn light_cap(@builtin(vertex_index) index: u32) -> CapCorner {
    return cap_corner(index, false);
}

@vertex
fn dark_cap(@builtin(vertex_index) index: u32) -> CapCorner {
    return cap_corner(index, true);
}

@fragment
fn count_light_cap(cap: CapCorner, @builtin(front_facing) is_front: bool) {
    let place = vec2<u32>(cap.place.xy);
    let pixel = place.y * receivers_uniform.width + place.x;
    let key = asking[pixel];
    let is_own = ~first_of(key) == cap.triangle;
    // The fourth component is one over the depth, unless the camera is orthographic.
    let limit = (1.0 - NEARER) * bitcast<f32>(~second_of(key));
    let is_nearer = select(1.0 < limit * cap.place.w, cap.depth < limit, is_orthographic);
    if has_point(key) && (is_own || !is_nearer) {
        atomicAdd(&counts[pixel], select(1, -1, is_front));
    }
}

// At infinity, and seen from inside where it is turned to the light.
@fragment
fn count_dark_cap(cap: CapCorner, @builtin(front_facing) is_front: bool) {
    let place = vec2<u32>(cap.place.xy);
    let pixel = place.y * receivers_uniform.width + place.x;
    if has_point(asking[pixel]) {
        atomicAdd(&counts[pixel], select(-1, 1, is_front));
    }
}

// ---- sides ----

struct SideCorner {
    @builtin(position) @invariant place: vec4<f32>,
    // The plane through edge and light: outwards for one crossing, not of unit length.
    @location(0) @interpolate(flat) normal: vec3<f32>,
    @location(1) @interpolate(flat) on_plane: vec3<f32>,
    @location(2) @interpolate(flat) crossings: i32,
}

fn of_any_length(v: vec3<f32>) -> vec3<f32> {
    return v / max(max(max(abs(v.x), abs(v.y)), abs(v.z)), 1e-30);
}

@vertex
fn side(@builtin(vertex_index) index: u32) -> SideCorner {
    let volumes = shadow_volumes_uniform;
    let receivers = receivers_uniform;
    let silhouette = silhouettes[index / vertices_per_side];
    let edge = textureLoad(edges, place_from_index(silhouette.edge), 0);
    let a = offset_of_vertex(volumes, edge.x);
    let b = offset_of_vertex(volumes, edge.y);
    // (a, far a, far b), (a, far b, b), seen from outside against the clock.
    let corner = index % vertices_per_side + 6u - vertices_per_side;
    let is_of_a = corner == 0u || corner == 1u || corner == 3u;
    let is_point = corner == 0u || corner == 3u || corner == 5u;
    let p = select(b, a, is_of_a);
    let end = select(vector_from_light(receivers, p), p, is_point);
    let away = of_any_length(vector_from_light(receivers, a));
    return SideCorner(
        clip_from_vector(volumes, end, is_point),
        cross(away, of_any_length(b - a)),
        a,
        silhouette.crossings,
    );
}

@fragment
fn count_side(side: SideCorner, @builtin(front_facing) is_front: bool) {
    let receivers = receivers_uniform;
    let place = vec2<u32>(side.place.xy);
    let pixel = place.y * receivers.width + place.x;
    let key = asking[pixel];
    let xy = side.place.xy - receivers.centre;
    let point = point_on_ray(receivers, xy, camera_ray(receivers, xy), bitcast<f32>(~second_of(key)));
    let is_inside = dot(side.normal, point - side.on_plane) <= 0.0;
    // A line of sight enters a front beyond the point if the point is outside of its plane, and leaves a
    // back beyond the point if it is inside.
    if has_point(key) && is_inside != is_front {
        atomicAdd(&counts[pixel], select(side.crossings, -side.crossings, is_front));
    }
}

// ---- the answer ----

@compute @workgroup_size(8, 8)
fn answer(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    if invocation.x >= receivers.width || invocation.y >= receivers.height {
        return;
    }
    let pixel = invocation.y * receivers.width + invocation.x;
    let is_seen = has_point(visibility_buffer[pixel]);
    let count = atomicLoad(&counts[pixel]) + shadow_volumes_uniform.count_at_infinity;
    let is_lit = has_point(asking[pixel]) && count <= 0;
    visibility[pixel] = select(NO_SURFACE, select(IN_SHADOW, LIT, is_lit), is_seen);
}
