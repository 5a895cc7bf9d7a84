// Gaussian splats; gaussians.rs holds the projection and the CPU twin of the fragment.

struct Instance {
    @location(0) center: vec2<f32>,
    @location(1) axis: vec2<f32>,
    @location(2) sigma: vec2<f32>,
    @location(3) color: vec4<f32>,
    @location(4) z: f32,
}

struct Varying {
    @builtin(position) position: vec4<f32>,
    @location(0) q: vec2<f32>,
    @location(1) @interpolate(flat) sigma: vec2<f32>,
    @location(2) @interpolate(flat) color: vec4<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, splat: Instance) -> Varying {
    let q = corner(index) * (globals.sigma + 1.0 / splat.sigma);
    let along = q * splat.sigma;
    let px = splat.center + splat.axis * along.x + vec2<f32>(-splat.axis.y, splat.axis.x) * along.y;
    return Varying(clip_from_pixel(px, splat.z), q, splat.sigma, splat.color);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let r = length(in.q);
    var inside_px = 1e6;
    if r > 1e-6 {
        inside_px = (globals.sigma - r) * r / length(in.q / in.sigma);
    }
    let fill = exp(-0.5 * r * r) * clamp(inside_px + 0.5, 0.0, 1.0);
    let ring = globals.contour * clamp(1.0 - abs(inside_px), 0.0, 1.0);
    let alpha = in.color.a * (1.0 - (1.0 - fill) * (1.0 - ring));
    if alpha <= 1.0 / 1024.0 {
        discard;
    }
    return vec4<f32>(in.color.rgb * alpha, alpha);
}
