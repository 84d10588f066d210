//! Structs that shaders read or write.

/// Declares a struct and names its twin: a test compares the offsets of all members with those of the
/// struct of that name in that file of `shaders/`. Members whose names begin with `padding` need no twin.
macro_rules! shader_struct {
    (
        $(#[$attribute:meta])*
        $visibility:vis struct $name:ident is $twin:ident in $file:literal {
            $($(#[$of_member:meta])* $of_field:vis $member:ident: $type:ty,)+
        }
    ) => {
        $(#[$attribute])*
        #[repr(C)]
        #[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        $visibility struct $name {
            $($(#[$of_member])* $of_field $member: $type,)+
        }

        #[cfg(test)]
        impl $crate::gpu::shader_struct::ShaderStruct for $name {
            const NAME: &'static str = stringify!($twin);
            const FILE: &'static str = $file;

            fn offsets() -> Vec<(&'static str, usize)> {
                vec![$((stringify!($member), std::mem::offset_of!($name, $member)),)+]
            }
        }
    };
}
pub(crate) use shader_struct;

/// What the test asks of a struct.
#[cfg(test)]
pub trait ShaderStruct: bytemuck::Pod {
    const NAME: &'static str;
    const FILE: &'static str;
    fn offsets() -> Vec<(&'static str, usize)>;
}

#[cfg(test)]
mod tests {
    use super::ShaderStruct;
    use crate::gpu::passes::*;
    use crate::gpu::shaders::tests::MODULES;
    use std::path::Path;

    /// Compares the struct with its twin wherever that is part of a shader.
    fn check<T: ShaderStruct>() {
        let mut found = 0;
        for (shader, module) in MODULES.iter() {
            if !shader.files().contains(&T::FILE) {
                continue;
            }
            let named = |ty: &&naga::Type| ty.name.as_deref() == Some(T::NAME);
            let Some(twin) = module.types.iter().map(|(_, ty)| ty).find(named) else {
                continue;
            };
            let naga::TypeInner::Struct { members, span } = &twin.inner else {
                panic!("{} is no struct", T::NAME);
            };
            let is_member = |(name, _): &(&str, usize)| !name.starts_with("padding");
            let members = members
                .iter()
                .map(|member| (member.name.as_deref().unwrap(), member.offset as usize));
            let members: Vec<_> = members.filter(is_member).collect();
            let offsets: Vec<_> = T::offsets().into_iter().filter(is_member).collect();
            assert_eq!(offsets, members, "{} of {}", T::NAME, T::FILE);
            assert_eq!(size_of::<T>(), *span as usize, "{} of {}", T::NAME, T::FILE);
            found += 1;
        }
        assert!(found > 0, "no shader has {} of {}", T::NAME, T::FILE);
    }

    #[test]
    fn structs_are_laid_out_as_the_shaders_lay_them_out() {
        let checks = [
            check::<crate::gpu::projection_uniform::ProjectionUniform>,
            check::<blend_importance::BlendUniform>,
            check::<forward_importance::ForwardUniform>,
            check::<importance_map::ImportanceUniform>,
            check::<inputs::ReceiversUniform>,
            check::<light_grid::LightGridUniform>,
            check::<light_rays::LightRaysUniform>,
            check::<moments::LevelUniform>,
            check::<outline::OutlineUniform>,
            check::<page_requests::DensityUniform>,
            check::<page_requests::PageLevelsUniform>,
            check::<rasterize::RasterizationUniform>,
            check::<receiver_tiles::ReceiverTilesUniform>,
            check::<receivers::Bounds>,
            check::<samples::SamplingUniform>,
            check::<shadow_edge::ShadowEdgeUniform>,
            check::<shadow_volumes::ShadowVolumesUniform>,
            check::<stored_pages::PagesUniform>,
            check::<tessellate::TessellationUniform>,
            check::<warp_map::AxisUniform>,
            check::<warp_map::Layout>,
            check::<work_items::Counters>,
        ];
        for check in &checks {
            check();
        }
        // Whoever declares another one is told to name it here.
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        assert_eq!(occurrences(&source, "\nshader_struct! {"), checks.len());
        assert_eq!(
            occurrences(&source, "#[repr("),
            1,
            "declare it by shader_struct!"
        );
    }

    /// How often a text stands in the files of a folder, this test aside.
    fn occurrences(folder: &Path, text: &str) -> usize {
        let entries = std::fs::read_dir(folder).unwrap();
        let count = |path: &Path| match path.is_dir() {
            true => occurrences(path, text),
            false => {
                let source = std::fs::read_to_string(path).unwrap();
                let source = source.split("#[cfg(test)]\nmod tests").next().unwrap();
                source.matches(text).count()
            }
        };
        entries.map(|entry| count(&entry.unwrap().path())).sum()
    }
}
