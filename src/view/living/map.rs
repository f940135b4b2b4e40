//! The map of the shared frame, drawn anew whenever the states change.

use bytemuck::{Pod, Zeroable};
use half::f16;

use super::super::{Gpu, ViewError, model::filled};
use crate::appearance::{ALPHA_RAMP, AppearanceStates, Area, FRAME_SIZE, FaceFrame, Region, TextureVolume};

/// Enough for sums of logarithms and for squared colours; every device filters and blends it.
const MAP: wgpu::TextureFormat = wgpu::TextureFormat::Rgba16Float;

/// What of the layers is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SkinMode {
    /// Light and dark: the target's own colour times the ratio to the neutral. On any face.
    #[default]
    Ratio,
    /// The layers' own colours in place of the target's. On the performer's own avatar.
    Own,
}

#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct RegionUniform {
    origin: [f32; 2],
    size: [f32; 2],
    centre: [f32; 2],
    across: [f32; 2],
    down: [f32; 2],
    halves: [f32; 2],
    frame: [f32; 2],
    ramp: f32,
    layer: f32,
    state: f32,
    gain: f32,
    own: f32,
    padding: f32,
}

#[derive(Debug)]
struct OnDevice {
    region: Region,
    layers: usize,
    uniform: RegionUniform,
    buffer: wgpu::Buffer,
    group: wgpu::BindGroup,
}

/// Volumes and the map that they are drawn into.
#[derive(Debug)]
pub(super) struct SkinMap {
    volumes: Vec<OnDevice>,
    program: wgpu::RenderPipeline,
    view: wgpu::TextureView,
    /// As the scan's programs take the map.
    pub group: wgpu::BindGroup,
    pub layout: wgpu::BindGroupLayout,
    states: AppearanceStates,
    stale: bool,
}

impl SkinMap {
    pub fn upload(
        gpu: &Gpu,
        frame: &FaceFrame,
        volumes: &[TextureVolume],
        mode: SkinMode,
        gain: f32,
    ) -> Result<Self, ViewError> {
        let limit = gpu.device.limits().max_texture_dimension_3d;
        let bound = |volume: &TextureVolume| volume.patch().size.map(u32::from);
        if let Some([width, height]) = volumes.iter().map(bound).find(|size| size.iter().any(|s| *s > limit))
        {
            let reason = format!("a volume of skin may have {limit} pixels a side on this adapter");
            return Err(ViewError::Size { width, height, reason });
        }
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("skin"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..wgpu::SamplerDescriptor::default()
        });
        let volume_layout = layout(gpu, wgpu::TextureViewDimension::D3, [0, 1, 2]);
        let program = program(gpu, &volume_layout);
        let volumes = volumes
            .iter()
            .map(|volume| OnDevice::upload(gpu, frame, volume, mode, gain, &volume_layout, &sampler))
            .collect();
        let [width, height] = FRAME_SIZE.map(|side| side as u32);
        let map = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("skin map"),
            size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: MAP,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
            view_formats: &[],
        });
        let view = map.create_view(&wgpu::TextureViewDescriptor::default());
        let own = [f32::from(u8::from(mode == SkinMode::Own)), 0.0, 0.0, 0.0];
        let uniform = filled(gpu, "skin", uniform_usage(), bytemuck::cast_slice(&own));
        let layout = layout(gpu, wgpu::TextureViewDimension::D2, [2, 0, 1]);
        let group = group(gpu, &layout, &uniform, &view, &sampler, [2, 0, 1]);
        let states = AppearanceStates::default();
        let map = Self { volumes, program, view, group, layout, states, stale: true };
        gpu.check()?;
        Ok(map)
    }

    /// What the next picture shows.
    pub fn show(&mut self, states: &AppearanceStates) {
        self.stale |= self.states != *states;
        self.states = *states;
    }

    /// Whether no region is anything but neutral.
    pub fn is_neutral(&self) -> bool {
        self.volumes.iter().all(|volume| self.state(volume) <= 0.0)
    }

    fn state(&self, volume: &OnDevice) -> f32 {
        self.states.get(volume.region).unwrap_or(0.0)
    }

    /// Draws the map, if the states have changed since it was drawn last.
    pub fn compose(&mut self, gpu: &Gpu, encoder: &mut wgpu::CommandEncoder) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("skin map"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &self.view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: wgpu::LoadOp::Clear(wgpu::Color::TRANSPARENT),
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: None,
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&self.program);
        for volume in &self.volumes {
            let state = self.state(volume);
            if state <= 0.0 {
                continue;
            }
            let last = (volume.layers - 1) as f32;
            let layer = (state * last + 0.5) / volume.layers as f32;
            let uniform = RegionUniform { layer, state, ..volume.uniform };
            gpu.queue.write_buffer(&volume.buffer, 0, bytemuck::bytes_of(&uniform));
            pass.set_bind_group(0, &volume.group, &[]);
            pass.draw(0..4, 0..1);
        }
    }
}

