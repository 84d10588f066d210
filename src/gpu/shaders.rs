//! The list of shaders, and how they are put together.
//!
//! A shader is a file of `shaders/` with `#import` lines, each of which stands for another file, taken
//! once. Seven imports are slots that a pass fills: `#import projection` with one of `projection/`,
//! `#import warp` with one of `warp/`, `#import caster` with one of `caster/`, `#import mask` with one of
//! `mask/`, `#import target` and `#import stored` with one of `target/` and of `stored/`, which write
//! and read the same texels, and `#import paging` with one of `paging/`, which says where these lie.

macro_rules! file {
    ($name:literal) => {
        (
            $name,
            include_str!(concat!(
                env!("CARGO_MANIFEST_DIR"),
                "/shaders/",
                $name,
                ".wgsl"
            )),
        )
    };
}
/// Every file of `shaders/`, by its name without the extension.
pub const FILES: &[(&str, &str)] = &[
    file!("caster/pieces"),
    file!("caster/scene"),
    file!("lib/axes"),
    file!("lib/bias"),
    file!("lib/counters"),
    file!("lib/coverage"),
    file!("lib/edges"),
    file!("lib/fine_tiles"),
    file!("lib/footprint"),
    file!("lib/homography"),
    file!("lib/image_tiles"),
    file!("lib/importance"),
    file!("lib/invocations"),
    file!("lib/light_grid"),
    file!("lib/light_rays"),
    file!("lib/lookup_place"),
    file!("lib/moments"),
    file!("lib/light_sides"),
    file!("lib/normals"),
    file!("lib/pairs"),
    file!("lib/parallel_rays"),
    file!("lib/parts"),
    file!("lib/pieces"),
    file!("lib/projection"),
    file!("lib/receiver_ray"),
    file!("lib/receivers"),
    file!("lib/rounding"),
    file!("lib/shadow_ray"),
    file!("lib/solidity"),
    file!("lib/tables"),
    file!("lib/seams"),
    file!("lib/tiles"),
    file!("lib/triangles"),
    file!("lib/unsure"),
    file!("lib/work_items"),
    file!("mask/alpha"),
    file!("mask/none"),
    file!("paging/pages"),
    file!("paging/whole"),
    file!("projection/homography"),
    file!("projection/log_perspective"),
    file!("projection/parallel"),
    file!("projection/paraboloid"),
    file!("projection/perspective"),
    file!("stored/depth"),
    file!("stored/depth_triangle"),
    file!("target/depth"),
    file!("target/depth_then_triangle"),
    file!("target/depth_triangle"),
    file!("warp/grid"),
    file!("warp/none"),
    file!("blend_importance"),
    file!("boundary"),
    file!("caster_tests"),
    file!("forward_importance"),
    file!("importance_map"),
    file!("image_tiles"),
    file!("lookup"),
    file!("lookup_moments"),
    file!("moments"),
    file!("rasterize"),
    file!("rasterize_bands"),
    file!("outline"),
    file!("packed_image"),
    file!("page_levels"),
    file!("ray_queries"),
    file!("receiver_lists"),
    file!("receiver_tiles"),
    file!("receivers"),
    file!("shadow_edge"),
    file!("shadow_rays"),
    file!("shadow_volumes"),
    file!("samples"),
    file!("tessellate"),
    file!("warp_map"),
];

/// The slots, and what fills each unless a pass says otherwise.
const SLOTS: [(&str, &str); 7] = [
    ("projection", "projection/parallel"),
    ("warp", "warp/none"),
    ("caster", "caster/scene"),
    ("target", "target/depth"),
    ("stored", "stored/depth"),
    ("mask", "mask/none"),
    ("paging", "paging/whole"),
];

/// A shader with its slots filled. A slot that the file does not import plays no part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shader {
    pub file: &'static str,
    fillings: [&'static str; SLOTS.len()],
}

impl Shader {
    pub fn new(file: &'static str) -> Self {
        Self {
            file,
            fillings: SLOTS.map(|(_, filling)| filling),
        }
    }

    /// Fills the slot that has the name of the file's folder.
    pub fn fill(&mut self, file: &'static str) {
        let slot = SLOTS.iter().position(|(slot, _)| is_in(file, slot));
        self.fillings[slot.expect("a folder is a slot")] = file;
    }

