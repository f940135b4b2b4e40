//! How a picture looks: what stands behind the head and how the head is lit.

use serde::{Deserialize, Serialize};

/// What stands behind the model.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Background {
    /// Nothing: alpha 0, colour 0. The model's alpha is 255, its edges lie between when they are smoothed.
    Transparent,
    /// One sRGB colour.
    Solid([u8; 3]),
    /// An sRGB colour at the picture's upper edge that runs evenly into another at the lower edge.
    Vertical {
        /// sRGB.
        top: [u8; 3],
        /// sRGB.
        bottom: [u8; 3],
    },
}

/// How the model is lit. The lights stand fixed to the camera: left, right and above are the viewer's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
pub enum Lighting {
    /// The scan's colours under a soft key light from the upper left, a fill, a rim and a high ambient light, since
    /// a scan's texture already holds the light of its recording. A scan without colours is lit as clay.
    #[default]
    Lit,
    /// The scan's colours alone, byte for byte where the texture is shown at its own size. Feed this to a network.
    Unlit,
    /// The scan's shape alone: warm grey clay under a stronger key light.
    Clay,
}

/// How a picture looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Look {
    /// What stands behind the model.
    pub background: Background,
    /// How the model is lit.
    pub lighting: Lighting,
}

impl Default for Look {
    /// The house look: lit, before a dark grey-blue that is a little lighter at the bottom.
    fn default() -> Self {
        Self {
            background: Background::Vertical { top: [30, 34, 41], bottom: [66, 73, 84] },
            lighting: Lighting::Lit,
        }
    }
}

impl Look {
    /// The scan's own colours before black, for a network that looks for landmarks.
    pub const UNLIT: Self = Self { background: Background::Solid([0, 0, 0]), lighting: Lighting::Unlit };

    /// The same look with another lighting.
    #[must_use]
    pub fn lit_by(self, lighting: Lighting) -> Self {
        Self { lighting, ..self }
    }

    /// The same look before another background.
    #[must_use]
    pub fn before(self, background: Background) -> Self {
        Self { background, ..self }
    }

    /// Ambient, key, fill and rim, and specular strength, linear: the light that reaches the surface.
    pub(super) fn lights(self) -> ([f32; 4], f32) {
        match self.lighting {
            Lighting::Lit => ([0.66, 0.42, 0.12, 0.22], 0.05),
            Lighting::Unlit => ([1.0, 0.0, 0.0, 0.0], 0.0),
            Lighting::Clay => ([0.34, 0.72, 0.16, 0.25], 0.06),
        }
    }

    /// Upper and lower background colour, 0..=1 sRGB with alpha.
    pub(super) fn background_colours(self) -> [[f32; 4]; 2] {
        let opaque = |c: [u8; 3]| [c[0], c[1], c[2], 255].map(|byte| f32::from(byte) / 255.0);
        match self.background {
            Background::Transparent => [[0.0; 4]; 2],
            Background::Solid(colour) => [opaque(colour); 2],
            Background::Vertical { top, bottom } => [opaque(top), opaque(bottom)],
        }
    }
}
