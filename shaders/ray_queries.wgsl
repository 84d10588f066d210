enable wgpu_ray_query;

// The shadow of every pixel by a ray query: the device finds the triangles whose boxes the ray meets.
//
// It decides nothing more. What it finds are candidates, and lib/shadow_ray tests them, as it does in
// shadow_rays; any hit ends the query. The boxes are grown beforehand, see src/gpu/acceleration.rs.
#import lib/light_rays

@group(0) @binding(4) var boxes: acceleration_structure;

fn is_in_shadow(rays: LightRays, ray: ReceiverRay, pixel: u32) -> bool {
    let search = search_ray(rays, ray);
    var query: ray_query;
    rayQueryInitialize(&query, boxes, RayDesc(0u, 0xffu, 0.0, search.end, search.start, search.direction));
    var steps = 0u;
    var is_hit = false;
    while rayQueryProceed(&query) {
        let candidate = rayQueryGetCandidateIntersection(&query);
        is_hit = meets_searched(rays, ray, pixel, candidate.primitive_index);
        steps += 1u;
        if is_hit || steps >= most_steps {
            break;
        }
    }
    atomicMax(&counters.longest_walk, steps);
    atomicAdd(&counters.rays, 1u);
    return is_hit;
}