    /// The whole WGSL source; directives must stand before all else.
    pub fn compose(self) -> String {
        let files = self.files().into_iter();
        let lines = files.flat_map(|file| text_of(file).lines());
        let lines = lines.filter(|line| import(line).is_none());
        let (mut directives, rest): (Vec<_>, Vec<_>) =
            lines.partition(|line| line.starts_with("enable "));
        directives.extend(rest);
        directives.join("\n") + "\n"
    }

    /// The files that it is made of, each after those that it imports.
    pub fn files(self) -> Vec<&'static str> {
        let mut files = Vec::new();
        self.append(self.file, &mut files);
        files
    }

    fn append(self, file: &'static str, files: &mut Vec<&'static str>) {
        for import in text_of(file).lines().filter_map(import) {
            self.append(self.filling(import).unwrap_or(import), files);
        }
        if !files.contains(&file) {
            files.push(file);
        }
    }

    fn filling(self, slot: &str) -> Option<&'static str> {
        let is_filling = |filling: &&&str| is_in(filling, slot);
        self.fillings.iter().find(is_filling).copied()
    }
}

fn is_in(file: &str, folder: &str) -> bool {
    file.rsplit_once('/').map_or("", |(folder, _)| folder) == folder
}

/// The file of that name in a folder.
pub fn file_of(folder: &str, name: &str) -> &'static str {
    let mut files = FILES.iter().map(|(file, _)| *file);
    let in_folder = |file: &&'static str| file.strip_prefix(folder)?.strip_prefix('/');
    let found = files.find(|file| in_folder(file) == Some(name));
    found.unwrap_or_else(|| panic!("no shader file {name} in {folder}"))
}

fn text_of(name: &str) -> &'static str {
    let file = FILES.iter().find(|(file, _)| *file == name);
    file.unwrap_or_else(|| panic!("no shader file {name}")).1
}

