//! What all drawables' pipelines have in common: instanced quads, premultiplied blending, one uniform buffer.

use super::wgpu;

/// The depth buffer's format.
pub(super) const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// How a drawable uses the depth buffer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Depth {
    /// Hidden by what is nearer, hides nothing.
    Test,
    /// Hidden by what is nearer, hides what is farther.
    TestAndWrite,
    /// On top of everything.
    Ignore,
}

/// A drawable: its shader (entry points `vertex` and `fragment`) and the layout of its instances.
pub(super) struct Drawable {
    pub(super) label: &'static str,
    pub(super) shader: &'static str,
    pub(super) stride: usize,
    pub(super) attributes: &'static [wgpu::VertexAttribute],
    pub(super) depth: Depth,
}

impl Drawable {
    /// Builds its pipeline for a colour target.
    pub(super) fn pipeline(
        &self,
        device: &wgpu::Device,
        layout: &wgpu::PipelineLayout,
        format: wgpu::TextureFormat,
    ) -> wgpu::RenderPipeline {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(self.label),
            source: wgpu::ShaderSource::Wgsl(self.shader.into()),
        });
        let target = wgpu::ColorTargetState {
            format,
            blend: Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING),
            write_mask: wgpu::ColorWrites::ALL,
        };
        device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(self.label),
            layout: Some(layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[Some(wgpu::VertexBufferLayout {
                    array_stride: self.stride as u64,
                    step_mode: wgpu::VertexStepMode::Instance,
                    attributes: self.attributes,
                })],
            },
            primitive: wgpu::PrimitiveState {
                topology: wgpu::PrimitiveTopology::TriangleStrip,
                ..wgpu::PrimitiveState::default()
            },
            depth_stencil: Some(self.depth_state()),
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(target)],
            }),
            multiview_mask: None,
            cache: None,
        })
    }

    fn depth_state(&self) -> wgpu::DepthStencilState {
        let (write, compare) = match self.depth {
            Depth::Test => (false, wgpu::CompareFunction::LessEqual),
            Depth::TestAndWrite => (true, wgpu::CompareFunction::LessEqual),
            Depth::Ignore => (false, wgpu::CompareFunction::Always),
        };
        wgpu::DepthStencilState {
            format: DEPTH_FORMAT,
            depth_write_enabled: Some(write),
            depth_compare: Some(compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }
    }
}
