//! Drawing a model with its living skin.

use std::sync::Arc;

use nalgebra::Matrix4;

use super::super::{
    Renderer, ViewCamera, ViewError,
    look::{Lighting, Look},
};
use super::{LivingModel, SkinPrograms};

impl Renderer {
    /// [`Renderer::draw`] with living skin, as [`LivingModel::show`] has set it. Neutral skin costs nothing, and gives the
    /// model's own picture byte for byte; so does clay, which shows the shape alone.
    pub fn draw_living(
        &mut self,
        living: &mut LivingModel,
        positions: &[[f32; 3]],
        normals: &[[f32; 3]],
        world_from_model: &Matrix4<f64>,
        camera: &ViewCamera,
        look: &Look,
    ) -> Result<(), ViewError> {
        if living.is_neutral() || look.lighting == Lighting::Clay {
            return self.draw(living.model(), positions, normals, world_from_model, camera, look);
        }
        if self.skin.is_none() {
            let samples = self.sample_count();
            let frame = &self.pipelines.frame_layout;
            self.skin = Some(SkinPrograms::new(&self.gpu, frame, &living.map.layout, samples));
        }
        let model = Arc::clone(living.model());
        self.begin(&model, Some(living), positions, normals, world_from_model, camera, *look)
    }
}
