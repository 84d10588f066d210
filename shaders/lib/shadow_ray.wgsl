// One receiver's own light ray against one triangle: what float32 knows of it. Twin of src/shadow_ray.rs.
//
// Everything is relative to the receiver, in axes whose third one goes towards the light. Each coordinate of the
// corners may be off by `room`: what float32 rounds of them, and of the receiver. So a triangle is met for sure, or
// for sure not, or it is left open; what is left open is decided in float64.
//
// After Woop, Benthin and Wald, "Watertight ray/triangle intersection", JCGT 2013.
#import lib/rounding

struct LightRay {
    // The ray is (shear, 1) per unit of depth.
    shear: vec2<f32>,
    // Depth of the light; beyond every depth where it is at infinity.
    reach: f32,
}

fn absolute_sum(v: vec3<f32>) -> f32 {
    return abs(v.x) + abs(v.y) + abs(v.z);
}

// x: the edge function of the ray at the origin and the line from p along d, y: a bound of its rounding.
fn edge_function(p: vec2<f32>, d: vec2<f32>) -> vec2<f32> {
    let one = p.x * d.y;
    let two = p.y * d.x;
    return vec2<f32>(one - two, PRODUCT_ROUNDING * (abs(one) + abs(two)));
}

// How far rounding may move a point at a distance from the eye, seen along a ray that makes an angle with the
// surface; `extent` is the triangle's longest edge.
fn receiver_margin(distance: f32, cosine: f32, extent: f32) -> f32 {
    let margin = ROUNDING * distance;
    return margin + min(margin / max(cosine, 1e-30), extent);
}

struct Edges {
    may_be_inside: bool,
    is_inside: bool,            // whatever the room
}

// The ray against the edges of a triangle, whose corners are relative to the receiver.
fn meet_edges(shear: vec2<f32>, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, room: f32) -> Edges {
    let pa = a.xy - shear * a.z;
    let pb = b.xy - shear * b.z;
    let pc = c.xy - shear * c.z;
    let ea = edge_function(pb, pc - pb);
    let eb = edge_function(pc, pa - pc);
    let ec = edge_function(pa, pb - pa);
    let e = vec3<f32>(ea.x, eb.x, ec.x);
    let total = abs(pa) + abs(pb) + abs(pc);
    let off = room * (total.x + total.y + room);
    let slack = vec3<f32>(ea.y, eb.y, ec.y) + off;
    let is_near = all(e >= -slack) || all(e <= slack);
    // Edges that meet at no angle go on beyond the triangle.
    let around = ROUNDING * max(max(absolute_sum(a), absolute_sum(b)), absolute_sum(c)) + room;
    let is_around = all(min(min(pa, pb), pc) <= vec2<f32>(around))
        && all(max(max(pa, pb), pc) >= vec2<f32>(-around));
    let most = max(max(slack.x, slack.y), slack.z);
    let is_inside = min(min(e.x, e.y), e.z) > most || max(max(e.x, e.y), e.z) < -most;
    return Edges(is_near && is_around, is_inside);
}

struct Meeting {
    is_possible: bool,
    is_certain: bool,
}

// Corners relative to the receiver; the normal points to either side.
fn meeting(
    ray: LightRay,
    edges: Edges,
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    normal: vec3<f32>,
    room: f32,
) -> Meeting {
    let lengths = vec3<f32>(absolute_sum(a), absolute_sum(b), absolute_sum(c));

    // How far the receiver is behind the triangle's plane, seen from the light, by the nearest corner.
    var nearest = a;
    var distance = lengths.x;
    if lengths.y < distance {
        nearest = b;
        distance = lengths.y;
    }
    if lengths.z < distance {
        nearest = c;
        distance = lengths.z;
    }
    let slope = dot(normal, vec3<f32>(ray.shear, 1.0));
    let height = dot(normal, nearest) * sign(slope);
    // Of a sum of three coordinates, and of the normal.
    let off = 4.0 * room + ROUNDING * distance;
    // Near to edge-on, the room hides which side the receiver is on.
    let is_edge_on = abs(slope) < 1e-5 * (1.0 + abs(ray.shear.x) + abs(ray.shear.y));
    let greatest_height = select(height, abs(height), is_edge_on) + off;
    // Both ends: the hit is before the light, too.
    let to_light = abs(slope) * ray.reach;
    let may_be_before_light = max(max(a.z, b.z), c.z) < ray.reach + off || height < to_light + off;
    let is_between = height > off && height < to_light - off && !is_edge_on;
    return Meeting(
        edges.may_be_inside && greatest_height > 0.0 && may_be_before_light,
        edges.is_inside && is_between,
    );
}
