//! The graphics device, with or without a window.

use std::sync::{Arc, Mutex, PoisonError};

use super::ViewError;

/// A device to draw with and what every model and renderer on it shares. Clones share one device.
#[derive(Debug, Clone)]
pub struct Gpu {
    pub(super) device: wgpu::Device,
    pub(super) queue: wgpu::Queue,
    pub(super) material_layout: wgpu::BindGroupLayout,
    adapter_name: String,
    cpu: bool,
    errors: Arc<Mutex<Option<String>>>,
}

impl Gpu {
    /// Opens the best adapter without a window: Vulkan first, then OpenGL; within one, a graphics card before the
    /// processor.
    pub fn headless() -> Result<Self, ViewError> {
        Self::headless_on(wgpu::Backends::VULKAN).or_else(|vulkan| match vulkan {
            ViewError::NoAdapter { .. } => Self::headless_on(wgpu::Backends::GL),
            other => Err(other),
        })
    }

    /// Opens the best adapter of the given backends without a window.
    pub fn headless_on(backends: wgpu::Backends) -> Result<Self, ViewError> {
        let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
        descriptor.backends = backends;
        descriptor.flags = wgpu::InstanceFlags::empty();
        let instance = wgpu::Instance::new(descriptor);
        let adapters = pollster::block_on(instance.enumerate_adapters(backends));
        // The first of equals, so that the choice does not depend on how a sort treats ties.
        let adapter = adapters
            .into_iter()
            .reduce(|best, next| {
                let better = rank(next.get_info().device_type) < rank(best.get_info().device_type);
                if better { next } else { best }
            })
            .ok_or_else(|| ViewError::NoAdapter { reason: format!("looked for {backends:?}") })?;

        let descriptor = wgpu::DeviceDescriptor {
            label: Some("understudy"),
            // The least that OpenGL ES gives, but textures as large as the adapter takes.
            required_limits: wgpu::Limits::downlevel_webgl2_defaults().using_resolution(adapter.limits()),
            ..wgpu::DeviceDescriptor::default()
        };
        let (device, queue) = pollster::block_on(adapter.request_device(&descriptor)).map_err(|error| {
            ViewError::Device { adapter: adapter.get_info().name, reason: error.to_string() }
        })?;
        Ok(Self::from_device(device, queue))
    }

    /// Draws with a device that someone else has opened, a window for example.
    ///
    /// Takes over the device's handler for uncaptured errors: they come back from the call that met them instead of
    /// ending the program.
    pub fn from_device(device: wgpu::Device, queue: wgpu::Queue) -> Self {
        let info = device.adapter_info();
        let adapter_name = match info.driver_info.as_str() {
            "" => format!("{} ({})", info.name, info.backend),
            driver => format!("{} ({}, {driver})", info.name, info.backend),
        };
        let errors = Arc::new(Mutex::new(None));
        let slot = Arc::clone(&errors);
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| keep_first(&slot, error.to_string())));
        let slot = Arc::clone(&errors);
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                keep_first(&slot, format!("the device was lost: {message}"));
            }
        });
        let material_layout = device.create_bind_group_layout(&material_layout());
        let cpu = info.device_type == wgpu::DeviceType::Cpu;
        Self { device, queue, material_layout, adapter_name, cpu, errors }
    }

    /// Which adapter draws, by which interface and driver.
    pub fn adapter_name(&self) -> &str {
        &self.adapter_name
    }

    /// Whether pictures are drawn on the CPU, without a graphics card.
    pub fn is_cpu(&self) -> bool {
        self.cpu
    }

    /// Returns the first error reported since the last check.
    pub(super) fn check(&self) -> Result<(), ViewError> {
        let taken = self.errors.lock().unwrap_or_else(PoisonError::into_inner).take();
        match taken {
            None => Ok(()),
            Some(reason) => Err(ViewError::Gpu { adapter: self.adapter_name.clone(), reason }),
        }
    }
}

fn keep_first(slot: &Mutex<Option<String>>, message: String) {
    slot.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(message);
}

fn rank(kind: wgpu::DeviceType) -> u8 {
    match kind {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// One material: its factors, its texture, how the texture is sampled.
fn material_layout() -> wgpu::BindGroupLayoutDescriptor<'static> {
    const ENTRIES: &[wgpu::BindGroupLayoutEntry] = &[
        wgpu::BindGroupLayoutEntry {
            binding: 0,
            visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
            ty: wgpu::BindingType::Buffer {
                ty: wgpu::BufferBindingType::Uniform,
                has_dynamic_offset: false,
                min_binding_size: None,
            },
            count: None,
        },
        wgpu::BindGroupLayoutEntry {
            binding: 1,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Texture {
                sample_type: wgpu::TextureSampleType::Float { filterable: true },
                view_dimension: wgpu::TextureViewDimension::D2,
                multisampled: false,
            },
            count: None,
        },
        wgpu::BindGroupLayoutEntry {
            binding: 2,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
            count: None,
        },
    ];
    wgpu::BindGroupLayoutDescriptor { label: Some("material"), entries: ENTRIES }
}
