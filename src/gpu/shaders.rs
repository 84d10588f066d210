//! The list of shaders, and how they are put together.
//!
//! A shader is a file of `shaders/` with `#import` lines, each of which stands for another file, taken
//! once. Five imports are slots that a pass fills: `#import projection` with one of `projection/`,
//! `#import warp` with one of `warp/`, `#import caster` with one of `caster/`, and `#import target` and
//! `#import stored` with one of `target/` and of `stored/`, which write and read the same texels.

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
    file!("lib/coverage"),
    file!("lib/edges"),
    file!("lib/image_tiles"),
    file!("lib/invocations"),
    file!("lib/light_grid"),
    file!("lib/light_rays"),
    file!("lib/normals"),
    file!("lib/parts"),
    file!("lib/pieces"),
    file!("lib/projection"),
    file!("lib/receiver_ray"),
    file!("lib/receivers"),
    file!("lib/shadow_ray"),
    file!("lib/tables"),
    file!("lib/seams"),
    file!("lib/tiles"),
    file!("lib/triangles"),
    file!("lib/work_items"),
    file!("projection/homography"),
    file!("projection/parallel"),
    file!("projection/paraboloid"),
    file!("projection/perspective"),
    file!("stored/depth"),
    file!("stored/depth_triangle"),
    file!("target/depth"),
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
    file!("rasterize"),
    file!("rasterize_bands"),
    file!("outline"),
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

/// The value of a shader's constant that is a bool.
pub fn flag(is_on: bool) -> f64 {
    f64::from(u8::from(is_on))
}

/// A shader with its slots filled. A slot that the file does not import plays no part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shader {
    pub file: &'static str,
    pub projection: &'static str,
    pub warp: &'static str,
    pub caster: &'static str,
    pub target: &'static str,
    pub stored: &'static str,
}

impl Shader {
    pub const fn new(file: &'static str) -> Self {
        Self {
            file,
            projection: "projection/parallel",
            warp: "warp/none",
            caster: "caster/scene",
            target: "target/depth",
            stored: "stored/depth",
        }
    }

    /// The whole WGSL source.
    pub fn compose(self) -> String {
        let mut source = String::new();
        self.append(self.file, &mut Vec::new(), &mut source);
        source
    }

    fn append(self, name: &str, taken: &mut Vec<String>, source: &mut String) {
        let name = match name {
            "projection" => self.projection,
            "warp" => self.warp,
            "caster" => self.caster,
            "target" => self.target,
            "stored" => self.stored,
            file => file,
        };
        if taken.iter().any(|file| file == name) {
            return;
        }
        taken.push(name.to_string());
        let (_, text) = FILES
            .iter()
            .find(|(file, _)| *file == name)
            .unwrap_or_else(|| panic!("no shader file {name}"));
        for line in text.lines() {
            match line.strip_prefix("#import ") {
                Some(import) => self.append(import.trim(), taken, source),
                None => {
                    source.push_str(line);
                    source.push('\n');
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every shader that a pass may ask for, with every filling of its slots.
    fn shaders() -> Vec<Shader> {
        let files = [
            "boundary",
            "caster_tests",
            "forward_importance",
            "importance_map",
            "lookup",
            "outline",
            "ray_queries",
            "rasterize",
            "rasterize_bands",
            "receiver_lists",
            "receivers",
            "shadow_edge",
            "shadow_rays",
            "shadow_volumes",
            "samples",
            "tessellate",
            "warp_map",
        ];
        let mut shaders = Vec::new();
        for file in files {
            for projection in [
                "projection/parallel",
                "projection/homography",
                "projection/perspective",
                "projection/paraboloid",
            ] {
                for warp in ["warp/none", "warp/grid"] {
                    if file == "rasterize_bands" && warp == "warp/none" {
                        continue;
                    }
                    for (target, stored) in [
                        ("target/depth", "stored/depth"),
                        ("target/depth_triangle", "stored/depth_triangle"),
                    ] {
                        shaders.push(Shader {
                            file,
                            projection,
                            warp,
                            target,
                            stored,
                            ..Shader::new(file)
                        });
                    }
                }
            }
        }
        for target in ["target/depth", "target/depth_triangle"] {
            shaders.push(Shader {
                caster: "caster/pieces",
                target,
                ..Shader::new("rasterize")
            });
        }
        shaders
    }

    #[test]
    fn every_shader_parses_and_validates() {
        for shader in shaders() {
            let source = shader.compose();
            let module = naga::front::wgsl::parse_str(&source)
                .unwrap_or_else(|e| panic!("{shader:?}: {}", e.emit_to_string(&source)));
            naga::valid::Validator::new(
                naga::valid::ValidationFlags::all(),
                naga::valid::Capabilities::SHADER_INT64
                    | naga::valid::Capabilities::SHADER_INT64_ATOMIC_MIN_MAX
                    | naga::valid::Capabilities::RAY_QUERY,
            )
            .validate(&module)
            .unwrap_or_else(|e| panic!("{shader:?}: {}", e.emit_to_string(&source)));
        }
    }

    #[test]
    fn every_file_is_listed() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let mut found = 0;
        for folder in [
            "",
            "caster",
            "lib",
            "projection",
            "stored",
            "target",
            "warp",
        ] {
            for entry in std::fs::read_dir(root.join(folder)).unwrap() {
                found += usize::from(entry.unwrap().path().extension().is_some());
            }
        }
        assert_eq!(found, FILES.len());
    }
}
