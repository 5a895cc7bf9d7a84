// Opaque lit ellipsoids, one ray a pixel; ellipsoids.rs holds the mathematics and the CPU twin.

struct Instance {
    @location(0) bounds: vec4<f32>,
    @location(1) center: vec3<f32>,
    @location(2) inverse_x: vec3<f32>,
    @location(3) inverse_yz: vec3<f32>,
    @location(4) color: vec4<f32>,
}

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) @interpolate(flat) center: vec3<f32>,
    @location(1) @interpolate(flat) inverse_x: vec3<f32>,
    @location(2) @interpolate(flat) inverse_yz: vec3<f32>,
    @location(3) @interpolate(flat) color: vec3<f32>,
}

struct Surface {
    @builtin(frag_depth) z: f32,
    @location(0) color: vec4<f32>,
}

const LIGHT = vec3<f32>(-0.36, 0.48, -0.8);
const NEAR_M = 0.02;

@vertex
fn vertex(@builtin(vertex_index) index: u32, e: Instance) -> Varying {
    let px = mix(e.bounds.xy, e.bounds.zw, corner(index) * 0.5 + 0.5);
    return Varying(clip_from_pixel(px, 0.5), e.center, e.inverse_x, e.inverse_yz, e.color.rgb);
}

@fragment
fn fragment(in: Varying) -> Surface {
    let ix = in.inverse_x;
    let iyz = in.inverse_yz;
    let inverse = mat3x3<f32>(
        vec3<f32>(ix.x, ix.y, ix.z), vec3<f32>(ix.y, iyz.x, iyz.y), vec3<f32>(ix.z, iyz.y, iyz.z)
    );
    let px = in.position.xy;
    let depth = in.center.z;
    let slope = (px - globals.viewport * 0.5) / globals.focal;
    let d = vec3<f32>(slope.x, -slope.y, 1.0);
    let s0 = vec3<f32>(px.x - in.center.x, in.center.y - px.y, 0.0) * (depth / globals.focal);
    let ad = inverse * d;
    let as0 = inverse * s0;
    let a = dot(d, ad);
    let b = dot(s0, ad);
    let q = max(dot(s0, as0) - b * b / a, 0.0);
    let r = sqrt(q);
    let closest = -b / a;
    let slope_per_px = length((as0 + ad * closest).xy) * (depth + closest) / globals.focal;
    var inside_px = 1e6;
    if r > 1e-6 {
        inside_px = (1.0 - r) * r / max(slope_per_px, 1e-12);
    }
    let coverage = clamp(inside_px + 0.5, 0.0, 1.0);
    if coverage <= 1.0 / 256.0 {
        discard;
    }
    let tau = closest - sqrt(max(1.0 - q, 0.0) / a);
    let normal = normalize(as0 + ad * tau);
    let shade = 0.6 + 0.4 * max(dot(normal, LIGHT), 0.0);
    let z = globals.depth_offset - globals.depth_scale / max(depth + tau, NEAR_M);
    return Surface(z, vec4<f32>(in.color * shade * coverage, coverage));
}
