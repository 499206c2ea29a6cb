// The part that all passes share: the scene, and the intersection of a pixel's ray with a primitive
// of it.

struct Frame {
    // The transform from scene axes around the frame's origin to clip coordinates; depth is near /
    // z.
    clip: mat4x4f,
    // The frame's origin, relative to the origin of the instance buffer. Both lie on a grid, and so
    // do positions of instances: their differences are exact, and neighbouring chunks round their
    // common vertices equally. w: its height in the scene.
    origin: vec4f,
    // The camera, next to the origin.
    eye: vec4f,
    // The optical axis; w: the greatest visible distance, metres.
    forward: vec4f,
    // The step to the next pixel at z = 1; w: the principal point, pixels.
    right: vec4f,
    down: vec4f,
    // The size of the target in pixels; z: the near plane.
    size: vec4f,
    // The rest is for pictures that a lens or a rolling shutter distorts: distortion_bounds.rs.
    // Focal lengths and principal point, pixels.
    lens: vec4f,
    // Coefficients of the odd powers from the third on in the radius at which a ray is projected.
    radial: vec4f,
    // The widest ray: its angle, its radius, the radius' slope by the angle; w: 1 if radii are
    // powers of the angle, 0 if of its tangent.
    widest: vec4f,
    // How far the camera moves and turns while the rows are read: metres, radians, optical axes; w
    // of the first: the greatest error of this model of the lens, pixels.
    linear: vec4f,
    angular: vec4f,
    // The bend of straight lines, pixels per radian squared, up to each sixteenth of the widest
    // angle plus half a radian.
    curvature: array<vec4f, 4>,
}

// The transform from the shape's axes to scene axes around the instance buffer's origin: three
// columns and the position.
struct Instance {
    // w: the remainder of the position beside the grid.
    x: vec4f,
    y: vec4f,
    z: vec4f,
    // w: the colour's variation.
    place: vec4f,
}

