// The shadow of every pixel by a ray towards the light through a bounding volume hierarchy.
//
// The nodes are in depth-first order and each knows where to go on when its box is missed, so a ray
// needs no stack (Smits, "Efficiency issues for ray tracing", Journal of Graphics Tools 3(2), 1998):
// any hit ends it, and the order of the search plays no part. The boxes are grown by all roundings of
// the walk, as in src/bvh.rs; lib/shadow_ray decides about triangles.
#import lib/light_rays

// Two elements a node, corners as the bits of floats: (least corner, node to go on with), (greatest
// corner, leaf). A leaf is the index of its first triangle times 16 plus their number; 0 is no leaf.
@group(0) @binding(4) var nodes: texture_2d<u32>;

fn is_in_shadow(rays: LightRays, ray: ReceiverRay, pixel: u32) -> bool {
    let search = search_ray(rays, ray);
    let inverse = 1.0 / search.direction;
    let from_least = search.start + rays.box_margin;
    let from_greatest = search.start - rays.box_margin;

    var node = 0u;
    var steps = 0u;
    var is_hit = false;
    while node < rays.node_count && !is_hit && steps < most_steps {
        // To the next leaf that is met.
        var leaf = 0u;
        while leaf == 0u && node < rays.node_count && steps < most_steps {
            let least = textureLoad(nodes, place_from_index(2u * node), 0);
            let greatest = textureLoad(nodes, place_from_index(2u * node + 1u), 0);
            let a = (bitcast<vec3<f32>>(least.xyz) - from_least) * inverse;
            let b = (bitcast<vec3<f32>>(greatest.xyz) - from_greatest) * inverse;
            let low = min(a, b);
            let high = max(a, b);
            let enter = max(max(low.x, low.y), max(low.z, 0.0));
            let leave = min(min(high.x, high.y), min(high.z, search.end));
            let is_entered = enter <= leave;
            node = select(least.w, node + 1u, is_entered);
            leaf = select(0u, greatest.w, is_entered);
            steps += 1u;
        }
        var next = leaf >> 4u;
        let last = next + (leaf & 0xfu);
        while next < last && !is_hit {
            is_hit = meets_searched(rays, ray, pixel, next);
            next += 1u;
            steps += 1u;
        }
    }
    atomicMax(&counters.longest_walk, steps);
    atomicAdd(&counters.rays, 1u);
    return is_hit;
}
