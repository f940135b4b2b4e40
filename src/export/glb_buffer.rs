//! The binary chunk of a GLB and the accessors into it.

use gltf_json as json;
use gltf_json::Index;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Target, View};
use gltf_json::validation::Checked::Valid;

/// Collects bytes; every array becomes one buffer view with one accessor, each on a 4-byte boundary.
#[derive(Debug, Default)]
pub(super) struct GlbBuffer {
    pub bytes: Vec<u8>,
    pub views: Vec<View>,
    pub accessors: Vec<json::Accessor>,
}

impl GlbBuffer {
    /// A vertex attribute or morph target of N-vectors; `bounds` writes the extremes that POSITION must have.
    pub fn push_vertices<const N: usize>(
        &mut self,
        values: &[[f32; N]],
        bounds: bool,
    ) -> Index<json::Accessor> {
        let kind = if N == 2 { Type::Vec2 } else { Type::Vec3 };
        let view = self.push_floats(values.as_flattened(), Some(Target::ArrayBuffer));
        let range = bounds.then(|| extremes(values));
        self.push_accessor(view, values.len(), ComponentType::F32, kind, range)
    }

    /// Triangle corners.
    pub fn push_indices(&mut self, values: &[u32]) -> Index<json::Accessor> {
        let view = self
            .push_view(values.iter().flat_map(|value| value.to_le_bytes()), Some(Target::ElementArrayBuffer));
        self.push_accessor(view, values.len(), ComponentType::U32, Type::Scalar, None)
    }

    /// Animation keys: `values` in elements of `kind`; `bounds` for the times, which must have them.
    pub fn push_keys(&mut self, values: &[f32], kind: Type, bounds: bool) -> Index<json::Accessor> {
        let view = self.push_floats(values, None);
        let (singles, _) = values.as_chunks::<1>();
        let range = bounds.then(|| extremes(singles));
        self.push_accessor(view, values.len() / kind.multiplicity(), ComponentType::F32, kind, range)
    }

    /// Any file's bytes, for embedded images.
    pub fn push_bytes(&mut self, bytes: &[u8]) -> Index<View> {
        self.push_view(bytes.iter().copied(), None)
    }

    fn push_floats(&mut self, values: &[f32], target: Option<Target>) -> Index<View> {
        self.push_view(values.iter().flat_map(|value| value.to_le_bytes()), target)
    }

    fn push_view(&mut self, bytes: impl Iterator<Item = u8>, target: Option<Target>) -> Index<View> {
        let offset = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - offset;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        Index::push(
            &mut self.views,
            View {
                buffer: Index::new(0),
                byte_length: length.into(),
                byte_offset: Some(offset.into()),
                byte_stride: None,
                name: None,
                target: target.map(Valid),
                extensions: None,
                extras: None,
            },
        )
    }

    fn push_accessor(
        &mut self,
        view: Index<View>,
        count: usize,
        component: ComponentType,
        kind: Type,
        range: Option<(json::Value, json::Value)>,
    ) -> Index<json::Accessor> {
        let (min, max) = range.unzip();
        Index::push(
            &mut self.accessors,
            json::Accessor {
                buffer_view: Some(view),
                byte_offset: None,
                count: count.into(),
                component_type: Valid(GenericComponentType(component)),
                extensions: None,
                extras: None,
                type_: Valid(kind),
                min,
                max,
                name: None,
                normalized: false,
                sparse: None,
            },
        )
    }
}

/// Smallest and largest of each component.
fn extremes<const N: usize>(values: &[[f32; N]]) -> (json::Value, json::Value) {
    let mut low = [f32::INFINITY; N];
    let mut high = [f32::NEG_INFINITY; N];
    for value in values {
        for axis in 0..N {
            low[axis] = low[axis].min(value[axis]);
            high[axis] = high[axis].max(value[axis]);
        }
    }
    (json::Value::from(low.to_vec()), json::Value::from(high.to_vec()))
}
