//! The GPU renderer: one pass into an offscreen colour and depth texture that are kept between pictures.

use super::camera::Camera;
use super::cpu::premultiplied;
use super::order::{DrawList, DrawRun, Kind};
use super::pipeline::DEPTH_FORMAT;
use super::projection::Globals;
use super::scene::{Scene, SceneMode, Undrawable};
use super::{ellipsoids, gaussians, lines, wgpu};
use std::hash::{DefaultHasher, Hash, Hasher};

/// The longest side of a picture, px.
pub const MAX_SIDE_PX: u32 = 4096;

/// A size that can be rendered: at least 1×1, and scaled down, in its proportions, until no side is longer than
/// `max_side`.
pub fn clamped_size([width, height]: [u32; 2], max_side: u32) -> [u32; 2] {
    let (width, height) = (width.max(1), height.max(1));
    let longest = width.max(height);
    if longest <= max_side {
        return [width, height];
    }
    [width, height].map(|n| ((u64::from(n) * u64::from(max_side) / u64::from(longest)) as u32).max(1))
}

/// Draws [`Scene`]s with its own pipelines; owns its textures and buffers. One for each pane that shows a scene.
pub struct SceneRenderer {
    format: wgpu::TextureFormat,
    splats: Batch,
    ellipsoids: Batch,
    lines: Batch,
    overlay: Batch,
    uniform: wgpu::Buffer,
    bind_group: wgpu::BindGroup,
    target: Target,
    drawn: Option<u64>,
    pictures: u64,
    target_generation: u64,
    skipped: Undrawable,
}

/// A pipeline and the instances it draws.
struct Batch {
    pipeline: wgpu::RenderPipeline,
    buffer: wgpu::Buffer,
}

struct Target {
    size: [u32; 2],
    color: wgpu::Texture,
    color_view: wgpu::TextureView,
    depth_view: wgpu::TextureView,
}

impl SceneRenderer {
    /// Builds the pipelines. `format` is the window's; the picture has the same without sRGB encoding, and holds
    /// sRGB-encoded values with premultiplied alpha, which is what egui expects of a native texture.
    pub fn new(device: &wgpu::Device, _queue: &wgpu::Queue, format: wgpu::TextureFormat) -> Self {
        let format = format.remove_srgb_suffix();
        let uniform = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("scene globals"),
            size: size_of::<Globals>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let bind_layout = bind_group_layout(device);
        let bind_group = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("scene globals"),
            layout: &bind_layout,
            entries: &[wgpu::BindGroupEntry { binding: 0, resource: uniform.as_entire_binding() }],
        });
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("scene"),
            bind_group_layouts: &[Some(&bind_layout)],
            immediate_size: 0,
        });
        let batch = |drawable: &super::pipeline::Drawable| Batch {
            pipeline: drawable.pipeline(device, &layout, format),
            buffer: instance_buffer(device, 64 * drawable.stride as u64),
        };
        Self {
            format,
            splats: batch(&gaussians::DRAWABLE),
            ellipsoids: batch(&ellipsoids::DRAWABLE),
            lines: batch(&lines::DRAWABLE),
            overlay: batch(&lines::OVERLAY),
            uniform,
            bind_group,
            target: Target::new(device, format, [1, 1]),
            drawn: None,
            pictures: 0,
            target_generation: 0,
            skipped: Undrawable::default(),
        }
    }

    /// Draws the scene, `size` physical pixels large (clamped: [`clamped_size`]), and returns the colour texture. Does
    /// nothing where scene, camera and size are those of the last call. The view stays the same object until
    /// [`Self::target_generation`] changes.
    pub fn render(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        size: [u32; 2],
        scene: &Scene,
        camera: &Camera,
    ) -> &wgpu::TextureView {
        let size = clamped_size(size, MAX_SIDE_PX.min(device.limits().max_texture_dimension_2d));
        let key = fingerprint(size, scene, camera);
        if self.drawn != Some(key) {
            if self.target.size != size {
                self.target = Target::new(device, self.format, size);
                self.target_generation += 1;
            }
            self.draw(device, queue, &DrawList::new(scene, camera, size), scene.background);
            self.skipped = scene.undrawable();
            self.drawn = Some(key);
            self.pictures += 1;
        }
        &self.target.color_view
    }

    /// How many pictures were really drawn.
    pub fn pictures(&self) -> u64 {
        self.pictures
    }

    /// Changes whenever the texture behind the returned view is a new one (its size changed).
    pub fn target_generation(&self) -> u64 {
        self.target_generation
    }

    /// How many instances of the last scene could not be drawn ([`Scene::undrawable`]).
    pub fn skipped(&self) -> Undrawable {
        self.skipped
    }

    /// The colour texture: format, size, and usable as a copy source.
    pub fn texture(&self) -> &wgpu::Texture {
        &self.target.color
    }

    fn draw(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, prepared: &DrawList, background: [f32; 4]) {
        queue.write_buffer(&self.uniform, 0, bytemuck::bytes_of(&prepared.globals));
        self.splats.upload(device, queue, &prepared.splats);
        self.ellipsoids.upload(device, queue, &prepared.ellipsoids);
        self.lines.upload(device, queue, &prepared.lines);
        self.overlay.upload(device, queue, &prepared.overlay);
        let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("scene") });
        {
            let mut pass = self.target.begin_pass(&mut encoder, background);
            pass.set_bind_group(0, &self.bind_group, &[]);
            for run in &prepared.runs {
                self.draw_run(&mut pass, run);
            }
        }
        queue.submit([encoder.finish()]);
    }

    fn draw_run(&self, pass: &mut wgpu::RenderPass<'_>, run: &DrawRun) {
        let batch = match run.kind {
            Kind::Splat => &self.splats,
            Kind::Ellipsoid => &self.ellipsoids,
            Kind::Line => &self.lines,
            Kind::Overlay => &self.overlay,
        };
        pass.set_pipeline(&batch.pipeline);
        pass.set_vertex_buffer(0, batch.buffer.slice(..));
        pass.draw(0..4, run.range.clone());
    }
}

