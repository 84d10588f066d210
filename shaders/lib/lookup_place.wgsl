// Where in a map the lookup of a receiver begins.
//
// A surface that the light's rays run along has no extent in the map: within a texel its plane goes far before
// and far behind the scene, and rounding moves it as far. What it is compared with must not follow that plane.
// The rays on its outer side pass through the space before it, and what they meet before the receiver's own
// depth lies between it and the light. Those on its inner side meet what it bounds, as the top of a wall, and
// say nothing of it. So an edge-on receiver is looked up beside its surface, as normal offset shadows are
// (Holbert, "Normal offset shadows", GDC 2011), and at its own depth.
#import projection
#import warp
#import lib/receivers

// The sine of the angle below which a surface is edge-on: a texel covers more than a hundred times its width.
const EDGE_ON: f32 = 0.01;

fn is_edge_on(receiver: Receiver) -> bool {
    return abs(dot(receiver.normal, normalize(receiver.from_light))) < EDGE_ON;
}

struct LookupPlace {
    is_edge_on: bool,
    normal: vec3<f32>,                  // of the receiver's plane, to the side of the light, as a covector
    outward: vec2<f32>,                 // height over that plane, per texel along each axis
    centred: vec2<f32>,                 // the receiver's own place
    // Where the lookup begins: before the warp, in [0, 1], after it, and in texels.
    linear: vec2<f32>,
    warped: Warped,
    place: vec2<f32>,
}

fn place_of_lookup(receivers: Receivers, projection: Projection, warp: Warp, receiver: Receiver) -> LookupPlace {
    let size = vec2<f32>(projection.size);
    let edge_on = is_edge_on(receiver);
    // The camera and the light see the same side.
    let unit_normal = -sign(dot(receiver.normal, receiver.ray)) * receiver.normal;
    let normal = projected_from_normal(projection, unit_normal);
    let outward = height_slope(projection, normal, receiver.q);
    let centred = centred_texel_from_projected(projection, receiver.q);
    // Off the surface by what rounding may hide, and by half a texel: then the middle of the texel is outside.
    let aside = projected_from_offset(projection, unit_normal * select(0.0, receivers.margin, edge_on));
    let linear = (centred_texel_from_projected(projection, receiver.q + aside) + projection.centre) / size;
    let warped = warped_from_linear(warp, linear);
    let place = warped.uv * size + select(vec2<f32>(0.0), 0.5 * sign(outward), edge_on);
    return LookupPlace(edge_on, normal, outward, centred, linear, warped, place);
}

// Whether the ray of a texel, `step` texels from the receiver, says anything of it.
fn is_before_surface(start: LookupPlace, step: vec2<f32>) -> bool {
    return !start.is_edge_on || dot(start.outward, step) >= 0.0;
}

// Whether a place is on the map. Rounding may move a receiver at the border.
fn is_on_map(size: vec2<f32>, texel: vec2<f32>) -> bool {
    return all(abs(texel - 0.5 * size) <= 0.5 * size + 0.5);
}