struct Material {
    semantic: u32,
    // First word in `masks`, and sides; 0 wide is opaque.
    mask: u32,
    mask_width: u32,
    mask_height: u32,
    // Bit 0: ground. Bit 1: ground, or what lies on it. Bit 2: liquid, whose reflectance at right
    // angles is in the upper 16 bits.
    flags: u32,
    // First texel in `albedos`, and sides of level 0.
    albedo: u32,
    albedo_width: u32,
    albedo_height: u32,
    // w: roughness.
    transmittance: vec4f,
    // w: metres of one repetition.
    mean_albedo: vec4f,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<storage, read> instances: array<Instance>;
@group(0) @binding(2) var<storage, read> materials: array<Material>;
@group(0) @binding(3) var<storage, read> masks: array<u32>;
@group(1) @binding(0) var<storage, read> primitives: array<vec4u>;

// Whether the page has cards rather than triangles.
override CARDS: bool = false;

struct Primitive {
    corner: vec3f,
    edge_u: vec3f,
    edge_v: vec3f,
    material: u32,
}

fn primitive(index: u32) -> Primitive {
    let at = index * select(5u, 3u, CARDS);
    let word = primitives[at];
    let a = bitcast<vec3f>(word.xyz);
    let b = bitcast<vec3f>(primitives[at + 1u].xyz);
    let c = bitcast<vec3f>(primitives[at + 2u].xyz);
    if CARDS {
        return Primitive(a, b, c, word.w);
    }
    return Primitive(a, b - a, c - a, word.w & 0xffffu);
}

// The position on the grid, relative to the frame's origin.
fn place_of(i: Instance) -> vec3f {
    return i.place.xyz - frame.origin.xyz;
}

// The remainder of the position beside the grid, at most half a millimetre.
fn rest_of(i: Instance) -> vec3f {
    return vec3f(i.x.w, i.y.w, i.z.w);
}

fn to_scene(i: Instance, v: vec3f) -> vec3f {
    return i.x.xyz * v.x + i.y.xyz * v.y + i.z.xyz * v.z;
}

// Normals are transformed by the cofactors, which are the inverse transpose up to a factor.
fn normal_to_scene(i: Instance, n: vec3f) -> vec3f {
    return cross(i.y.xyz, i.z.xyz) * n.x
        + cross(i.z.xyz, i.x.xyz) * n.y
        + cross(i.x.xyz, i.y.xyz) * n.z;
}

fn to_optical(v: vec3f) -> vec3f {
    return vec3f(dot(v, normalize(frame.right.xyz)),
        dot(v, normalize(frame.down.xyz)),
        dot(v, frame.forward.xyz));
}

struct Vertex {
    @builtin(position) position: vec4f,
    @location(0) @interpolate(flat, either) primitive: u32,
    @location(1) @interpolate(flat, either) instance: u32,
}

// A corner in the shape's axes: a triangle has three corners, a card four.
fn corner_of(index: u32, k: u32) -> vec3f {
    if CARDS {
        let p = primitive(index);
        let to_u = select(vec3f(0.0), p.edge_u, k == 1u || k == 2u);
        let to_v = select(vec3f(0.0), p.edge_v, k >= 2u);
        return p.corner + to_u + to_v;
    }
    // The corner as it is stored, which neighbours share to the bit.
    return bitcast<vec3f>(primitives[index * 5u + k].xyz);
}

// How far primitives are drawn over their borders, pixels.
override MARGIN_PX: f32 = 0.0;
// Whether a pixel has one sample, at its centre.
override SINGLE: bool = true;
// Whether the picture is distorted. Then boxes around the primitives are drawn, and fragments
// decide.
override DISTORTED: bool = false;

// Where a point of the optical axes is projected, pixels. Beyond the widest ray radii grow
// linearly.
fn drawn(p: vec3f) -> vec2f {
    let across = length(p.xy);
    let angle = atan2(across, p.z);
    var radius = frame.widest.y + frame.widest.z * (angle - frame.widest.x);
    if angle < frame.widest.x {
        let x = select(across / p.z, angle, frame.widest.w == 1.0);
        let s = x * x;
        let k = frame.radial;
        radius = x * (1.0 + s * (k.x + s * (k.y + s * (k.z + s * k.w))));
    }
    return frame.lens.zw + frame.lens.xy * p.xy * (radius / max(across, 1e-20));
}

// The point in the optical axes of the row at `y`, at the time when that is read.
fn seen_by_row(p: vec3f, y: f32) -> vec3f {
    let part = clamp(y / frame.size.y, -1.0, 2.0) - 0.5;
    let q = p - frame.linear.xyz * part;
    let turn = frame.angular.xyz * -part;
    let angle = length(turn);
    let axis = turn / max(angle, 1e-20);
    return q * cos(angle) + cross(axis, q) * sin(angle)
        + axis * (dot(axis, q) * (1.0 - cos(angle)));
}

// Where a point is projected by the row that sees it; z: the possible error, pixels.
fn drawn_by_row(p: vec3f) -> vec3f {
    var at = drawn(p);
    if all(frame.linear.xyz == vec3f(0.0)) && all(frame.angular.xyz == vec3f(0.0)) {
        return vec3f(at, 0.0);
    }
    var step = 0.0;
    for (var k = 0; k < 4; k++) {
        let next = drawn(seen_by_row(p, at.y));
        step = distance(next, at);
        at = next;
    }
    return vec3f(at, 2.0 * step);
}

// Clip coordinates of a corner of the box around a primitive's image: around the images of its
// corners, enlarged by how far its borders may bend.
fn box(i: Instance, index: u32, v: u32) -> vec4f {
    let corners = select(3u, 4u, CARDS);
    var rays: array<vec3f, 4>;
    var low = vec2f(1e9);
    var high = vec2f(-1e9);
    var width = 0.0;
    var front = 4.0;
    var near = 1e9;
    for (var k = 0u; k < corners; k++) {
        let p = to_optical(to_scene(i, corner_of(index, k))
            + (place_of(i) - (frame.eye.xyz - rest_of(i))));
        let at = drawn_by_row(p);
        low = min(low, at.xy - at.z);
        high = max(high, at.xy + at.z);
        let distance_m = max(length(p), 1e-9);
        rays[k] = p / distance_m;
        near = min(near, distance_m);
        front = min(front, atan2(length(p.xy), p.z));
        for (var j = 0u; j < k; j++) {
            width = max(width, distance(rays[j], rays[k]));
        }
    }
    // Angles are computed from chords; angles of half a radian are a hundredth longer.
    width *= 1.02;
    if width < 0.5 {
        let step = u32(clamp((front + width) / (frame.widest.x + 0.5) * 16.0, 0.0, 15.0));
        let margin = frame.linear.w + frame.curvature[step / 4u][step % 4u] * width * width * 0.25;
        low -= margin;
        high += margin;
    } else {
        // A primitive that is so large, or around the camera, may be anywhere, unless it is behind
        // the camera.
        let sway = 0.5 * length(frame.angular.xyz) + length(frame.linear.xyz) / near;
        let hidden = front - 2.0 * width > frame.widest.x + sway;
        low = select(vec2f(-1.0), vec2f(-9.0), hidden);
        high = select(frame.size.xy + 1.0, vec2f(-9.0), hidden);
    }
    low = clamp(low, vec2f(-1.0), frame.size.xy + 1.0);
    high = clamp(high, vec2f(-1.0), frame.size.xy + 1.0);
    var to: vec2f;
    if CARDS {
        let k = v % 6u;
        to = vec2f(f32(k == 1u || k == 2u || k == 4u), f32(k == 2u || k >= 4u));
    } else {
        // One triangle around the box.
        let k = v % 3u;
        to = 2.0 * vec2f(f32(k == 1u), f32(k == 2u));
    }
    let at = (low + to * (high - low)) / frame.size.xy * 2.0 - 1.0;
    return vec4f(at.x, -at.y, 0.5, 1.0);
}

@vertex
fn vertex(@builtin(vertex_index) v: u32, @location(0) number: u32) -> Vertex {
    let i = instances[number];
    let index = v / select(3u, 6u, CARDS);
    if DISTORTED {
        return Vertex(box(i, index, v), index, number);
    }
    // A card is the triangles 0 1 2 and 0 2 3.
    let corners = select(3u, 4u, CARDS);
    var k = v % 3u;
    if CARDS && v % 6u > 3u {
        k = v % 6u - 2u;
    }
    // Clip coordinates from the shape's axes.
    let place = vec4f(place_of(i) + rest_of(i), 1.0);
    let clip = frame.clip * mat4x4f(vec4f(i.x.xyz, 0.0), vec4f(i.y.xyz, 0.0),
        vec4f(i.z.xyz, 0.0), place);
    var at = clip * vec4f(corner_of(index, k), 1.0);
    if MARGIN_PX > 0.0 {
        let before = clip * vec4f(corner_of(index, select(k - 1u, corners - 1u, k == 0u)), 1.0);
        let after = clip * vec4f(corner_of(index, select(k + 1u, 0u, k + 1u == corners)), 1.0);
        // A primitive that reaches behind the camera is large and is not enlarged.
        if min(at.w, min(before.w, after.w)) > at.z {
            let half = frame.size.xy * 0.5;
            let here = at.xy / at.w;
            let a = (here - before.xy / before.w) * half;
            let b = (here - after.xy / after.w) * half;
            let ea = a * inverseSqrt(max(dot(a, a), 1e-12));
            let eb = b * inverseSqrt(max(dot(b, b), 1e-12));
            // Both borders move outwards by the margin, unless the corner is very sharp.
            let sine = abs(ea.x * eb.y - ea.y * eb.x);
            let shift = (ea + eb) * (MARGIN_PX / max(sine, 0.02));
            at += vec4f(shift / half * at.w, 0.0, 0.0);
        }
    }
    return Vertex(at, index, number);
}

struct Intersection {
    // Along the ray, metres.
    t: f32,
    // Weights of the edges.
    u: f32,
    v: f32,
    // The normal, not of unit length.
    normal: vec3f,
}

// The upper half of the mantissa.
fn upper(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0xFFFFF000u);
}

