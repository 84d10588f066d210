// Casters as published: pieces of triangles with straight edges in the map, from tessellate.wgsl. Their
// corners are seen by parallel rays, one for each texel.
#import lib/edges
#import lib/pieces

struct Caster {
    triangle: Triangle,
    // Of each corner: its depth and one, over w.
    depths_over_w: vec3<f32>,
    ones_over_w: vec3<f32>,
}

@group(0) @binding(1) var<storage, read> pieces: array<Piece>;

// How many there are; `triangle_count` of them are in the scene.
fn caster_count(triangle_count: u32, piece_count: u32) -> u32 {
    return min(piece_count, arrayLength(&pieces));
}

fn corners_of_caster(projection: Projection, id: u32) -> Corners {
    return Corners(pieces[id].a.xyz, pieces[id].b.xyz, pieces[id].c.xyz, vec3<f32>(0.0));
}

fn caster_from_corners(projection: Projection, id: u32, corners: Corners) -> Caster {
    let w = vec3<f32>(pieces[id].a.w, pieces[id].b.w, pieces[id].c.w);
    return Caster(
        triangle_from_homogeneous(
            vec3<f32>(corners.a.xy, 1.0),
            vec3<f32>(corners.b.xy, 1.0),
            vec3<f32>(corners.c.xy, 1.0),
            vec3<f32>(0.0),
            vec2<f32>(0.0),
        ),
        vec3<f32>(corners.a.z, corners.b.z, corners.c.z) / w,
        1.0 / w,
    );
}

// Where a ray meets the caster: its values of the edges are barycentric coordinates.
fn depth_of_caster(projection: Projection, caster: Caster, ray: vec3<f32>) -> f32 {
    let e = edges_at(caster.triangle, ray);
    return dot(e, caster.depths_over_w) / dot(e, caster.ones_over_w);
}

fn triangle_of_caster(id: u32) -> u32 {
    return pieces[id].triangle;
}
