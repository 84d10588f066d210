// The factors of an importance (Rosen, "Rectilinear texture warping", section 5) that the receivers and what the light
// sees have alike. The desired view (5.1) is who asks.

override uses_distance: bool = false;
override uses_normal: bool = false;
override uses_shadow_edge: bool = false;
override uses_map_weights: bool = false;

@group(0) @binding(4) var<storage, read> map_weights: array<f32>;
@group(0) @binding(6) var<storage, read> shadow_edges: array<f32>;

fn cell_at(place: f32, cells: u32) -> u32 {
    return min(u32(clamp(place, 0.0, 1.0) * f32(cells)), cells - 1u);
}

// Distance to the eye (5.2): a sphere's image is proportional to 1 / depth, or to 1 of an orthographic camera: one over the
// width of the image there. A warp adds to the density of texels that
// the fit before it has given, so what is important is the width of the fit's texels against that image. The surface's normal (5.4), turned
// towards the camera, by the cosine between it and the ray.
fn importance_of_surface(image_width: f32, texel_width: f32, cosine: f32, normal_bonus: f32) -> f32 {
    var value = 1.0;
    if uses_distance {
        value = texel_width / image_width;
    }
    if uses_normal {
        value *= 1.0 + normal_bonus * cosine;
    }
    return value;
}

// Weights of one's own for each cell of a grid of (columns, rows) over the map.
fn weight_of_place(uv: vec2<f32>, size: vec2<u32>) -> f32 {
    if uses_map_weights {
        return map_weights[cell_at(uv.y, size.y) * size.x + cell_at(uv.x, size.x)];
    }
    return 1.0;
}
