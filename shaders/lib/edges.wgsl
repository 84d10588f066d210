// A triangle in projection space: its edges and its plane.
//
// A triangle's edges are planes (central projections) or lines (parallel ones) through the rays'
// origin: e_i(r) = dot(edge_i, r) with r the ray of a texel, after Olano and Greer, "Triangle Scan
// Conversion using 2D Homogeneous Coordinates", 1997. A texel is covered where all three are positive,
// also for a triangle that reaches behind the near plane, so nothing is clipped.
#import projection
#import lib/triangles
#import lib/normals

struct Triangle {
    // Edge opposite to each corner, positive inside.
    edge0: vec3<f32>,
    edge1: vec3<f32>,
    edge2: vec3<f32>,
    plane: vec3<f32>,                   // see `depth_plane`
    depths: vec2<f32>,                  // least and greatest: no covered texel is beyond them
}

fn is_before(a: vec3<f32>, b: vec3<f32>) -> bool {
    return a.x < b.x || (a.x == b.x && (a.y < b.y || (a.y == b.y && a.z < b.z)));
}

// The two triangles at an edge must agree on which side a texel lies, to the bit: the edge is always
// computed from the same end. The difference of the ends is nearly exact, their product is not.
fn edge_through(a: vec3<f32>, b: vec3<f32>, orientation: f32) -> vec3<f32> {
    let swap = is_before(b, a);
    let from_end = select(a, b, swap);
    let edge = cross(from_end, select(b, a, swap) - from_end);
    return edge * select(orientation, -orientation, swap);
}

fn evaluate_edge(edge: vec3<f32>, ray: vec3<f32>) -> f32 {
    return fma(edge.x, ray.x, fma(edge.y, ray.y, edge.z * ray.z));
}

struct Corners {
    // In projection space.
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    // The one nearest to the projection's origin, relative to it, in world axes.
    nearest: vec3<f32>,
}

fn triangle_from_corners(projection: Projection, id: u32, corners: Corners) -> Triangle {
    let a = corners.a;
    let b = corners.b;
    let c = corners.c;
    let normal = normal_of_triangle(id);
    // Not from the turned corners: those of a huge floor are rounded by more than its height.
    let height = dot(normal, corners.nearest);
    return triangle_from_homogeneous(
        homogeneous_from_projected(projection, a),
        homogeneous_from_projected(projection, b),
        homogeneous_from_projected(projection, c),
        depth_plane(projection, projected_from_normal(projection, normal), a, height),
        depths_of_triangle(a, b, c),
    );
}

// Of a ray: positive on the inner side of each edge.
fn edges_at(triangle: Triangle, ray: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(
        evaluate_edge(triangle.edge0, ray),
        evaluate_edge(triangle.edge1, ray),
        evaluate_edge(triangle.edge2, ray),
    );
}

fn triangle_from_homogeneous(
    ha: vec3<f32>,
    hb: vec3<f32>,
    hc: vec3<f32>,
    plane: vec3<f32>,
    depths: vec2<f32>,
) -> Triangle {
    // A ray that meets the triangle in front of its origin has e_i of the sign of this determinant;
    // a triangle seen edge-on has none and covers nothing. With a corner at the origin of the rays it
    // is seen edge-on, but the determinant may round to either sign.
    let zero = vec3<f32>(0.0);
    let is_at_origin = all(ha == zero) || all(hb == zero) || all(hc == zero);
    let orientation = select(sign(dot(ha, cross(hb - ha, hc - ha))), 0.0, is_at_origin);
    return Triangle(
        edge_through(hb, hc, orientation),
        edge_through(hc, ha, orientation),
        edge_through(ha, hb, orientation),
        plane,
        depths,
    );
}

fn load_corners(projection: Projection, id: u32) -> Corners {
    let vertices = vertices_of_triangle(id);
    let high = projection.origin_high;
    let low = projection.origin_low;
    let a = offset_from_vertex(vertices.x, high, low);
    let b = offset_from_vertex(vertices.y, high, low);
    let c = offset_from_vertex(vertices.z, high, low);
    let squares = vec3<f32>(dot(a, a), dot(b, b), dot(c, c));
    let nearer = select(a, b, squares.y < squares.x);
    return Corners(
        projected_from_offset(projection, a),
        projected_from_offset(projection, b),
        projected_from_offset(projection, c),
        select(nearer, c, squares.z < min(squares.x, squares.y)),
    );
}
