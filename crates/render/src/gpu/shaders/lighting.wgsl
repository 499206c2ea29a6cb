// The colours of a picture. This follows light/shading.rs, with shadow maps instead of shadow rays
// and tables of light.

const PI = 3.14159265;
const CASCADES = 4u;
// Directions along a side of an octahedral map, of the background and of irradiance.
const SKY_SIDE = 128u;
const AMBIENT_SIDE = 16u;
// Steps of openness.
const OPENNESS_STEPS = 32u;
// Nodes of an openness grid: across, and up.
const GRID_SIDE = 64u;
const GRID_UP = 32u;
// Nodes along a side of the near and the wide grid of ground occlusion, and their distances in
// metres.
const GROUND_SIDE = 512u;
const GROUND_STEP = 1.0 / 6.0;
const WIDE_GROUND_STEP = 0.8;
// Over so many nodes from its rim on, the shade of the wide grid becomes what it is.
const GROUND_FADE = 16.0;
// What leaves and wood over the ground scatter of the light.
const NEAR_GROUND = 0.2;

struct Light {
    // Towards the sun; w: width of a sample at 1 m.
    sun: vec4f,
    // On a plane that faces it; w: the factor from radiance to the target's values.
    irradiance: vec4f,
    // Extinction 1/m, its scale height, range, openness at the camera.
    air: vec4f,
    // Transforms from scene axes around the origin to shadow coordinates.
    cascades: array<mat4x4f, 4>,
    // Where each ends, metres from the camera.
    ends: vec4f,
    // Sides of their texels, metres.
    texels: vec4f,
    // Corner, step across.
    near_grid: vec4f,
    far_grid: vec4f,
    // Steps up of both; fog: extinction 1/m, its scale height.
    up_and_fog: vec4f,
    // Corners of the near and the wide grid of ground occlusion, relative to the camera.
    ground_grids: vec4f,
}

@group(2) @binding(0) var<uniform> light: Light;
@group(2) @binding(1) var albedos: texture_2d_array<u32>;
// Background radiance, then irradiance by openness and normal.
@group(2) @binding(2) var<storage, read> tables: array<vec4f>;
// A near and a far grid of openness, then a near and a far one of ground occlusion.
@group(2) @binding(3) var<storage, read> light_shares: array<f32>;
@group(2) @binding(4) var shadows: texture_depth_2d_array;
// The same maps for reading, because a comparison sampler cannot return the depth of casters in GL.
@group(2) @binding(8) var caster_heights: texture_2d_array<f32>;
@group(2) @binding(5) var comparison: sampler_comparison;
// For distorted pictures: the rays of the pixels' centres, and the position of the camera for each
// row.
@group(2) @binding(6) var rays: texture_2d<f32>;
@group(2) @binding(7) var<storage, read> eyes: array<vec4f>;

fn octahedral(n: vec3f) -> vec2f {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = (1.0 - abs(p.yx)) * select(vec2f(-1.0), vec2f(1.0), p >= vec2f(0.0));
    return select(folded, p, n.z >= 0.0);
}

// Bilinear interpolation in a square of directions, whose rim is folded onto itself.
fn table(first: u32, side: u32, n: vec3f) -> vec3f {
    let p = (octahedral(n) * 0.5 + 0.5) * f32(side - 1u);
    let c = min(vec2u(p), vec2u(side - 2u));
    let f = p - vec2f(c);
    let at = first + c.y * side + c.x;
    let low = mix(tables[at].rgb, tables[at + 1u].rgb, f.x);
    let high = mix(tables[at + side].rgb, tables[at + side + 1u].rgb, f.x);
    return mix(low, high, f.y);
}

fn background(direction: vec3f) -> vec3f {
    return table(0u, SKY_SIDE, direction);
}

fn irradiance(open: f32, n: vec3f) -> vec3f {
    let x = clamp(open, 0.0, 1.0) * f32(OPENNESS_STEPS);
    let i = min(u32(x), OPENNESS_STEPS - 1u);
    let size = AMBIENT_SIDE * AMBIENT_SIDE;
    let first = SKY_SIDE * SKY_SIDE + i * size;
    return mix(table(first, AMBIENT_SIDE, n), table(first + size, AMBIENT_SIDE, n), x - f32(i));
}