// a * b - c with one rounding of the difference: all partial products are exact.
fn product_minus(a: vec3f, b: f32, c: vec3f) -> vec3f {
    let ah = vec3f(upper(a.x), upper(a.y), upper(a.z));
    let al = a - ah;
    let bh = upper(b);
    let bl = b - bh;
    return (ah * bh - c) + (ah * bl + al * bh) + al * bl;
}

// Intersects the ray from the eye along a unit vector with the plane of a primitive, by Cramer's
// rule as the ray caster does. Positions on the primitive are computed from a point of the ray
// close to it; otherwise, at a hundred metres, the error of f32 would be a hundredth of a leaf's
// texel.
fn intersect(i: Instance, p: Primitive, eye: vec3f, d: vec3f) -> Intersection {
    let corner = to_scene(i, p.corner);
    let eu = to_scene(i, p.edge_u);
    let ev = to_scene(i, p.edge_v);
    let normal = cross(eu, ev);
    let det = dot(normal, d);
    let place = place_of(i);
    let rest = rest_of(i) - eye;
    let t = dot(normal, corner + (place + rest)) / det;
    let q = product_minus(d, t, place) - rest - corner;
    let moment = cross(d, q);
    // The rest of the distance to the plane, and the weights of the edges.
    return Intersection(t - dot(normal, q) / det, dot(moment, ev) / det,
        -dot(moment, eu) / det, normal);
}

