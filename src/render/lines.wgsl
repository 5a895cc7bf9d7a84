// Thick antialiased lines; lines.rs holds the clipping, the cutting and the CPU twin of the fragment.

struct Instance {
    @location(0) start: vec2<f32>,
    @location(1) direction: vec2<f32>,
    @location(2) shape: vec2<f32>,
    @location(3) piece: vec2<f32>,
    @location(4) z: vec2<f32>,
    @location(5) color: vec4<f32>,
}

struct Varying {
    @builtin(position) position: vec4<f32>,
    // Along and across the line, px.
    @location(0) offset: vec2<f32>,
    @location(1) @interpolate(flat) shape: vec2<f32>,
    @location(2) @interpolate(flat) color: vec4<f32>,
}

@vertex
fn vertex(@builtin(vertex_index) index: u32, line: Instance) -> Varying {
    let side = corner(index);
    let at_end = side.x > 0.0;
    let offset = vec2<f32>(select(line.piece.x, line.piece.y, at_end), side.y * (line.shape.y + 1.0));
    let across = vec2<f32>(-line.direction.y, line.direction.x);
    let px = line.start + line.direction * offset.x + across * offset.y;
    return Varying(clip_from_pixel(px, select(line.z.x, line.z.y, at_end)), offset, line.shape, line.color);
}

@fragment
fn fragment(in: Varying) -> @location(0) vec4<f32> {
    let beyond = max(max(-in.offset.x, in.offset.x - in.shape.x), 0.0);
    let coverage = clamp(in.shape.y + 0.5 - length(vec2<f32>(beyond, in.offset.y)), 0.0, 1.0);
    let alpha = in.color.a * coverage;
    if alpha <= 1.0 / 512.0 {
        discard;
    }
    return vec4<f32>(in.color.rgb * alpha, alpha);
}