// The openness at a point relative to the camera, from a grid.
fn open_in(first: u32, corner: vec3f, step: vec2f, point: vec3f) -> f32 {
    let top = vec3f(f32(GRID_SIDE - 1u), f32(GRID_SIDE - 1u), f32(GRID_UP - 1u));
    let p = clamp((point - corner) / step.xxy, vec3f(0.0), top);
    let c = min(vec3u(p), vec3u(GRID_SIDE - 2u, GRID_SIDE - 2u, GRID_UP - 2u));
    let f = p - vec3f(c);
    let at = first + (c.z * GRID_SIDE + c.y) * GRID_SIDE + c.x;
    let up = GRID_SIDE * GRID_SIDE;
    var layers: vec2f;
    for (var k = 0u; k < 2u; k++) {
        let a = at + k * up;
        let low = mix(light_shares[a], light_shares[a + 1u], f.x);
        let high = mix(light_shares[a + GRID_SIDE], light_shares[a + GRID_SIDE + 1u], f.x);
        layers[k] = mix(low, high, f.y);
    }
    return mix(layers.x, layers.y, f.z);
}

fn openness_at(point: vec3f) -> f32 {
    let near = light.near_grid;
    let inside = abs(point - near.xyz - 0.5 *
        vec3f(vec2f(f32(GRID_SIDE - 1u) * near.w), f32(GRID_UP - 1u) * light.up_and_fog.x));
    let half = 0.5 *
        vec3f(vec2f(f32(GRID_SIDE - 1u) * near.w), f32(GRID_UP - 1u) * light.up_and_fog.x);
    if all(inside < half) {
        return open_in(0u, near.xyz, vec2f(near.w, light.up_and_fog.x), point);
    }
    let far = light.far_grid;
    return open_in(GRID_SIDE * GRID_SIDE * GRID_UP, far.xyz,
        vec2f(far.w, light.up_and_fog.y), point);
}

// The light that what stands on the ground leaves to it at a point relative to the camera.
fn ground_occlusion_at(point: vec3f) -> f32 {
    let side = GROUND_SIDE;
    var first = 2u * GRID_SIDE * GRID_SIDE * GRID_UP;
    var p = (point.xy - light.ground_grids.xy) / GROUND_STEP;
    var fade = 1.0;
    if any(p < vec2f(0.0)) || any(p >= vec2f(f32(side - 1u))) {
        first += side * side;
        p = (point.xy - light.ground_grids.zw) / WIDE_GROUND_STEP;
        let rim = min(p, f32(side - 1u) - p);
        fade = clamp(min(rim.x, rim.y) / GROUND_FADE, 0.0, 1.0);
        if fade == 0.0 {
            return 1.0;
        }
    }
    let c = vec2u(p);
    let f = p - vec2f(c);
    let at = first + c.y * side + c.x;
    let low = mix(light_shares[at], light_shares[at + 1u], f.x);
    let high = mix(light_shares[at + side], light_shares[at + side + 1u], f.x);
    return mix(1.0, mix(low, high, f.y), fade);
}

// Half of the sun's angular width; the half width of a penumbra is this times the distance from its
// caster.
const SUN_RADIUS = 0.00465;
// The distance within which casters are searched, metres, and the texels of a shadow map that are
// read around a point.
const CASTER_M = 30.0;
const REACH = 24.0;
const TAPS = 16;

// Evenly spread points of a disc (Vogel 1979, "A better way to construct the sunflower head").
fn vogel(i: i32, turn: f32) -> vec2f {
    let angle = f32(i) * 2.3999632 + turn;
    return sqrt((f32(i) + 0.5) / f32(TAPS)) * vec2f(cos(angle), sin(angle));
}

