//! The three programs that draw the model and its background, and the one that smooths edges.

use super::Gpu;
use super::look::Lighting;
use super::model::{FixedVertex, MovingVertex};

/// What the picture is drawn to. The shader encodes sRGB itself: not every adapter can.
pub(super) const COLOUR: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// The depth buffer.
pub(super) const DEPTH: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// The programs for pictures of one number of samples a pixel.
#[derive(Debug)]
pub(super) struct Pipelines {
    pub frame_layout: wgpu::BindGroupLayout,
    lit: wgpu::RenderPipeline,
    unlit: wgpu::RenderPipeline,
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
        let draw = |layout, vertex, fragment, buffers, nearest| {
            pipeline(gpu, &module, layout, [vertex, fragment], buffers, Some(depth(nearest)), samples)
        };
        Self {
            lit: draw(&with_material, "model_vertex", "lit_fragment", &buffers, true),
            unlit: draw(&with_material, "model_vertex", "unlit_fragment", &buffers, true),
            background: draw(&alone, "background_vertex", "background_fragment", &[], false),
            frame_layout,
        }
    }

    pub(super) fn model(&self, lighting: Lighting) -> &wgpu::RenderPipeline {
        match lighting {
            Lighting::Lit | Lighting::Clay => &self.lit,
            Lighting::Unlit => &self.unlit,
        }
    }
}

/// Reads one finished picture and writes another with smoother edges.
#[derive(Debug)]
pub(super) struct EdgePass {
    pub pipeline: wgpu::RenderPipeline,
    pub picture: wgpu::BindGroup,
}

impl EdgePass {
    pub(super) fn new(gpu: &Gpu, picture: &wgpu::TextureView) -> Self {
        let module = gpu.device.create_shader_module(wgpu::include_wgsl!("edges.wgsl"));
        let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        let pictures = gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("finished picture"),
            entries: &[
                entry(
                    0,
                    wgpu::BindingType::Texture {
                        sample_type: wgpu::TextureSampleType::Float { filterable: true },
                        view_dimension: wgpu::TextureViewDimension::D2,
                        multisampled: false,
                    },
                ),
                entry(1, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
            ],
        });
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("finished picture"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let entries = ["whole_vertex", "edges_fragment"];
        Self {
            pipeline: pipeline(gpu, &module, &layout(gpu, &[&pictures]), entries, &[], None, 1),
            picture: gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("finished picture"),
                layout: &pictures,
                entries: &[
                    wgpu::BindGroupEntry {
                        binding: 0,
                        resource: wgpu::BindingResource::TextureView(picture),
                    },
                    wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&sampler) },
                ],
            }),
        }
    }
}

fn layout(gpu: &Gpu, groups: &[&wgpu::BindGroupLayout]) -> wgpu::PipelineLayout {
    let groups: Vec<_> = groups.iter().copied().map(Some).collect();
    gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &groups,
        immediate_size: 0,
    })
}

fn vertex_layout(stride: usize, attributes: &[wgpu::VertexAttribute]) -> wgpu::VertexBufferLayout<'_> {
    wgpu::VertexBufferLayout {
        array_stride: stride as u64,
        step_mode: wgpu::VertexStepMode::Vertex,
        attributes,
    }
}

/// The model keeps what is nearest; the background fills what the model leaves.
fn depth(nearest: bool) -> wgpu::DepthStencilState {
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
fn pipeline(
    gpu: &Gpu,
    module: &wgpu::ShaderModule,
    layout: &wgpu::PipelineLayout,
    [vertex, fragment]: [&str; 2],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    depth_stencil: Option<wgpu::DepthStencilState>,
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
        depth_stencil,
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
