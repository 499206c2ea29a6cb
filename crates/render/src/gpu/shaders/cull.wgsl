// Finds the instances that each view draws. A workgroup goes through the instances of a prototype
// for a view, and writes the numbers of those that may be visible in their order, so that the
// result does not depend on the order of threads.

struct Frustum {
    // Unit normals that point inwards; w: how far inside the origin is.
    planes: array<vec4f, 6>,
    // w: the greatest visible distance.
    eye: vec4f,
    // w: how far the eye may be from there while the picture is taken.
    axis: vec4f,
    // Cosine and sine of the half angle around the axis that is visible.
    half_angle: vec4f,
}

struct Shape {
    first: u32,
    count: u32,
    // Its first draw in `draws_of`.
    first_draw: u32,
    draws: u32,
}

struct Draw {
    vertices: u32,
    instances: u32,
    first_vertex: u32,
    first_instance: u32,
}

struct Counts {
    shapes: u32,
    // The number of instances of one view.
    instances: u32,
    draws: u32,
}

@group(0) @binding(0) var<uniform> counts: Counts;
@group(0) @binding(1) var<storage, read> frustums: array<Frustum>;
// Relative to the instance buffer's origin; w: radius.
@group(0) @binding(2) var<storage, read> bounding_spheres: array<vec4f>;
@group(0) @binding(3) var<storage, read> shapes: array<Shape>;
// The draws of each shape.
@group(0) @binding(4) var<storage, read> draws_of: array<u32>;
// View by view: numbers of instances, and the draws that use them.
@group(0) @binding(5) var<storage, read_write> visible: array<u32>;
@group(0) @binding(6) var<storage, read_write> draws: array<Draw>;

const LANES = 64u;

// Frustum::may_see without trigonometry.
fn may_see(view: u32, sphere: vec4f) -> bool {
    for (var k = 0; k < 6; k++) {
        if dot(frustums[view].planes[k], vec4f(sphere.xyz, 1.0)) < -sphere.w {
            return false;
        }
    }
    let at = sphere.xyz - frustums[view].eye.xyz;
    let axis = frustums[view].axis;
    let radius = sphere.w + axis.w;
    let distance_m = length(at);
    if distance_m - radius > frustums[view].eye.w {
        return false;
    }
    // A sphere with a larger angular radius than the rest outside of the cone reaches into the
    // cone.
    let cosine = frustums[view].half_angle.x;
    let sine = frustums[view].half_angle.y;
    if distance_m <= radius || (cosine < 0.0 && radius >= sine * distance_m) {
        return true;
    }
    // The cosine of the sum of the half angle and the angular radius of the sphere.
    let tangent_m = sqrt((distance_m - radius) * (distance_m + radius));
    return dot(at, axis.xyz) >= cosine * tangent_m - sine * radius;
}

var<workgroup> sums: array<u32, LANES>;

@compute @workgroup_size(LANES)
fn cull(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) lane: u32,
) {
    let view = workgroup.y;
    for (var index = workgroup.x; index < counts.shapes; index += workgroups.x) {
        let shape = shapes[index];
        var before = 0u;
        for (var strip = 0u; strip < shape.count; strip += LANES) {
            let number = shape.first + strip + lane;
            let seen = strip + lane < shape.count && may_see(view, bounding_spheres[number]);
            // Hillis and Steele's (1986) running sums.
            var sum = u32(seen);
            for (var reach = 1u; reach < LANES; reach *= 2u) {
                sums[lane] = sum;
                workgroupBarrier();
                if lane >= reach {
                    sum += sums[lane - reach];
                }
                workgroupBarrier();
            }
            if seen {
                visible[view * counts.instances + shape.first + before + sum - 1u] = number;
            }
            sums[lane] = sum;
            workgroupBarrier();
            before += sums[LANES - 1u];
            workgroupBarrier();
        }
        for (var k = lane; k < shape.draws; k += LANES) {
            draws[view * counts.draws + draws_of[shape.first_draw + k]].instances = before;
        }
    }
}
