//! Pictures without a window: a device of our own, and reading a texture back.

use super::camera::Camera;
use super::renderer::SceneRenderer;
use super::scene::Scene;
use super::wgpu;
use image::RgbaImage;

/// Why a picture could not be made.
#[derive(Debug, thiserror::Error)]
pub enum RenderError {
    /// There is neither a GPU nor a software rasteriser.
    #[error("no graphics adapter: {source}; on Linux a software one comes with mesa-vulkan-drivers")]
    NoAdapter {
        /// What wgpu said.
        source: wgpu::RequestAdapterError,
    },
    /// The adapter gave no device.
    #[error("the graphics adapter {adapter} gave no device: {source}")]
    NoDevice {
        /// What wgpu said.
        source: wgpu::RequestDeviceError,
        /// The adapter's name.
        adapter: String,
    },
    /// The picture could not be copied back from the device.
    #[error("the picture could not be read back: {reason}")]
    ReadBack {
        /// What wgpu said.
        reason: String,
    },
}

/// A [`SceneRenderer`] with a device of its own, for the command line and the tests.
pub struct HeadlessRenderer {
    device: wgpu::Device,
    queue: wgpu::Queue,
    adapter: wgpu::AdapterInfo,
    renderer: SceneRenderer,
}

impl HeadlessRenderer {
    /// Opens the adapter that the environment asks for (`WGPU_BACKEND`, `WGPU_POWER_PREF`).
    ///
    /// # Errors
    /// Where there is no adapter or it gives no device.
    pub fn new() -> Result<Self, RenderError> {
        let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle_from_env());
        let options = wgpu::RequestAdapterOptions {
            power_preference: wgpu::PowerPreference::from_env().unwrap_or_default(),
            ..wgpu::RequestAdapterOptions::default()
        };
        let adapter = pollster::block_on(instance.request_adapter(&options))
            .map_err(|source| RenderError::NoAdapter { source })?;
        let info = adapter.get_info();
        let descriptor = wgpu::DeviceDescriptor {
            label: Some("headless"),
            required_limits: wgpu::Limits::downlevel_defaults().using_resolution(adapter.limits()),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor))
            .map_err(|source| RenderError::NoDevice { source, adapter: info.name.clone() })?;
        let renderer = SceneRenderer::new(&device, &queue, wgpu::TextureFormat::Rgba8Unorm);
        Ok(Self { device, queue, adapter: info, renderer })
    }

    /// Which adapter draws.
    pub fn adapter(&self) -> &wgpu::AdapterInfo {
        &self.adapter
    }

    /// The renderer, for its counters.
    pub fn renderer(&self) -> &SceneRenderer {
        &self.renderer
    }

    /// Draws a scene and reads it back, premultiplied alpha; `size` is clamped ([`super::clamped_size`]).
    ///
    /// # Errors
    /// Where the device is lost before the picture is back.
    pub fn render(&mut self, size: [u32; 2], scene: &Scene, camera: &Camera) -> Result<RgbaImage, RenderError> {
        self.renderer.render(&self.device, &self.queue, size, scene, camera);
        read_back(&self.device, &self.queue, self.renderer.texture())
    }
}

/// Draws one scene with a device of its own, premultiplied alpha; for many pictures keep a [`HeadlessRenderer`].
///
/// # Errors
/// Where there is no adapter, or it fails.
pub fn render_to_image(size: [u32; 2], scene: &Scene, camera: &Camera) -> Result<RgbaImage, RenderError> {
    HeadlessRenderer::new()?.render(size, scene, camera)
}

/// Copies a texture of four bytes a pixel into an image.
fn read_back(device: &wgpu::Device, queue: &wgpu::Queue, texture: &wgpu::Texture) -> Result<RgbaImage, RenderError> {
    let failed = |reason: &dyn std::fmt::Display| RenderError::ReadBack { reason: reason.to_string() };
    let (width, height) = (texture.width(), texture.height());
    let row = width * 4;
    let padded_row = row.next_multiple_of(wgpu::COPY_BYTES_PER_ROW_ALIGNMENT);
    let buffer = device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: u64::from(padded_row) * u64::from(height),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor { label: Some("read back") });
    let layout = wgpu::TexelCopyBufferLayout { offset: 0, bytes_per_row: Some(padded_row), rows_per_image: None };
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo { buffer: &buffer, layout },
        texture.size(),
    );
    queue.submit([encoder.finish()]);
    let (sender, receiver) = std::sync::mpsc::channel();
    buffer.map_async(wgpu::MapMode::Read, .., move |result| {
        // The receiver lives until the poll below is over; if it does not, nobody waits for the answer.
        let _ = sender.send(result);
    });
    device.poll(wgpu::PollType::wait_indefinitely()).map_err(|error| failed(&error))?;
    receiver.recv().map_err(|error| failed(&error))?.map_err(|error| failed(&error))?;
    let mapped = buffer.get_mapped_range(..).map_err(|error| failed(&error))?;
    let pixels = mapped.chunks(padded_row as usize).flat_map(|line| line.iter().take(row as usize)).copied().collect();
    RgbaImage::from_vec(width, height, pixels).ok_or_else(|| failed(&"the buffer is too short"))
}
