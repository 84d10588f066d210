// Casters as they are: the scene's triangles.
#import lib/edges

struct Caster {
    triangle: Triangle,
}

// How many there are; `triangle_count` of them are in the scene.
fn caster_count(triangle_count: u32, piece_count: u32) -> u32 {
    return triangle_count;
}

fn corners_of_caster(projection: Projection, id: u32) -> Corners {
    return load_corners(projection, id);
}

fn caster_from_corners(projection: Projection, id: u32, corners: Corners) -> Caster {
    return Caster(triangle_from_corners(projection, id, corners));
}

// Where a ray meets the caster.
fn depth_of_caster(projection: Projection, caster: Caster, ray: vec3<f32>) -> f32 {
    let triangle = caster.triangle;
    return clamp(depth_on_plane(projection, triangle.plane, ray), triangle.depths.x, triangle.depths.y);
}

fn triangle_of_caster(id: u32) -> u32 {
    return id;
}
