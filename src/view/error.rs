//! What can go wrong with a picture.

use std::path::PathBuf;

/// Every variant names what was wanted, what was found, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// Neither Vulkan nor OpenGL offers anything to draw with.
    #[error(
        "no graphics adapter was found ({reason}). Install a driver; to draw on the CPU: \
         apt install libvulkan1 mesa-vulkan-drivers"
    )]
    NoAdapter {
        /// What was looked for.
        reason: String,
    },
    /// The adapter is there but gives no device.
    #[error("{adapter} gives no device: {reason}. Update its driver, or use another adapter")]
    Device {
        /// The adapter's own name.
        adapter: String,
        /// The driver's reason.
        reason: String,
    },
    /// An error that the graphics driver or its validation reported.
    #[error(
        "the graphics adapter {adapter} reported: {reason}. If its memory is full, draw a smaller picture"
    )]
    Gpu {
        /// The adapter's own name.
        adapter: String,
        /// The first message since the last check.
        reason: String,
    },
    /// A picture size that cannot be drawn.
    #[error("a picture of {width} x {height} pixels cannot be drawn: {reason}")]
    Size {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
        /// Why, and which size would do.
        reason: String,
    },
    /// A mesh whose lists do not fit together.
    #[error("the mesh cannot be drawn: {reason}. Repair the file or read it again")]
    Mesh {
        /// Which list, and what was found in it.
        reason: String,
    },
    /// Positions or normals that do not belong to the model.
    #[error("{found} {what} were given for a model of {wanted} vertices; give one per vertex of its mesh")]
    Vertices {
        /// `"positions"` or `"normals"`.
        what: &'static str,
        /// The model's number of mesh vertices.
        wanted: usize,
        /// The number given.
        found: usize,
    },
    /// A texture that cannot be used.
    #[error("the texture {name} cannot be used: {reason}. {remedy}")]
    Texture {
        /// The texture's file name.
        name: String,
        /// What was found.
        reason: String,
        /// What the user can do.
        remedy: &'static str,
    },
    /// A camera that sees nothing.
    #[error("the camera cannot be used: {reason}")]
    Camera {
        /// What is wrong and what would be right.
        reason: &'static str,
    },
    /// Pictures fetched or submitted out of turn.
    #[error("{reason}")]
    Turn {
        /// What was called too early, and what to call first.
        reason: &'static str,
    },
    /// A chart that cannot be drawn.
    #[error("the chart cannot be drawn: {reason}")]
    Chart {
        /// Why, and what would do.
        reason: String,
    },
    /// A picture could not be written.
    #[error("cannot write {path}: {reason}. Check that the folder exists and can be written to")]
    Save {
        /// The picture's file.
        path: PathBuf,
        /// The system's or the encoder's own reason.
        reason: String,
    },
}
