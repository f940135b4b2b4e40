//! Draws a model, and gives the picture back.

use bytemuck::Zeroable as _;
use image::RgbaImage;
use nalgebra::Matrix4;

use super::edges::EdgeSmoother;
use super::frame_uniform::FrameUniform;
use super::living::{LivingModel, SkinPrograms};
use super::look::{Background, Look};
use super::model::{Model, MovingVertex, filled};
use super::pipelines::{COLOUR, DEPTH, Pipelines};
use super::readback::{Readback, as_picture};
use super::{Gpu, ViewCamera, ViewError};

/// How the stairs of slanting edges are smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Smoothing {
    /// Not at all; the fastest. For networks and measurements.
    Off,
    /// The strong edges of the picture that `fetch` gives are blurred along themselves, on the CPU. For video.
    #[default]
    Edges,
    /// Four samples a pixel. For stills.
    Samples4,
}

/// Draws pictures of one size on one device.
#[derive(Debug)]
pub struct Renderer {
    pub(super) gpu: Gpu,
    size: wgpu::Extent3d,
    pub(super) pipelines: Pipelines,
    /// Made when the first living skin is drawn.
    pub(super) skin: Option<SkinPrograms>,
    frame: wgpu::Buffer,
    frame_group: wgpu::BindGroup,
    picture: wgpu::Texture,
    picture_view: wgpu::TextureView,
    /// Four samples a pixel, averaged into the picture.
    samples: Option<wgpu::TextureView>,
    backdrop: Option<Backdrop>,
    depth: wgpu::TextureView,
    readback: Readback,
    vertices: Vec<MovingVertex>,
    triangles: Vec<[u32; 3]>,
    look: Look,
    edges: Option<EdgeSmoother>,
}

/// A gradient is drawn once and copied before each picture: on a CPU that takes a tenth of the time.
#[derive(Debug)]
struct Backdrop {
    of: Background,
    texture: wgpu::Texture,
}