// Whether the ray intersects the primitive itself, slightly enlarged, so that at least one of two
// neighbours is always hit.
fn is_inside(m: Intersection) -> bool {
    const HAIR = 2e-5;
    let third = select(1.0 - m.u - m.v, min(1.0 - m.u, 1.0 - m.v), CARDS);
    return m.t > 0.0 && min(min(m.u, m.v), third) >= -HAIR;
}

fn uv_at(index: u32, m: Intersection) -> vec2f {
    if CARDS {
        return clamp(vec2f(m.u, m.v), vec2f(0.0), vec2f(1.0));
    }
    let b = bitcast<vec4f>(primitives[index * 5u + 3u]);
    let c = bitcast<vec4f>(primitives[index * 5u + 4u]);
    return b.xy * (1.0 - m.u - m.v) + b.zw * m.u + c.xy * m.v;
}

// Whether the nearest texel is opaque.
fn is_opaque(material: u32, uv: vec2f) -> bool {
    let width = materials[material].mask_width;
    if width == 0u {
        return true;
    }
    let height = materials[material].mask_height;
    let column = min(u32(max(uv.x * f32(width), 0.0)), width - 1u);
    let row = min(u32(max(uv.y * f32(height), 0.0)), height - 1u);
    let word = masks[materials[material].mask + column / 32u * height + row];
    return (word >> (column % 32u) & 1u) == 1u;
}

// The unit direction from the camera through an image position, and its z in the optical frame.
fn ray_of(pixel: vec2f) -> vec4f {
    let ray = frame.forward.xyz
        + frame.right.xyz * (pixel.x - frame.right.w)
        + frame.down.xyz * (pixel.y - frame.down.w);
    let z = inverseSqrt(dot(ray, ray));
    return vec4f(ray * z, z);
}

struct Surface {
    material: u32,
    semantic: u32,
    instance: u32,
    variation: f32,
    depth_m: f32,
    distance_m: f32,
    ray: vec3f,
    point: vec3f,
    normal: vec3f,
    shading_normal: vec3f,
    uv: vec2f,
    uv_per_m: f32,
    // The grounds that meet in the colour, by their ids, and their shares.
    grounds: vec3u,
    shares: vec3f,
    // The share of light from all around that near parts of the shape let through.
    ambient_occlusion: f32,
}

