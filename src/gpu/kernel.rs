//! Kernels: entry points of shaders with what they need to run.

use super::bind_groups::Bound;
use super::device::Gpu;
use super::pool::PooledBuffer;
use super::projection_uniform::ProjectionUniform;
use super::shaders::{Shader, file_of};
use super::uniforms::Uniforms;
use crate::projection::Projection;
use bytemuck::Pod;
use glam::DVec3;
use std::sync::Arc;

/// What a binding holds: a handle, which is cheap to clone.
#[derive(Clone)]
pub enum Resource {
    Bound(Bound),
    /// The bytes of a uniform, which has no place yet.
    Uniform(Arc<[u8]>),
}

impl Resource {
    /// A uniform with the value.
    pub fn uniform<T: Pod>(value: &T) -> Self {
        Self::Uniform(bytemuck::bytes_of(value).into())
    }
}

impl From<&Resource> for Resource {
    fn from(resource: &Resource) -> Self {
        resource.clone()
    }
}

impl From<&wgpu::Buffer> for Resource {
    fn from(buffer: &wgpu::Buffer) -> Self {
        Self::Bound(Bound::Buffer(buffer.clone()))
    }
}

impl From<&PooledBuffer> for Resource {
    fn from(buffer: &PooledBuffer) -> Self {
        Self::Bound(Bound::Buffer((**buffer).clone()))
    }
}

impl From<&wgpu::TextureView> for Resource {
    fn from(table: &wgpu::TextureView) -> Self {
        Self::Bound(Bound::Table(table.clone()))
    }
}

/// An entry point of a shader (or two, of a draw), its constants, and its bindings of group 0.
#[derive(Clone)]
pub struct Kernel {
    pub shader: Shader,
    /// The vertex stage's and the fragment stage's, where there are two.
    pub entry_points: [&'static str; 2],
    pub constants: Vec<(&'static str, f64)>,
    bindings: Vec<(u32, Resource)>,
}

impl Kernel {
    /// The entry point `main` of a file of `shaders/`.
    pub fn new(file: &'static str) -> Self {
        Self {
            shader: Shader::new(file),
            entry_points: ["main", ""],
            constants: Vec::new(),
            bindings: Vec::new(),
        }
    }

    /// The same with another entry point.
    pub fn entry(self, entry_point: &'static str) -> Self {
        Self {
            entry_points: [entry_point, ""],
            ..self
        }
    }

    /// The same without bindings.
    pub fn bare(&self) -> Self {
        Self {
            bindings: Vec::new(),
            constants: self.constants.clone(),
            ..*self
        }
    }

    /// Fills the slot that has the name of the file's folder.
    pub fn fill(mut self, file: &'static str) -> Self {
        self.shader.fill(file);
        self
    }

    pub fn constant(mut self, name: &'static str, value: impl Into<f64>) -> Self {
        self.constants.push((name, value.into()));
        self
    }

    pub fn bind(mut self, index: u32, resource: impl Into<Resource>) -> Self {
        self.bindings.push((index, resource.into()));
        self
    }

    /// Binds a new uniform with the value.
    pub fn uniform<T: Pod>(self, index: u32, value: &T) -> Self {
        self.bind(index, Resource::uniform(value))
    }

    /// Fills the slot and binds its uniform; `origin` is that of the scene's tables.
    pub fn projection(self, index: u32, projection: &Projection, origin: DVec3) -> Self {
        self.uniform(index, &ProjectionUniform::new(projection, origin))
            .projected(projection)
    }

    /// Fills the slot.
    pub fn projected(self, projection: &Projection) -> Self {
        self.fill(file_of("projection", projection.kind.name()))
            .constant("converges", projection.kind.convergence() > 0.0)
    }

    pub fn dispatch(self, groups: Groups) -> Dispatch {
        Dispatch {
            kernel: self,
            groups,
        }
    }

    pub fn draw(self, vertex: &'static str, fragment: &'static str, vertices: Vertices) -> Draw {
        let kernel = Self {
            entry_points: [vertex, fragment],
            ..self
        };
        Draw { kernel, vertices }
    }

    /// What it binds where, with a place for each uniform.
    pub(super) fn bound(&self, gpu: &Gpu, uniforms: &mut Uniforms) -> Vec<(u32, Bound)> {
        let bindings = self.bindings.iter();
        let bound = bindings.map(|(binding, resource)| match resource {
            Resource::Bound(bound) => (*binding, bound.clone()),
            Resource::Uniform(bytes) => (*binding, uniforms.place(gpu, bytes)),
        });
        bound.collect()
    }
}

/// One dispatch of a pass.
pub struct Dispatch {
    pub kernel: Kernel,
    pub groups: Groups,
}

/// One draw of a pass, triangle by triangle.
pub struct Draw {
    pub kernel: Kernel,
    pub vertices: Vertices,
}

pub enum Vertices {
    Number(u32),
    Indirect(wgpu::Buffer),
}

#[derive(Clone)]
pub enum Groups {
    /// At least this many workgroups, for a shader that counts them along one line
    /// (`shaders/lib/invocations.wgsl`).
    Linear(u64),
    /// Columns and rows of workgroups.
    Grid(u32, u32),
    /// As a buffer says, from a byte of it on.
    Indirect(wgpu::Buffer, u64),
}

impl Groups {
    pub const ONE: Self = Self::Linear(1);
}

/// Workgroups in a row of those that are counted along one line, as in the shaders.
pub const GROUPS_OF_ROW: u64 = 32_768;

/// Columns and rows of at least so many workgroups: all rows but a single one are full.
pub fn rows_of_groups(count: u64) -> [u32; 2] {
    let columns = count.min(GROUPS_OF_ROW);
    [columns, count.div_ceil(GROUPS_OF_ROW)].map(|side| side as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::tests::MODULES;
    use naga::{Binding, BuiltIn};

    #[test]
    fn groups_are_counted_without_their_number() {
        for count in [0, 1, 32_767, 32_768, 32_769, 65_536, 2_000_000] {
            let [columns, rows] = rows_of_groups(count).map(u64::from);
            assert!(columns * rows >= count && columns * rows < count + GROUPS_OF_ROW);
            assert!(rows <= 1 || columns == GROUPS_OF_ROW);
        }
        let row = format!("const GROUPS_OF_ROW: u32 = {GROUPS_OF_ROW}u;");
        assert!(Shader::new("lib/invocations").compose().contains(&row));
        for (shader, module) in MODULES.iter() {
            let members = module.types.iter().filter_map(|(_, ty)| match &ty.inner {
                naga::TypeInner::Struct { members, .. } => Some(members),
                _ => None,
            });
            let of_structs = members.flatten().map(|member| &member.binding);
            let functions = module.entry_points.iter().map(|entry| &entry.function);
            let arguments = functions.flat_map(|function| &function.arguments);
            let mut bindings = of_structs.chain(arguments.map(|argument| &argument.binding));
            let number = Some(Binding::BuiltIn(BuiltIn::NumWorkGroups));
            assert!(bindings.all(|binding| *binding != number), "{shader:?}");
        }
    }
}
