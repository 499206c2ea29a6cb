// The shadow maps, which have depth alone. The rays are parallel: `forward` is their direction,
// `eye` the origin of the image's corner, `right` and `down` lead to the next pixels.

@fragment
fn fragment(v: Vertex) {
    let i = instances[v.instance];
    let p = primitive(v.primitive);
    if materials[p.material].mask_width != 0u {
        let origin = frame.eye.xyz + frame.right.xyz * v.position.x + frame.down.xyz * v.position.y;
        let d = frame.forward.xyz;
        let c = to_scene(i, p.corner) + (place_of(i) - (origin - rest_of(i)));
        let eu = to_scene(i, p.edge_u);
        let ev = to_scene(i, p.edge_v);
        let normal = cross(eu, ev);
        let det = dot(normal, d);
        let moment = cross(c, d);
        let m = Intersection(dot(normal, c) / det, dot(moment, ev) / det,
            -dot(moment, eu) / det, normal);
        if !is_opaque(p.material, uv_at(v.primitive, m)) {
            discard;
        }
    }
}