// The share of the sun's light that arrives at a point lifted off the surface, by the share of its
// disc that casters in the map leave (Fernando 2005, "Percentage-closer soft shadows"). The taps
// are turned from pixel to pixel, by Jimenez's (2014) interleaved gradient noise.
fn sunlight(s: Surface, lift: vec3f, pixel: vec2f) -> f32 {
    var k = 0u;
    while k < CASCADES - 1u && s.distance_m > light.ends[k] {
        k++;
    }
    let map = light.cascades[k];
    let texel_m = light.texels[k];
    let sun = light.sun.xyz;
    let cosine = dot(s.normal, sun);
    let sine = sqrt(max(1.0 - cosine * cosine, 0.0));
    // The point is moved off the surface towards the sun's side by the width of a texel and of the
    // filter.
    let side = select(-1.0, 1.0, cosine > 0.0 || any(lift != vec3f(0.0)));
    let shift = s.normal * (side * texel_m * (0.5 + 2.0 * sine));
    let at = map * vec4f(s.point + frame.eye.xyz + shift + lift, 1.0);
    let size = vec2f(textureDimensions(shadows));
    let uv = at.xy * vec2f(0.5, -0.5) + 0.5;
    // The change of the surface's own depth from texel to texel, without which slopes would shade
    // themselves.
    let across = normalize(vec3f(map[0].x, map[1].x, map[2].x));
    let up = normalize(vec3f(map[0].y, map[1].y, map[2].y));
    let per_m = length(vec3f(map[0].z, map[1].z, map[2].z));
    let lean = vec2f(-dot(s.normal, across), dot(s.normal, up)) / (side * max(abs(cosine), 0.2));
    let slope = lean * (texel_m * per_m);
    let turn = 6.2831853 * fract(52.9829189 * fract(dot(pixel, vec2f(0.06711056, 0.00583715))));

    let reach = clamp(SUN_RADIUS * CASTER_M / texel_m, 1.5, REACH);
    var above = 0.0;
    var casters = 0.0;
    for (var i = 0; i < TAPS; i++) {
        let tap = vogel(i, turn) * reach;
        let texel = vec2i(clamp(uv * size + tap, vec2f(0.0), size - 1.0));
        let higher = textureLoad(caster_heights, texel, k, 0).x - (at.z + dot(slope, tap));
        if higher > 0.0 {
            above += higher / per_m;
            casters += 1.0;
        }
    }
    if casters == 0.0 {
        return 1.0;
    }
    let radius = clamp(SUN_RADIUS * above / casters / texel_m, 1.0, reach);
    var lit = 0.0;
    for (var i = 0; i < TAPS; i++) {
        let tap = vogel(i, turn) * radius;
        lit += textureSampleCompareLevel(shadows, comparison, uv + tap / size,
            k, at.z + dot(slope, tap));
    }
    return lit / f32(TAPS);
}

// The side of a layer of `albedos`, as a power of two.
const ALBEDO_SIDE: u32 = 10u;

// Square roots of linear light, ten bits each.
fn texel(at: u32) -> vec3f {
    let last = (1u << ALBEDO_SIDE) - 1u;
    let place = vec2u(at & last, (at >> ALBEDO_SIDE) & last);
    let word = textureLoad(albedos, place, at >> (2u * ALBEDO_SIDE), 0).r;
    let root = vec3f(vec3u(word & 1023u, (word >> 10u) & 1023u, word >> 20u)) / 1023.0;
    return root * root;
}

// As Texture::sample: bilinear in the nearest mip.
fn sample(material: u32, uv: vec2f, footprint: f32) -> vec3f {
    var size = vec2u(materials[material].albedo_width, materials[material].albedo_height);
    var first = materials[material].albedo;
    let texels = footprint * f32(max(size.x, size.y));
    var lod = select(0u, u32(log2(max(texels, 1.0)) + 0.5), texels > 1.0);
    while lod > 0u && (size.x > 1u || size.y > 1u) {
        first += size.x * size.y;
        size = max(size / 2u, vec2u(1u));
        lod--;
    }
    let p = fract(uv) * vec2f(size) - 0.5;
    let low = vec2i(floor(p));
    let f = p - vec2f(low);
    let a = vec2u(low) & (size - 1u);
    let b = vec2u(low + 1) & (size - 1u);
    let bottom = mix(texel(first + a.y * size.x + a.x), texel(first + a.y * size.x + b.x), f.x);
    let top = mix(texel(first + b.y * size.x + a.x), texel(first + b.y * size.x + b.x), f.x);
    return mix(bottom, top, f.y);
}

