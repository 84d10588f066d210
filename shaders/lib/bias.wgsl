// What is taken off a receiver's depth before it is compared with a texel's, twin of src/bias.rs.
#import projection
#import lib/receivers
#import lib/lookup_place

// A plane at grazing incidence ends within a texel, and is not followed farther than to this share of its
// depth; in a disc it is followed as far as it may matter.
const TEXEL_REACH: f32 = 2.0;
const DISC_REACH: f32 = 10000.0;

struct Bias {
    rounding: f32,
    even: f32,                          // the constant and what rounding may do
    least: f32,                         // the same, and what the slope does within a texel
    beam: f32,
    slope: vec2<f32>,                   // per texel along each axis
    is_edge_on: bool,
}

fn bias_of_receiver(receivers: Receivers, projection: Projection, receiver: Receiver, normal: vec3<f32>) -> Bias {
    // Rounding moves a depth, and moves it again by the slope where it moves the texel. Edge-on there is no slope.
    let edge_on = is_edge_on(receiver);
    let cosine = abs(dot(receiver.normal, normalize(receiver.from_light)));
    let world_slope = 1.0 / select(cosine, 1.0, edge_on);
    let rounding = receivers.rounding * world_slope;
    let even = receivers.constant_bias + rounding;
    let slope = select(abs(depth_slope(projection, normal, receiver.q)), vec2<f32>(0.0), edge_on);
    return Bias(
        rounding,
        even,
        even + receivers.slope_bias * (slope.x + slope.y),
        receivers.beam_bias * beam_growth(projection, receiver.q),
        slope * receivers.slope_bias,
        edge_on,
    );
}

// The depth that is compared `step` texels from the receiver, moved by no more than `reach`.
fn compared_depth(
    receivers: Receivers,
    projection: Projection,
    q: vec3<f32>,
    normal: vec3<f32>,
    bias: Bias,
    step: vec2<f32>,
    reach: f32,
) -> f32 {
    let on_plane = depth_of_neighbour(projection, normal, q, step * receivers.receiver_plane, reach);
    return select(on_plane, depth_from_projected(q), bias.is_edge_on);
}

// The depth that a texel, `step` texels from the receiver, must hold at least to leave it lit.
fn least_lit_depth(
    receivers: Receivers,
    projection: Projection,
    q: vec3<f32>,
    normal: vec3<f32>,
    bias: Bias,
    step: vec2<f32>,
) -> f32 {
    let depth = compared_depth(receivers, projection, q, normal, bias, step, TEXEL_REACH);
    // The farther a curved surface is taken for its plane, the more that is wrong.
    return depth - (bias.least + bias.beam * max(1.0, length(step)));
}

// The same of a texel in a disc around the receiver.
fn least_lit_depth_in_disc(
    receivers: Receivers,
    projection: Projection,
    q: vec3<f32>,
    normal: vec3<f32>,
    bias: Bias,
    step: vec2<f32>,
) -> f32 {
    let depth = compared_depth(receivers, projection, q, normal, bias, step, DISC_REACH);
    // The farther, the more a slope's bias must take off.
    return depth - (bias.even + bias.beam + dot(bias.slope, max(vec2<f32>(1.0), abs(step))));
}
