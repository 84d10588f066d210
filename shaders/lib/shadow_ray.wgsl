// One receiver's own light ray against one triangle, as the reference decides it (src/reference.rs).
//
// Everything is relative to the receiver, in axes whose third one goes towards the light. Positions are
// float32 relative to the eye, so they are known to `ROUNDING` of their distance, and the reference
// takes no offence at what turns within that. What it does not forgive is handled here:
//
//   leaks   The corners that two triangles share are the same numbers in both, but edge functions round.
//           An edge takes in what its rounding may hide, so that no ray slips between two triangles.
//   acne    A neighbour on a flat or convex surface touches the receiver. One that may touch it takes in
//           nothing at its edges; it counts where the receiver is behind its plane by more than rounding,
//           and where a corner of it is above the receiver's plane by more.
//
// After Woop, Benthin and Wald, "Watertight ray/triangle intersection", JCGT 2013.
#import lib/rounding

struct LightRay {
    // The ray is (shear, 1) per unit of depth.
    shear: vec2<f32>,
    // Depth of the light; beyond every depth where it is at infinity.
    reach: f32,
    // How far rounding may have moved the receiver, in world units.
    margin: f32,
}

// A triangle this many margins beyond the receiver does not touch it.
const CLEAR: f32 = 16.0;

fn absolute_sum(v: vec3<f32>) -> f32 {
    return abs(v.x) + abs(v.y) + abs(v.z);
}

// x: the edge function of the ray at the origin and the line from p along d, y: a bound of its rounding.
fn edge_function(p: vec2<f32>, d: vec2<f32>) -> vec2<f32> {
    let one = p.x * d.y;
    let two = p.y * d.x;
    return vec2<f32>(one - two, PRODUCT_ROUNDING * (abs(one) + abs(two)));
}

// The receiver's margin: what the reference grants a point at a distance from the eye, seen along a ray
// that makes an angle with the surface. `extent` is the triangle's longest edge.
fn receiver_margin(distance: f32, cosine: f32, extent: f32) -> f32 {
    let margin = ROUNDING * distance;
    return margin + min(margin / max(cosine, 1e-30), extent);
}

struct Edges {
    may_be_inside: bool,        // as the edge functions say, give or take the room
    may_be_near: bool,          // with what their rounding may hide
    is_inside: bool,            // whatever the room
}

// The ray against the edges of a triangle, whose corners are relative to the receiver. `room` is how far
// each of their projections along the ray may be off.
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
    let least = min(min(e.x, e.y), e.z);
    let greatest = max(max(e.x, e.y), e.z);
    let is_near = all(e >= -slack) || all(e <= slack);
    // Edges that meet at no angle go on beyond the triangle.
    let around = ROUNDING * max(max(absolute_sum(a), absolute_sum(b)), absolute_sum(c)) + room;
    let is_around = all(min(min(pa, pb), pc) <= vec2<f32>(around))
        && all(max(max(pa, pb), pc) >= vec2<f32>(-around));
    let has_area = least != greatest || room > 0.0;
    let may_be_inside = has_area && (least >= -off || greatest <= off);
    let most = max(max(slack.x, slack.y), slack.z);
    let is_inside = least > most || greatest < -most;
    return Edges(may_be_inside && is_around, is_near && is_around, is_inside);
}

struct Meeting {
    is_possible: bool,
    is_certain: bool,
}

// Corners relative to the receiver; the normal points to either side. `is_level`: no corner is above the
// receiver's plane. With `room`, how far each coordinate of the corners may be off: what may be, and what is
// for sure.
fn meeting(
    ray: LightRay,
    edges: Edges,
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    normal: vec3<f32>,
    is_level: bool,
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
    // Of heights and margins, which are sums of three coordinates.
    let off = 4.0 * room;
    let margin = ROUNDING * distance + ray.margin;
    let least_margin = margin - off;
    // Near to edge-on, the room hides which side the receiver is on.
    let is_edge_on = room > 0.0 && abs(slope) < 1e-5 * (1.0 + abs(ray.shear.x) + abs(ray.shear.y));
    let greatest_height = select(height, abs(height), is_edge_on) + off;
    let least_depth = min(min(a.z, b.z), c.z);
    // Both ends: the hit is before the light, too.
    let may_be_before_light = max(max(a.z, b.z), c.z) < ray.reach + off || height < abs(slope) * ray.reach + off;
    let may_be_clear = least_depth + off > least_margin || greatest_height > CLEAR * least_margin;
    let is_possible = (edges.may_be_near && may_be_clear)
        || (edges.may_be_inside && greatest_height > least_margin && !is_level);
    let greatest_margin = margin + off;
    let is_beyond = height - off > greatest_margin && height < abs(slope) * ray.reach - off && !is_edge_on;
    let is_clear = least_depth - off > greatest_margin || height - off > CLEAR * greatest_margin;
    return Meeting(may_be_before_light && is_possible, edges.is_inside && is_beyond && is_clear);
}

fn is_met(ray: LightRay, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, normal: vec3<f32>, is_level: bool) -> bool {
    let edges = meet_edges(ray.shear, a, b, c, 0.0);
    return meeting(ray, edges, a, b, c, normal, is_level, 0.0).is_possible;
}
