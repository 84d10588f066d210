// How many texels of a map a pixel is as large as, both measured across their rays: src/paging/footprint.rs, which argues
// for it.

// Of an image or a map, per unit of area across a ray r at a point p, times the third power of its width: the product of r
// and constant + growth * p.
struct Density {
    constant: vec3<f32>,
    growth: f32,
    width: vec4<f32>,                   // a function of (p, 1)
}

fn width_at_point(density: Density, point: vec3<f32>) -> f32 {
    return dot(density.width.xyz, point) + density.width.w;
}

fn density_across(density: Density, ray: vec3<f32>, point: vec3<f32>) -> f32 {
    return abs(dot(ray / length(ray), density.constant + point * density.growth));
}

// At a point relative to the eye, across the rays there from the camera and from the light, of any length.
fn texels_of_pixel(
    image: Density,
    map: Density,
    from_eye: vec3<f32>,
    from_light: vec3<f32>,
    point: vec3<f32>,
) -> f32 {
    let share = density_across(map, from_light, point) / density_across(image, from_eye, point);
    let width = abs(width_at_point(image, point) / width_at_point(map, point));
    return share * width * width * width;
}