// As hex_tiling.rs: the texture is laid out anew around the vertices of a lattice.
fn hash(x: u32, y: u32) -> u32 {
    let r = y * 0x85EBCA77u;
    var h = (x * 0x9E3779B1u) ^ ((r << 15u) | (r >> 17u));
    h = (h ^ (h >> 16u)) * 0x85EBCA6Bu;
    h = (h ^ (h >> 13u)) * 0xC2B2AE35u;
    return h ^ (h >> 16u);
}

fn value_noise(at: vec2f, cells: u32, salt: u32) -> f32 {
    let p = at * (f32(cells) / 1024.0);
    let i = floor(p);
    var f = p - i;
    f = f * f * (3.0 - 2.0 * f);
    let c = vec2i(i);
    var v: vec4f;
    for (var k = 0; k < 4; k++) {
        let n = vec2u(c + vec2i(k & 1, k >> 1u)) & vec2u(cells - 1u);
        v[k] = f32(hash(n.x | (salt << 16u), n.y) >> 8u) * (2.0 / 16777216.0) - 1.0;
    }
    return mix(mix(v.x, v.y, f.x), mix(v.z, v.w, f.x), f.y);
}

fn laid_anew(material: u32, at: vec2f, tile: f32, footprint: f32) -> vec3f {
    let mean = materials[material].mean_albedo.rgb;
    let columns = max(round(1024.0 / (0.6 * tile)), 2.0);
    let half_rows = max(round(1024.0 / (0.6 * tile * 1.732)), 1.0);
    let step = vec2f(1024.0 / columns, 512.0 / half_rows);
    let y = at.y / step.y;
    let x = at.x / step.x - 0.5 * y;
    let i = vec2f(floor(x), floor(y));
    let f = vec2f(x, y) - i;
    let upper = f.x + f.y >= 1.0;
    var vertices = array<vec3f, 3>(
        vec3f(0.0, 0.0, 1.0 - f.x - f.y), vec3f(1.0, 0.0, f.x), vec3f(0.0, 1.0, f.y));
    if upper {
        vertices = array<vec3f, 3>(
            vec3f(1.0, 1.0, f.x + f.y - 1.0), vec3f(1.0, 0.0, 1.0 - f.y),
                vec3f(0.0, 1.0, 1.0 - f.x));
    }
    var total = 0.0;
    for (var k = 0; k < 3; k++) {
        let w = vertices[k].z * vertices[k].z;
        total += w * w;
    }
    var sum = vec3f(0.0);
    var squares = 0.0;
    var kept = 0.0;
    for (var k = 0; k < 3; k++) {
        let sharp = vertices[k].z * vertices[k].z;
        let w = sharp * sharp / total;
        if w >= 0.02 {
            let v = i + vertices[k].xy;
            let a = 2.0 * v.x + v.y;
            let rows = 2.0 * half_rows;
            let h = hash(u32(a - 2.0 * columns * floor(a / (2.0 * columns))),
                u32(v.y - rows * floor(v.y / rows)));
            let from_vertex = (at - vec2f((v.x + 0.5 * v.y) * step.x, v.y * step.y)) / tile;
            let t = f32((h >> 24u) & 0x7Fu) / 64.0 - 1.0;
            var c = vec2f(1.0 - t * t, 2.0 * t) / (1.0 + t * t);
            c = select(c, -c, (h >> 31u) == 1u);
            let turned = vec2f(c.x * from_vertex.x - c.y * from_vertex.y,
                c.y * from_vertex.x + c.x * from_vertex.y);
            let uv = turned + vec2f(f32(h & 0xFFFu), f32((h >> 12u) & 0xFFFu)) / 4096.0;
            sum += (sample(material, uv, footprint / tile) - mean) * w;
            squares += w * w;
            kept += w;
        }
    }
    return clamp(mean + sum / kept * (kept / sqrt(squares)), vec3f(0.0), vec3f(1.0));
}