fn import(line: &str) -> Option<&str> {
    line.strip_prefix("#import ").map(str::trim)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::gpu::adapters::MAX_STORAGE_BUFFERS;
    use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
    use std::sync::LazyLock;

    /// Every file with entry points, with every filling of its slots, parsed.
    pub static MODULES: LazyLock<Vec<(Shader, naga::Module)>> = LazyLock::new(|| {
        let shaders = shaders().into_iter();
        let parsed = shaders.map(|shader| {
            let source = shader.compose();
            let module = naga::front::wgsl::parse_str(&source)
                .unwrap_or_else(|e| panic!("{shader:?}: {}", e.emit_to_string(&source)));
            (shader, module)
        });
        parsed.collect()
    });

    /// The names of files in a folder.
    fn in_folder(folder: &str) -> Vec<&'static str> {
        let names = FILES.iter().map(|(name, _)| *name);
        names.filter(|name| is_in(name, folder)).collect()
    }

    fn shaders() -> Vec<Shader> {
        let mut shaders: Vec<_> = in_folder("").into_iter().map(Shader::new).collect();
        for (slot, _) in SLOTS {
            let fill = |shader: Shader| {
                let imports =
                    |file: &&str| text_of(file).lines().filter_map(import).any(|i| i == slot);
                let fillings = match shader.files().iter().any(imports) {
                    true => in_folder(slot),
                    false => vec![shader.filling(slot).unwrap()],
                };
                fillings.into_iter().map(move |filling| {
                    let mut filled = shader;
                    filled.fill(filling);
                    filled
                })
            };
            shaders = shaders.into_iter().flat_map(fill).collect();
        }
        shaders.retain(|shader| is_possible(*shader));
        shaders
    }

    /// Pieces of triangles are in the map, beyond projection and warp; bands are those of a warp. What stands in for
    /// atomics of 64 bits knows of none of these. Maps in pages are not warped, and their edges are straight.
    fn is_possible(shader: Shader) -> bool {
        let [projection, warp, caster, target, _, mask, paging] = shader.fillings;
        let is_curved =
            ["projection/log_perspective", "projection/paraboloid"].contains(&projection);
        let is_exact = warp == "warp/none" && caster == "caster/scene" && !is_curved;
        if paging == "paging/pages" && !is_exact {
            return false;
        }
        let is_beyond = projection == "projection/parallel" && warp == "warp/none";
        let is_plain = projection == "projection/parallel" && mask == "mask/none";
        if target == "target/depth_then_triangle" && !is_plain {
            return false;
        }
        match (shader.file, caster) {
            (_, "caster/pieces") => is_beyond && shader.file == "rasterize" && mask == "mask/none",
            ("rasterize_bands", _) => warp != "warp/none",
            _ => true,
        }
    }

    /// With no more than every device has, but for what is for some.
    pub fn validated(shader: Shader, module: &naga::Module) -> ModuleInfo {
        let files = shader.files();
        let mut capabilities = Capabilities::empty();
        if files.contains(&"target/depth_triangle") {
            capabilities |= Capabilities::SHADER_INT64 | Capabilities::SHADER_INT64_ATOMIC_MIN_MAX;
        }
        if shader.file == "ray_queries" {
            capabilities |= Capabilities::RAY_QUERY;
        }
        Validator::new(ValidationFlags::all(), capabilities)
            .validate(module)
            .unwrap_or_else(|e| panic!("{shader:?}: {}", e.emit_to_string(&shader.compose())))
    }

    #[test]
    fn every_shader_parses_and_validates() {
        let mut most_buffers = 0;
        for (shader, module) in MODULES.iter() {
            let info = validated(*shader, module);
            assert!(!module.entry_points.is_empty(), "{shader:?}");
            for (i, _) in module.entry_points.iter().enumerate() {
                let buffers = module.global_variables.iter().filter(|(handle, variable)| {
                    let is_storage = matches!(variable.space, naga::AddressSpace::Storage { .. });
                    is_storage && !info.get_entry_point(i)[*handle].is_empty()
                });
                most_buffers = most_buffers.max(buffers.count());
            }
        }
        assert_eq!(most_buffers, MAX_STORAGE_BUFFERS as usize);
        let used: Vec<_> = MODULES
            .iter()
            .flat_map(|(shader, _)| shader.files())
            .collect();
        for (file, _) in FILES {
            assert!(used.contains(file), "no shader has {file}");
        }
    }

    /// Fast math has none: Metal's compiler may drop what a select of one gives.
    #[test]
    fn no_shader_makes_a_nan() {
        for (shader, module) in MODULES.iter() {
            let entries = module.entry_points.iter().map(|entry| &entry.function);
            let functions = module.functions.iter().map(|(_, function)| function);
            for function in functions.chain(entries) {
                for (_, expression) in function.expressions.iter() {
                    let number = match *expression {
                        naga::Expression::Literal(naga::Literal::F32(number)) => number,
                        naga::Expression::As { expr, .. } => match function.expressions[expr] {
                            naga::Expression::Literal(naga::Literal::U32(bits)) => {
                                f32::from_bits(bits)
                            }
                            naga::Expression::Constant(_) => panic!("{shader:?}"),
                            _ => continue,
                        },
                        _ => continue,
                    };
                    assert!(!number.is_nan(), "{shader:?}");
                }
            }
        }
    }

    #[test]
    fn no_file_imports_itself_by_way_of_another() {
        let mut finished: Vec<&str> = Vec::new();
        while finished.len() < FILES.len() {
            let is_free = |file: &&&str| {
                let mut imports = text_of(file).lines().filter_map(import);
                imports.all(|name| match in_folder(name) {
                    fillings if fillings.is_empty() => finished.contains(&name),
                    fillings => fillings.iter().all(|file| finished.contains(file)),
                })
            };
            let names: Vec<_> = FILES.iter().map(|(name, _)| *name).collect();
            let left: Vec<_> = names
                .iter()
                .filter(|name| !finished.contains(name))
                .collect();
            let free: Vec<_> = left
                .iter()
                .copied()
                .filter(|file| is_free(file))
                .copied()
                .collect();
            assert!(!free.is_empty(), "a circle among {left:?}");
            finished.extend(free);
        }
    }

    #[test]
    fn every_file_is_listed() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let folders = FILES.iter().map(|(name, _)| root.join(name));
        let mut folders: Vec<_> = folders
            .map(|path| path.parent().unwrap().to_owned())
            .collect();
        folders.sort();
        folders.dedup();
        let mut found = 0;
        for folder in &folders {
            for entry in std::fs::read_dir(folder).unwrap() {
                let path = entry.unwrap().path();
                assert!(
                    path.extension().is_some() || folders.contains(&path),
                    "{path:?}"
                );
                found += usize::from(path.extension().is_some());
            }
        }
        assert_eq!(found, FILES.len());
    }
}
