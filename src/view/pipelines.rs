//! The programs that draw the model and its background.

use super::Gpu;
use super::look::Lighting;
use super::model::{FixedVertex, MovingVertex, Part};

/// What the picture is drawn to. The shader encodes sRGB itself: not every adapter can.
pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// The depth buffer.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The programs for pictures of one number of samples a pixel.
#[derive(Debug)]
pub(super) struct Pipelines {
    pub frame_layout: wgpu::BindGroupLayout,
    textured: wgpu::RenderPipeline,
    plain: wgpu::RenderPipeline,
    glossy: wgpu::RenderPipeline,
    unlit_textured: wgpu::RenderPipeline,
    unlit_plain: wgpu::RenderPipeline,
    pub background: wgpu::RenderPipeline,
}

impl Pipelines {
    pub(super) fn new(gpu: &Gpu, samples: u32) -> Self {
        let module = gpu.device.create_shader_module(wgpu::include_wgsl!("shade.wgsl"));
        let frame_layout = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("frame"),
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
        });
        let with_material = layout(gpu, &[&frame_layout, &gpu.material_layout]);
        let alone = layout(gpu, &[&frame_layout]);
        let fixed = wgpu::vertex_attr_array![0 => Float32x2, 1 => Unorm8x4];
        let moving = wgpu::vertex_attr_array![2 => Float32x3, 3 => Float32x3];
        let buffers = [
            Some(vertex_layout(size_of::<FixedVertex>(), &fixed)),
            Some(vertex_layout(size_of::<MovingVertex>(), &moving)),
        ];
        let draw = |name: &str| {
            let entries = [&*format!("{name}_vertex"), &*format!("{name}_fragment")];
            pipeline(gpu, &module, &with_material, entries, &buffers, depth(true), samples)
        };
        Self {
            textured: draw("textured"),
            plain: draw("plain"),
            glossy: draw("glossy"),
            unlit_textured: draw("unlit_textured"),
            unlit_plain: draw("unlit_plain"),
            background: pipeline(
                gpu,
                &module,
                &alone,
                ["background_vertex", "background_fragment"],
                &[],
                depth(false),
                samples,
            ),
            frame_layout,
        }
    }

    pub(super) fn part(&self, lighting: Lighting, part: &Part) -> &wgpu::RenderPipeline {
        match (lighting, part.textured) {
            (Lighting::Lit, _) if part.glossy => &self.glossy,
            (Lighting::Lit, true) => &self.textured,
            (Lighting::Lit, false) | (Lighting::Clay, _) => &self.plain,
            (Lighting::Unlit, true) => &self.unlit_textured,
            (Lighting::Unlit, false) => &self.unlit_plain,
        }
    }
}

pub(super) fn layout(gpu: &Gpu, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().copied().map(Some).collect();
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

pub(super) fn vertex_layout(
    stride: usize,
    attributes: &[wgpu::VertexAttribute],
) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: stride as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}

/// The model keeps what is nearest; the background fills what the model leaves.
pub(super) fn depth(nearest: bool) -> wgpu::DepthStencilState {
    wgpu::DepthStencilState {
        format: DEPTH,
        depth_write_enabled: Some(nearest),
        depth_compare: Some(if nearest {
            wgpu::CompareFunction::Less
        } else {
            wgpu::CompareFunction::LessEqual
        }),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    }
}

/// Both sides of every triangle are drawn: scans are open shells.
pub(super) fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    [vertex, fragment]: [&str; 2],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    depth_stencil: wgpu::DepthStencilState,
    samples: u32,
) -> wgpu::RenderPipeline {
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: Some(layout),
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers,
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(depth_stencil),
        multisample: wgpu::MultisampleState { count: samples, ..wgpu::MultisampleState::default() },
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(COLOUR.into())],
        }),
        multiview_mask: None,
        cache: None,
    })
}
