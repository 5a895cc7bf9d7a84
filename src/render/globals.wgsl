// What every shader knows: the picture and the depth buffer. Put in front of each drawable's own text.

struct Globals {
    viewport: vec2<f32>,
    focal: f32,
    sigma: f32,
    contour: f32,
    depth_offset: f32,
    depth_scale: f32,
    padding: f32,
}

@group(0) @binding(0) var<uniform> globals: Globals;

// Clip position of a pixel at a depth-buffer value; w = 1, so everything is interpolated linearly on the screen.
fn clip_from_pixel(px: vec2<f32>, z: f32) -> vec4<f32> {
    let ndc = px / globals.viewport * 2.0 - 1.0;
    return vec4<f32>(ndc.x, -ndc.y, z, 1.0);
}

// The corners of a quad, each -1 or 1, as a triangle strip.
fn corner(index: u32) -> vec2<f32> {
    return vec2<f32>(f32(index & 1u), f32(index >> 1u)) * 2.0 - 1.0;
}