impl Renderer {
    /// Prepares pictures of `width` × `height` pixels.
    pub fn new(gpu: &Gpu, width: u32, height: u32, smoothing: Smoothing) -> Result<Self, ViewError> {
        let limit = gpu.device.limits().max_texture_dimension_2d;
        if width == 0 || height == 0 || width.max(height) > limit {
            let reason = format!("give 1 to {limit} pixels a side");
            return Err(ViewError::Size { width, height, reason });
        }
        let size = wgpu::Extent3d { width, height, depth_or_array_layers: 1 };
        let samples = if smoothing == Smoothing::Samples4 { 4 } else { 1 };
        let target = wgpu::TextureUsages::RENDER_ATTACHMENT;
        let picture = texture(
            gpu,
            size,
            COLOUR,
            1,
            target
                | wgpu::TextureUsages::COPY_SRC
                | wgpu::TextureUsages::COPY_DST
                | wgpu::TextureUsages::TEXTURE_BINDING,
        );
        let pipelines = Pipelines::new(gpu, samples);
        let frame = filled(
            gpu,
            "frame",
            wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            bytemuck::bytes_of(&FrameUniform::zeroed()),
        );
        let renderer = Self {
            gpu: gpu.clone(),
            size,
            frame_group: gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("frame"),
                layout: &pipelines.frame_layout,
                entries: &[wgpu::BindGroupEntry { binding: 0, resource: frame.as_entire_binding() }],
            }),
            pipelines,
            skin: None,
            frame,
            picture_view: view(&picture),
            picture,
            samples: (samples > 1).then(|| view(&texture(gpu, size, COLOUR, samples, target))),
            backdrop: None,
            depth: view(&texture(gpu, size, DEPTH, samples, target)),
            readback: Readback::new(gpu, size),
            vertices: Vec::new(),
            triangles: Vec::new(),
            look: Look::default(),
            edges: (smoothing == Smoothing::Edges).then(EdgeSmoother::default),
        };
        gpu.check()?;
        Ok(renderer)
    }

    /// Which adapter draws, by which interface and driver.
    pub fn adapter_name(&self) -> &str {
        self.gpu.adapter_name()
    }

    /// Width and height, pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.size.width, self.size.height]
    }

    /// Samples a pixel.
    pub(super) fn sample_count(&self) -> u32 {
        if self.samples.is_some() { 4 } else { 1 }
    }

    /// The picture on the device, `Rgba8Unorm` holding sRGB, for a window to show. The next `draw` overwrites it.
    /// `Smoothing::Edges` does not reach it.
    pub fn picture(&self) -> &wgpu::Texture {
        &self.picture
    }

    /// Draws the model, and returns while the device is still at work.
    ///
    /// `positions` (V × 3, in the model's frame and unit) and `normals` (V × 3, unit length, outwards) are those of
    /// the mesh vertices. `world_from_model` places the model in the camera's scene; its last row is 0 0 0 1.
    /// Nothing is allocated here once the first picture has been drawn, except by the driver.
    pub fn draw(
        &mut self,
        model: &Model,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        world_from_model: &Matrix4<f64>,
        camera: &ViewCamera,
        look: &Look,
    ) -> Result<(), ViewError> {
        self.begin(model, None, positions, normals, world_from_model, camera, *look)
    }

    /// Draws `model`, with living skin on it where there is any; it is the skin's own model then.
    #[expect(clippy::too_many_arguments, reason = "those of `draw`, and what it may wear")]
    pub(super) fn begin(
        &mut self,
        model: &Model,
        mut living: Option<&mut LivingModel>,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        world_from_model: &Matrix4<f64>,
        camera: &ViewCamera,
        look: Look,
    ) -> Result<(), ViewError> {
        camera.check()?;
        if camera.viewport != self.size() {
            let [width, height] = camera.viewport;
            let [w, h] = self.size();
            let reason =
                format!("the camera's viewport differs from the renderer's {w} x {h}; make them equal");
            return Err(ViewError::Size { width, height, reason });
        }
        model.expand(positions, normals, &mut self.vertices)?;
        self.gpu.queue.write_buffer(&model.moving, 0, bytemuck::cast_slice(&self.vertices));
        if let Some(model_from_view) = (camera.view_from_world() * world_from_model).try_inverse() {
            let eye = (model_from_view * camera.eye_in_view()).cast::<f32>();
            match &living {
                Some(living) => living.facing_first(&self.vertices, eye, &mut self.triangles),
                None => model.facing_first(&self.vertices, eye, &mut self.triangles),
            }
            self.gpu.queue.write_buffer(&model.indices, 0, bytemuck::cast_slice(&self.triangles));
        }
        let uniform = FrameUniform::new(model, world_from_model, camera, look, self.size.height);
        self.gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&uniform));
        self.look = look;

        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let copied = self.samples.is_none() && matches!(look.background, Background::Vertical { .. });
        if copied {
            self.copy_backdrop(&mut encoder, look.background);
        }
        if let Some(living) = living.as_mut() {
            living.compose(&self.gpu, &mut encoder);
        }
        self.draw_model(&mut encoder, model, living.as_deref(), copied);
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.check()
    }

    /// Sends the drawn picture on its way back. Up to two may be on their way, so that the caller can draw and
    /// submit the next one before it fetches this one.
    pub fn submit(&mut self) -> Result<(), ViewError> {
        self.readback.submit(&self.gpu, &self.picture, self.look.background == Background::Transparent)
    }

    /// Waits for the oldest submitted picture. `out` becomes H × W × 4 bytes, RGBA, sRGB, straight alpha, rows
    /// from the top without padding.
    pub fn fetch(&mut self, out: &mut Vec<u8>) -> Result<(), ViewError> {
        self.readback.fetch(&self.gpu, out, self.edges.as_mut())
    }

    /// Waits for the drawn picture: `submit` and `fetch` in one. Not while another picture is on its way, which
    /// would come first.
    pub fn read(&mut self, out: &mut Vec<u8>) -> Result<(), ViewError> {
        self.submit()?;
        self.fetch(out)
    }

    /// [`Renderer::read`] as a picture.
    pub fn read_picture(&mut self) -> Result<RgbaImage, ViewError> {
        let mut rgba = Vec::new();
        self.read(&mut rgba)?;
        as_picture(self.size(), rgba)
    }

    /// Lays the background under the picture, drawing it first if it is new.
    fn copy_backdrop(&mut self, encoder: &mut wgpu::CommandEncoder, background: Background) {
        let texture = match self.backdrop.take() {
            Some(Backdrop { of, texture }) if of == background => texture,
            _ => {
                let usage = wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::COPY_SRC;
                let texture = texture(&self.gpu, self.size, COLOUR, 1, usage);
                let mut pass =
                    self.pass(encoder, &view(&texture), None, wgpu::LoadOp::Clear(wgpu::Color::BLACK));
                self.draw_background(&mut pass);
                texture
            }
        };
        encoder.copy_texture_to_texture(texture.as_image_copy(), self.picture.as_image_copy(), self.size);
        self.backdrop = Some(Backdrop { of: background, texture });
    }

    fn draw_background(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(0, &self.frame_group, &[]);
        pass.set_pipeline(&self.pipelines.background);
        pass.draw(0..3, 0..1);
    }

    fn draw_model(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        model: &Model,
        living: Option<&LivingModel>,
        background_is_there: bool,
    ) {
        let [r, g, b, a] = self.look.background_colours()[0].map(f64::from);
        let load = if background_is_there {
            wgpu::LoadOp::Load
        } else {
            wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a })
        };
        let (target, resolved) = match &self.samples {
            Some(samples) => (samples, Some(&self.picture_view)),
            None => (&self.picture_view, None),
        };
        let mut pass = self.pass(encoder, target, resolved, load);
        pass.set_bind_group(0, &self.frame_group, &[]);
        pass.set_vertex_buffer(0, model.fixed.slice(..));
        pass.set_vertex_buffer(1, model.moving.slice(..));
        pass.set_index_buffer(model.indices.slice(..), wgpu::IndexFormat::Uint32);
        if let (Some(living), Some(programs)) = (living, &self.skin) {
            living.draw(&mut pass, &self.pipelines, programs, self.look.lighting);
        } else {
            for part in &model.parts {
                pass.set_pipeline(self.pipelines.part(self.look.lighting, part));
                pass.set_bind_group(1, &part.material, &[]);
                pass.draw_indexed(part.indices.clone(), 0, 0..1);
            }
        }
        if !background_is_there && matches!(self.look.background, Background::Vertical { .. }) {
            self.draw_background(&mut pass);
        }
    }

    fn pass<'encoder>(
        &self,
        encoder: &'encoder mut wgpu::CommandEncoder,
        view: &wgpu::TextureView,
        resolve_target: Option<&wgpu::TextureView>,
        load: wgpu::LoadOp<wgpu::Color>,
    ) -> wgpu::RenderPass<'encoder> {
        let store = if resolve_target.is_some() { wgpu::StoreOp::Discard } else { wgpu::StoreOp::Store };
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: None,
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view,
                depth_slice: None,
                resolve_target,
                ops: wgpu::Operations { load, store },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &self.depth,
                depth_ops: Some(wgpu::Operations {
                    load: wgpu::LoadOp::Clear(1.0),
                    store: wgpu::StoreOp::Discard,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}

fn texture(
    gpu: &Gpu,
    size: wgpu::Extent3d,
    format: wgpu::TextureFormat,
    sample_count: u32,
    usage: wgpu::TextureUsages,
) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: None,
        size,
        mip_level_count: 1,
        sample_count,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}
