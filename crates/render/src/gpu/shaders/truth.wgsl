// The replacement shader of the truth, which writes exact class, instance, planar depth and normal.

fn paint(s: Surface) -> vec4u {
    return vec4u(
        s.instance + 1u,
        s.semantic,
        bitcast<u32>(s.depth_m),
        pack2x16snorm(octahedral(s.normal)),
    );
}

// A unit vector as a point of a square (Cigolle et al. 2014, "A survey of efficient
// representations for independent unit vectors").
fn octahedral(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(folded, p, n.z >= 0.0);
}