fn surface(vertex: Vertex, eye: vec3f, ray: vec4f) -> Surface {
    let i = instances[vertex.instance];
    let p = primitive(vertex.primitive);
    let m = intersect(i, p, eye, ray.xyz);
    var s: Surface;
    s.material = p.material;
    s.semantic = materials[p.material].semantic;
    s.instance = vertex.instance;
    s.variation = i.place.w;
    s.depth_m = m.t * ray.w;
    s.distance_m = m.t;
    s.ray = ray.xyz;
    s.point = ray.xyz * m.t + (eye - frame.eye.xyz);
    let towards = select(1.0, -1.0, dot(m.normal, ray.xyz) > 0.0);
    let area = length(m.normal);
    s.normal = m.normal * (towards / area);
    s.shading_normal = s.normal;
    s.uv = uv_at(vertex.primitive, m);
    s.uv_per_m = inverseSqrt(area);
    s.ambient_occlusion = 1.0;
    s.grounds = vec3u(p.material);
    s.shares = vec3f(1.0, 0.0, 0.0);
    if !CARDS {
        let b = primitives[vertex.primitive * 5u + 3u];
        let c = primitives[vertex.primitive * 5u + 4u];
        let na = unfold(primitives[vertex.primitive * 5u + 1u].w);
        let nb = unfold(primitives[vertex.primitive * 5u + 2u].w);
        let nc = unfold(c.z);
        let n = normal_to_scene(i, na * (1.0 - m.u - m.v) + nb * m.u + nc * m.v);
        if dot(n, n) > 0.0 {
            s.shading_normal = normalize(n * select(-1.0, 1.0, dot(n, s.normal) >= 0.0));
        }
        let weights = vec3f(1.0 - m.u - m.v, m.u, m.v);
        if (c.w >> 15u & 1u) == 1u {
            s.ambient_occlusion = dot(
                vec3f(vec3u(c.w, c.w >> 16u, c.w >> 24u) & vec3u(255u)) / 255.0, weights);
        } else {
            let lowest = primitives[vertex.primitive * 5u].w >> 16u;
            let third = ((c.w >> 27u) << 6u) | ((c.w >> 9u) & 63u);
            s.grounds = vec3u(lowest, (c.w >> 16u) & 0x7ffu, third);
            s.shares = shares_of(c.w) * weights.x + shares_of(c.w >> 3u) * weights.y
                + shares_of(c.w >> 6u) * weights.z;
        }
        let st = bitcast<vec4f>(b);
        let eu = st.zw - st.xy;
        let ev = bitcast<vec2f>(c.xy) - st.xy;
        s.uv_per_m = sqrt(abs(eu.x * ev.y - eu.y * ev.x) / area);
    } else {
        let near = unpack4x8unorm(primitives[vertex.primitive * 3u + 1u].w);
        s.ambient_occlusion = mix(mix(near.x, near.y, s.uv.x), mix(near.w, near.z, s.uv.x), s.uv.y);
    }
    return s;
}

// The shares of the grounds at a corner, by the pair of its halves, as `PAIRS` in shapes.rs.
fn shares_of(corner: u32) -> vec3f {
    switch corner & 7u {
        case 1u: { return vec3f(0.0, 1.0, 0.0); }
        case 2u: { return vec3f(0.0, 0.0, 1.0); }
        case 3u: { return vec3f(0.5, 0.5, 0.0); }
        case 4u: { return vec3f(0.5, 0.0, 0.5); }
        case 5u: { return vec3f(0.0, 0.5, 0.5); }
        default: { return vec3f(1.0, 0.0, 0.0); }
    }
}

// The inverse of the octahedral map; vertex normals are packed with it.
fn unfold(packed: u32) -> vec3f {
    let p = unpack2x16snorm(packed);
    let z = 1.0 - abs(p.x) - abs(p.y);
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return normalize(vec3f(select(folded, p, z >= 0.0), z));
}