// The ground at its coordinates and height, on steep slopes seen from the sides.
fn ground(material: u32, place: vec3f, normal: vec3f, tile: f32, footprint: f32) -> vec3f {
    let at = place.xy;
    let mean = materials[material].mean_albedo.rgb;
    var base = mean;
    if footprint <= tile {
        let n = normal * normal;
        let steep = smoothstep(0.0, 1.0, (0.8 - sqrt(n.z)) / 0.2);
        if steep <= 0.0 {
            base = laid_anew(material, at, tile, footprint);
        } else {
            let along_x = steep * n.x * n.x / max(n.x * n.x + n.y * n.y, 1e-30);
            let shares = vec3f(along_x, steep - along_x, 1.0 - steep);
            var sum = vec3f(0.0);
            for (var k = 0; k < 3; k++) {
                if shares[k] > 0.0 {
                    let seen = select(select(at, place.xz, k == 1), place.yz, k == 0);
                    sum += (laid_anew(material, seen, tile, footprint) - mean) * shares[k];
                }
            }
            base = clamp(mean + sum / length(shares), vec3f(0.0), vec3f(1.0));
        }
    }
    let slow = value_noise(at, 64u, 1u);
    let middle = value_noise(at, 128u, 2u);
    let fast = value_noise(at, 256u, 3u);
    let bright = 1.0 + 0.15 * (0.5 * slow + 0.3 * middle + 0.2 * fast);
    let warm = 0.05 * middle;
    return base * vec3f(1.0 + warm, 1.0, 1.0 - warm) * bright;
}

// The visible share of a blend, as in hex_tiling.rs.
fn ragged(share: f32, at: vec2f) -> f32 {
    let noise = 0.6 * value_noise(at, 8192u, 4u) + 0.4 * value_noise(at, 32768u, 5u);
    let lifted = share + 2.0 * share * (1.0 - share) * noise;
    return smoothstep(0.0, 1.0, 2.5 * (lifted - 0.5) + 0.5);
}

const LUMINANCE = vec3f(0.2126, 0.7152, 0.0722);
// Reflectance of a dielectric at right angles.
const F0: f32 = 0.04;

fn fresnel(f0: f32, f90: f32, cosine: f32) -> f32 {
    let x = clamp(1.0 - cosine, 0.0, 1.0);
    return f0 + (f90 - f0) * x * x * x * x * x;
}

// As haze.rs: the optical depth of the air in front of a surface, from a layer's extinction at the
// camera and its scale height.
fn depth(layer: vec2f, s: Surface) -> f32 {
    let x = s.ray.z * s.distance_m / layer.y;
    let y = max(x, -20.0);
    let series = 1.0 - x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0))));
    return layer.x * s.distance_m * select((1.0 - exp(-y)) / y, series, abs(x) < 0.1);
}