impl OnDevice {
    fn upload(
        gpu: &Gpu,
        frame: &FaceFrame,
        volume: &TextureVolume,
        mode: SkinMode,
        gain: f32,
        layout: &wgpu::BindGroupLayout,
        sampler: &wgpu::Sampler,
    ) -> Self {
        let (patch, area) = (volume.patch(), Area::of(volume.region(), frame));
        let pair = |v: nalgebra::Vector2<f64>| [v.x as f32, v.y as f32];
        let uniform = RegionUniform {
            origin: patch.origin.map(f32::from),
            size: patch.size.map(f32::from),
            centre: pair(area.centre.coords),
            across: pair(area.across / area.across.norm_squared()),
            down: pair(area.down / area.down.norm_squared()),
            halves: [area.across.norm() as f32, area.down.norm() as f32],
            frame: FRAME_SIZE.map(|side| side as f32),
            ramp: ALPHA_RAMP as f32,
            layer: 0.0,
            state: 0.0,
            gain,
            own: f32::from(u8::from(mode == SkinMode::Own)),
            padding: 0.0,
        };
        let buffer = filled(gpu, "skin region", uniform_usage(), bytemuck::bytes_of(&uniform));
        let (format, texels) = match mode {
            SkinMode::Ratio => (wgpu::TextureFormat::R16Float, ratios(volume)),
            SkinMode::Own => (wgpu::TextureFormat::Rgba16Float, colours(volume)),
        };
        let [width, height] = patch.size.map(u32::from);
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: volume.layers().len() as u32 };
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some("texture volume"),
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D3,
            format,
            usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        let bytes: &[u8] = bytemuck::cast_slice(&texels);
        let rows = height * volume.layers().len() as u32;
        gpu.queue.write_texture(
            texture.as_image_copy(),
            bytes,
            wgpu::TexelCopyBufferLayout {
                offset: 0,
                bytes_per_row: Some(bytes.len() as u32 / rows.max(1)),
                rows_per_image: Some(height),
            },
            size,
        );
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        let group = group(gpu, layout, &buffer, &view, sampler, [0, 1, 2]);
        Self { region: volume.region(), layers: volume.layers().len(), uniform, buffer, group }
    }
}

/// Every layer's ratios, in halves of a float.
fn ratios(volume: &TextureVolume) -> Vec<u16> {
    let pixels = volume.patch().pixels();
    let layers = volume.layers().iter();
    layers
        .flat_map(|layer| (0..pixels).map(|pixel| f16::from_f32(layer.log_ratio(pixel)).to_bits()))
        .collect()
}

/// Every layer's colours, squared as the scan's shader adds light, and their share: the neutral layer is the target's own
/// skin, so that the way to the first layer beyond it is a cross-fade and the neutral nothing at all.
fn colours(volume: &TextureVolume) -> Vec<u16> {
    let pixels = volume.patch().pixels();
    let layers = volume.layers().iter().enumerate();
    let texels = layers.flat_map(|(depth, layer)| {
        (0..pixels).map(move |pixel| {
            let [r, g, b] = layer.colour(pixel).map(|channel| (f32::from(channel) / 255.0).powi(2));
            if depth == 0 { [0.0; 4] } else { [r, g, b, 1.0] }
        })
    });
    texels.flatten().map(|value| f16::from_f32(value).to_bits()).collect()
}

fn uniform_usage() -> wgpu::BufferUsages {
    wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST
}

/// A uniform, a texture and a sampler, at the given bindings.
fn layout(
    gpu: &Gpu,
    view_dimension: wgpu::TextureViewDimension,
    [uniform, texture, sampler]: [u32; 3],
) -> wgpu::BindGroupLayout {
    let entry = |binding, ty| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
        ty,
        count: None,
    };
    let buffer = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let sample_type = wgpu::TextureSampleType::Float { filterable: true };
    let picture = wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false };
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("skin"),
        entries: &[
            entry(uniform, buffer),
            entry(texture, picture),
            entry(sampler, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
        ],
    })
}

fn group(
    gpu: &Gpu,
    layout: &wgpu::BindGroupLayout,
    buffer: &wgpu::Buffer,
    view: &wgpu::TextureView,
    sampler: &wgpu::Sampler,
    [uniform, texture, sampled]: [u32; 3],
) -> wgpu::BindGroup {
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("skin"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: uniform, resource: buffer.as_entire_binding() },
            wgpu::BindGroupEntry { binding: texture, resource: wgpu::BindingResource::TextureView(view) },
            wgpu::BindGroupEntry { binding: sampled, resource: wgpu::BindingResource::Sampler(sampler) },
        ],
    })
}

/// Draws regions onto the map, one added to the other.
fn program(gpu: &Gpu, volume_layout: &wgpu::BindGroupLayout) -> wgpu::RenderPipeline {
    let module = gpu.device.create_shader_module(wgpu::include_wgsl!("compose.wgsl"));
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: None,
        bind_group_layouts: &[Some(volume_layout)],
        immediate_size: 0,
    });
    let add = wgpu::BlendComponent {
        src_factor: wgpu::BlendFactor::One,
        dst_factor: wgpu::BlendFactor::One,
        operation: wgpu::BlendOperation::Add,
    };
    gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some("skin region"),
        layout: Some(&layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("region_vertex"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState {
            topology: wgpu::PrimitiveTopology::TriangleStrip,
            ..wgpu::PrimitiveState::default()
        },
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some("region_fragment"),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(wgpu::ColorTargetState {
                format: MAP,
                blend: Some(wgpu::BlendState { color: add, alpha: add }),
                write_mask: wgpu::ColorWrites::ALL,
            })],
        }),
        multiview_mask: None,
        cache: None,
    })
}
