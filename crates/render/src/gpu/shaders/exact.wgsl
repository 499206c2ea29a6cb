// One sample at the pixel's centre, without blending.

@group(2) @binding(0) var<storage, read> table: array<u32>;
// The rays of the ray-cast camera, equal to the bit; w: z in the optical frame.
@group(2) @binding(1) var rays: texture_2d<f32>;
// The position of the camera for each row.
@group(2) @binding(2) var<storage, read> eyes: array<vec4f>;

struct Painted {
    @location(0) value: vec4u,
    // The depth is that of the intersection itself, so that the nearest surface is the one of the
    // ray caster.
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fragment(v: Vertex) -> Painted {
    let ray = textureLoad(rays, vec2u(v.position.xy), 0);
    let eye = eyes[u32(v.position.y)].xyz;
    let p = primitive(v.primitive);
    let m = intersect(instances[v.instance], p, eye, ray.xyz);
    let seen = is_inside(m) && m.t <= frame.forward.w;
    if !seen || !is_opaque(p.material, uv_at(v.primitive, m)) {
        discard;
    }
    return Painted(paint(surface(v, eye, ray)), min(frame.size.z / (m.t * ray.w), 1.0));
}