// The radiance that arrives at the camera, air included.
fn shade(s: Surface, pixel: vec2f) -> vec3f {
    let m = materials[s.material];
    let is_ground = (m.flags & 1u) == 1u;
    let cosine = max(abs(dot(s.ray, s.normal)), 0.05);
    let width = s.distance_m * light.sun.w;
    var reflectance: vec3f;
    var roughness = m.transmittance.w;
    if is_ground {
        // Its height in the scene, as the ground's look must not depend on the camera's.
        let place = vec3f(s.uv, s.point.z + frame.eye.z + frame.origin.w);
        // Higher grounds lie on lower ones.
        var grounds = s.grounds;
        var covers = vec3f(1.0, 0.0, 0.0);
        if s.shares.y > 0.0 {
            covers.y = ragged(s.shares.y / (s.shares.x + s.shares.y), s.uv);
        }
        if s.shares.z > 0.0 {
            covers.z = ragged(s.shares.z, s.uv);
        }
        for (var i = 0u; i < 3u; i++) {
            let is_hidden = (i == 0u && max(covers.y, covers.z) >= 1.0)
                || (i == 1u && covers.z >= 1.0);
            if covers[i] > 0.0 && !is_hidden {
                let tile = materials[grounds[i]].mean_albedo.w;
                let over = ground(grounds[i], place, s.shading_normal, tile, width);
                reflectance = mix(reflectance, over, covers[i]);
                roughness = mix(roughness, materials[grounds[i]].transmittance.w, covers[i]);
            }
        }
    } else {
        reflectance = sample(s.material, s.uv, width / sqrt(cosine) * s.uv_per_m);
    }
    var transmittance = m.transmittance.rgb;
    let leaf = any(transmittance != vec3f(0.0));
    let blade = dot(m.mean_albedo.rgb, LUMINANCE);
    if leaf && blade > 1e-3 {
        transmittance *= min(dot(reflectance, LUMINANCE) / blade, 1.25);
    }
    if !is_ground {
        var tint = vec3f(1.0 + 0.24 * (s.variation - 0.5));
        if leaf {
            let yellow = 0.2 * (fract(s.variation * 7.0) - 0.5);
            tint *= vec3f(1.0 + yellow, 1.0, 1.0 - yellow);
        }
        reflectance *= tint;
        transmittance *= tint;
    }
    reflectance = min(reflectance, vec3f(1.0));
    transmittance = min(transmittance, 1.0 - reflectance);
    var gloss = 1.0 - roughness * roughness;
    if gloss < 0.05 {
        gloss = 0.0;
    }
    // A measured albedo contains the sheen; a liquid's is light from below alone.
    let is_liquid = (m.flags & 4u) == 4u;
    let f0 = select(F0, f32(m.flags >> 16u) / 65535.0, is_liquid);
    let in_albedo = select(gloss * F0, 0.0, is_liquid);
    let body = max(reflectance - in_albedo, vec3f(0.0));

    // Sky, leaves and ground.
    let n = s.shading_normal;
    let open = openness_at(s.point);
    var indirect = body * irradiance(open, n);
    if leaf {
        indirect += transmittance * irradiance(open, -n);
    }
    // The share of it that near parts of the shape, and what stands on the ground around, let
    // through, and what they scatter.
    let own = s.ambient_occlusion;
    var on_ground = 1.0;
    if (m.flags & 2u) == 2u {
        on_ground = ground_occlusion_at(s.point);
    }
    indirect *= own / (1.0 - (body + transmittance) * (0.5 * (1.0 - own)));
    indirect *= on_ground / (1.0 - NEAR_GROUND * 0.5 * (1.0 - on_ground));
    indirect /= PI;
    if gloss > 0.0 {
        let f90 = max(1.0 - roughness, f0);
        let specular = gloss * fresnel(f0, f90, max(-dot(s.ray, n), 0.0));
        let mirrored = reflect(s.ray, n);
        let smooth_share = (1.0 - roughness) * (1.0 - roughness);
        let blurred = irradiance(open, mirrored) / PI;
        var seen = blurred;
        if mirrored.z > 0.0 && smooth_share > 0.05 {
            seen = mix(blurred, mix(blurred, background(mirrored), open), smooth_share);
        }
        indirect = indirect * (1.0 - (specular - in_albedo))
            + seen * (specular * own * on_ground);
    }

    // The sun.
    var direct = vec3f(0.0);
    let sun = light.sun.xyz;
    let cos_sun = dot(n, sun);
    let facing = dot(s.normal, sun);
    let front = cos_sun > 0.0 && (facing > 0.0 || is_ground);
    // As in shading.rs: triangles of the ground that face away where light grazes it.
    let lift = n * select(0.0, 0.5 * max(-facing, 0.0), front);
    if any(light.irradiance.rgb > vec3f(0.0)) && (front || (cos_sun < 0.0 && leaf)) {
        if cos_sun <= 0.0 {
            direct = transmittance * (-cos_sun / PI);
        } else {
            direct = body / PI;
            if gloss > 0.0 {
                let h = normalize(sun - s.ray);
                let nh = dot(n, h);
                let vh = max(-dot(s.ray, h), 0.1);
                let alpha = max(roughness * roughness, 0.05);
                let d = nh * nh * (alpha * alpha - 1.0) + 1.0;
                let specular = gloss * fresnel(f0, 1.0, vh) * alpha * alpha / (PI * d * d)
                    / (4.0 * vh * vh);
                direct += specular;
            }
            direct *= cos_sun;
        }
        direct *= light.irradiance.rgb * sunlight(s, lift, pixel);
    }

    // The air in between, as in haze.rs.
    let air = exp(-depth(light.air.xy, s) - depth(light.up_and_fog.zw, s));
    let far = s.distance_m / light.air.z;
    let f2 = far * far;
    let f4 = f2 * f2;
    let f8 = f4 * f4;
    let fade = max(1.0 - f8 * f8, 0.0);
    let behind = background(s.ray);
    let lit = (indirect + direct) * air + behind * (0.5 * (open + light.air.w) * (1.0 - air));
    return mix(behind, lit, fade);
}