impl Batch {
    fn upload<T: bytemuck::Pod>(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, instances: &[T]) {
        let bytes: &[u8] = bytemuck::cast_slice(instances);
        if bytes.is_empty() {
            return;
        }
        if self.buffer.size() < bytes.len() as u64 {
            self.buffer = instance_buffer(device, (bytes.len() as u64).next_power_of_two());
        }
        queue.write_buffer(&self.buffer, 0, bytes);
    }
}

impl Target {
    fn new(device: &wgpu::Device, format: wgpu::TextureFormat, size: [u32; 2]) -> Self {
        let texture = |label, format, usage| {
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size[0], height: size[1], depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format,
                usage: usage | wgpu::TextureUsages::RENDER_ATTACHMENT,
                view_formats: &[],
            })
        };
        let usage = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let color = texture("scene colour", format, usage);
        let depth = texture("scene depth", DEPTH_FORMAT, wgpu::TextureUsages::empty());
        let view = |texture: &wgpu::Texture| texture.create_view(&wgpu::TextureViewDescriptor::default());
        Self { size, color_view: view(&color), depth_view: view(&depth), color }
    }

    fn begin_pass<'a>(&self, encoder: &'a mut wgpu::CommandEncoder, background: [f32; 4]) -> wgpu::RenderPass<'a> {
        let [r, g, b, a] = premultiplied(background).map(f64::from);
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("scene"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.color_view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a }),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth_view,
                depth_ops: Some(wgpu::Operations { load: wgpu::LoadOp::Clear(1.0), store: wgpu::StoreOp::Discard }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}

fn instance_buffer(device: &wgpu::Device, size: u64) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("scene instances"),
        size,
        usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("scene globals"),
        entries: &[wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        }],
    })
}

/// A hash of everything a picture depends on.
fn fingerprint(size: [u32; 2], scene: &Scene, camera: &Camera) -> u64 {
    let mut hasher = DefaultHasher::new();
    let Camera { target, distance, yaw, pitch, fov_y } = camera;
    let look = [scene.sigma, scene.contour, scene.largest, *fov_y];
    let numbers = [target.x, target.y, target.z, *distance, *yaw, *pitch];
    (size, look.map(f32::to_bits), numbers.map(f32::to_bits), scene.background.map(f32::to_bits)).hash(&mut hasher);
    (scene.mode == SceneMode::Ellipsoid).hash(&mut hasher);
    bytemuck::cast_slice::<_, u8>(&scene.splats).hash(&mut hasher);
    bytemuck::cast_slice::<_, u8>(&scene.lines).hash(&mut hasher);
    bytemuck::cast_slice::<_, u8>(&scene.overlay).hash(&mut hasher);
    hasher.finish()
}
