// Axes across a unit direction: Duff et al., "Building an orthonormal basis, revisited", JCGT 2017.

struct Axes {
    x: vec3<f32>,
    y: vec3<f32>,
}

fn axes_across(z: vec3<f32>) -> Axes {
    let side = select(-1.0, 1.0, z.z >= 0.0);
    let k = -1.0 / (side + z.z);
    let m = z.x * z.y * k;
    return Axes(
        vec3<f32>(1.0 + side * z.x * z.x * k, side * m, -side * z.x),
        vec3<f32>(m, side + z.y * z.y * k, -z.y),
    );
}
