//! Bind groups that are kept from one frame to the next, which binds mostly the same buffers at the same places.

use rustc_hash::FxHashMap;

/// What is bound: a handle, equal only to other handles of the same thing.
#[derive(Clone, PartialEq, Eq, Hash)]
pub enum Bound {
    Buffer(wgpu::Buffer),
    /// Bytes of a buffer, from the first on.
    Part {
        buffer: wgpu::Buffer,
        start: u64,
        size: wgpu::BufferSize,
    },
    Table(wgpu::TextureView),
    Boxes(wgpu::Tlas),
}

impl Bound {
    fn binding(&self) -> wgpu::BindingResource<'_> {
        match self {
            Self::Buffer(buffer) => buffer.as_entire_binding(),
            Self::Part {
                buffer,
                start,
                size,
            } => wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                buffer,
                offset: *start,
                size: Some(*size),
            }),
            Self::Table(view) => wgpu::BindingResource::TextureView(view),
            Self::Boxes(structure) => structure.as_binding(),
        }
    }
}

/// A layout, and what is bound where.
type Key = (wgpu::BindGroupLayout, Vec<(u32, Bound)>);

/// A frame's bind groups. They hold on to what they bind, and so no more are kept than one frame used.
#[derive(Default)]
pub struct BindGroups {
    of_last: FxHashMap<Key, wgpu::BindGroup>,
    of_this: FxHashMap<Key, wgpu::BindGroup>,
}

impl BindGroups {
    /// That of the frame before, if it is the same; else one is made.
    pub fn get(
        &mut self,
        layout: &wgpu::BindGroupLayout,
        bound: Vec<(u32, Bound)>,
        make: impl FnOnce(&[wgpu::BindGroupEntry]) -> wgpu::BindGroup,
    ) -> wgpu::BindGroup {
        let key = (layout.clone(), bound);
        if let Some(known) = self.of_this.get(&key) {
            return known.clone();
        }
        let group = self.of_last.remove(&key).unwrap_or_else(|| {
            let entries = key.1.iter().map(|(binding, bound)| wgpu::BindGroupEntry {
                binding: *binding,
                resource: bound.binding(),
            });
            make(&entries.collect::<Vec<_>>())
        });
        self.of_this.insert(key, group.clone());
        group
    }

    /// Those that the next frame is to have.
    pub fn next(self) -> Self {
        Self {
            of_last: self.of_this,
            ..Self::default()
        }
    }

    /// How many of the frame before there are.
    #[cfg(test)]
    pub fn kept(&self) -> usize {
        self.of_last.len()
    }
}
