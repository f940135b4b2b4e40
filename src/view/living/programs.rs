//! The programs that draw triangles with living skin on them.

use super::super::{
    Gpu,
    look::Lighting,
    model::{FixedVertex, MovingVertex, Part},
    pipelines::{depth, layout, pipeline, vertex_layout},
};

/// The programs for pictures of one number of samples a pixel.
#[derive(Debug)]
pub(in super::super) struct SkinPrograms {
    textured: wgpu::RenderPipeline,
    plain: wgpu::RenderPipeline,
    unlit_textured: wgpu::RenderPipeline,
    unlit_plain: wgpu::RenderPipeline,
}

impl SkinPrograms {
    pub fn new(
        gpu: &Gpu,
        frame_layout: &wgpu::BindGroupLayout,
        map_layout: &wgpu::BindGroupLayout,
        samples: u32,
    ) -> Self {
        let source = concat!(include_str!("../shade.wgsl"), include_str!("skin.wgsl"));
        let module = gpu.device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("skin.wgsl"),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        });
        let layout = layout(gpu, &[frame_layout, &gpu.material_layout, map_layout]);
        let fixed = wgpu::vertex_attr_array![0 => Float32x2, 1 => Unorm8x4];
        let moving = wgpu::vertex_attr_array![2 => Float32x3, 3 => Float32x3];
        let charted = wgpu::vertex_attr_array![4 => Float32x3];
        let buffers = [
            Some(vertex_layout(size_of::<FixedVertex>(), &fixed)),
            Some(vertex_layout(size_of::<MovingVertex>(), &moving)),
            Some(vertex_layout(size_of::<[f32; 3]>(), &charted)),
        ];
        let draw = |name: &str| {
            let entries = [&*format!("skin_{name}_vertex"), &*format!("skin_{name}_fragment")];
            pipeline(gpu, &module, &layout, entries, &buffers, depth(true), samples)
        };
        Self {
            textured: draw("textured"),
            plain: draw("plain"),
            unlit_textured: draw("unlit_textured"),
            unlit_plain: draw("unlit_plain"),
        }
    }

    pub fn part(&self, lighting: Lighting, part: &Part) -> &wgpu::RenderPipeline {
        match (lighting, part.textured) {
            (Lighting::Lit, true) => &self.textured,
            (Lighting::Lit, false) | (Lighting::Clay, _) => &self.plain,
            (Lighting::Unlit, true) => &self.unlit_textured,
            (Lighting::Unlit, false) => &self.unlit_plain,
        }
    }
}