// Where the four samples of a pixel are, in Vulkan, Metal and DirectX alike.
const SAMPLES = array<vec2f, 4>(
    vec2f(-0.125, -0.375), vec2f(0.375, -0.125), vec2f(-0.375, 0.125), vec2f(0.125, 0.375));

// The difference of rays from a pixel to the next, over both neighbours where there are two.
fn slope(at: vec2i, to: vec2i) -> vec4f {
    let last = vec2i(textureDimensions(rays)) - 1;
    let before = clamp(at - to, vec2i(0), last);
    let after = clamp(at + to, vec2i(0), last);
    let steps = max(dot(after - before, to), 1);
    return (textureLoad(rays, after, 0) - textureLoad(rays, before, 0)) / f32(steps);
}

// The unit direction through a sample, and its z in the optical frame.
fn ray_of_sample(position: vec2f, k: u32) -> vec4f {
    let offset = select(SAMPLES[k], vec2f(0.0), SINGLE);
    if !DISTORTED {
        return ray_of(position + offset);
    }
    let at = vec2i(position);
    let ray = textureLoad(rays, at, 0)
        + slope(at, vec2i(1, 0)) * offset.x
        + slope(at, vec2i(0, 1)) * offset.y;
    return ray / length(ray.xyz);
}

fn eye_of(position: vec2f) -> vec3f {
    if DISTORTED {
        return eyes[u32(position.y)].xyz;
    }
    return frame.eye.xyz;
}

// The samples in which a primitive is visible. Each is tested with the one-bit mask, which replaces
// alpha to coverage.
fn shown_in(v: Vertex, proposed: u32) -> u32 {
    let i = instances[v.instance];
    let p = primitive(v.primitive);
    let eye = eye_of(v.position.xy);
    var samples = 0u;
    for (var k = 0u; k < 4u; k++) {
        if (proposed >> k & 1u) == 1u {
            let m = intersect(i, p, eye, ray_of_sample(v.position.xy, k).xyz);
            let met = m.t > 0.0 && m.t <= frame.forward.w && (!DISTORTED || is_inside(m));
            if met && is_opaque(p.material, uv_at(v.primitive, m)) {
                samples |= 1u << k;
            }
        }
    }
    return samples;
}

// The surface at the first of the samples.
fn shown(v: Vertex, samples: u32) -> Surface {
    let ray = ray_of_sample(v.position.xy, firstTrailingBit(samples));
    return surface(v, eye_of(v.position.xy), ray);
}

fn painted(s: Surface, pixel: vec2f) -> vec4f {
    return vec4f(min(shade(s, pixel) * light.irradiance.w, vec3f(6e4)), 1.0);
}

// The bits of a pixel's samples in which a primitive is visible; without any, the fragment is
// discarded.
fn of_samples(v: Vertex, proposed: u32) -> u32 {
    let samples = shown_in(v, proposed);
    if samples == 0u {
        discard;
    }
    return samples;
}

// Boxes have no depth of their own.
fn depth_of(s: Surface) -> f32 {
    return min(frame.size.z / s.depth_m, 1.0);
}

struct Painted {
    @location(0) colour: vec4f,
    @builtin(sample_mask) samples: u32,
}

@fragment
fn fragment_masked(v: Vertex, @builtin(sample_mask) proposed: u32) -> Painted {
    let samples = of_samples(v, proposed);
    return Painted(painted(shown(v, samples), v.position.xy), samples);
}

struct PaintedDeep {
    @location(0) colour: vec4f,
    @builtin(sample_mask) samples: u32,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fragment_masked_distorted(v: Vertex, @builtin(sample_mask) proposed: u32) -> PaintedDeep {
    let samples = of_samples(v, proposed);
    let s = shown(v, samples);
    return PaintedDeep(painted(s, v.position.xy), samples, depth_of(s));
}

// With one sample a pixel.
@fragment
fn fragment_single(v: Vertex) -> @location(0) vec4f {
    return painted(shown(v, of_samples(v, 1u)), v.position.xy);
}

struct SingleDeep {
    @location(0) colour: vec4f,
    @builtin(frag_depth) depth: f32,
}

@fragment
fn fragment_single_distorted(v: Vertex) -> SingleDeep {
    let s = shown(v, of_samples(v, 1u));
    return SingleDeep(painted(s, v.position.xy), depth_of(s));
}
