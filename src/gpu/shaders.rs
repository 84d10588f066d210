//! The list of shaders, and how they are put together.
//!
//! A shader is a file of `shaders/` with `#import` lines, each of which stands for another file, taken
//! once. Two imports are slots that a pass fills: `#import projection` with one of `projection/` and
//! `#import target` with one of `target/`.

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
    file!("lib/projection"),
    file!("lib/receivers"),
    file!("lib/tables"),
    file!("lib/triangles"),
    file!("projection/parallel"),
    file!("projection/perspective"),
    file!("target/depth"),
    file!("target/depth_triangle"),
    file!("lookup"),
    file!("rasterize"),
    file!("receivers"),
];

/// A shader with its slots filled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shader {
    pub file: &'static str,
    pub slots: &'static [(&'static str, &'static str)],
}

impl Shader {
    /// The whole WGSL source.
    pub fn compose(self) -> String {
        let mut source = String::new();
        self.append(self.file, &mut Vec::new(), &mut source);
        source
    }

    fn append(self, name: &str, taken: &mut Vec<String>, source: &mut String) {
        let name = self
            .slots
            .iter()
            .find(|(slot, _)| *slot == name)
            .map_or(name, |(_, file)| file);
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
        const PROJECTIONS: [(&str, &str); 2] = [
            ("projection", "projection/parallel"),
            ("projection", "projection/perspective"),
        ];
        const TARGETS: [(&str, &str); 2] = [
            ("target", "target/depth"),
            ("target", "target/depth_triangle"),
        ];
        let mut shaders = vec![Shader {
            file: "receivers",
            slots: &[],
        }];
        for projection in PROJECTIONS {
            let slots = Box::leak(Box::new([projection]));
            shaders.push(Shader {
                file: "lookup",
                slots,
            });
            for target in TARGETS {
                let slots = Box::leak(Box::new([projection, target]));
                shaders.push(Shader {
                    file: "rasterize",
                    slots,
                });
            }
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
                    | naga::valid::Capabilities::SHADER_INT64_ATOMIC_MIN_MAX,
            )
            .validate(&module)
            .unwrap_or_else(|e| panic!("{shader:?}: {}", e.emit_to_string(&source)));
        }
    }

    #[test]
    fn every_file_is_listed() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
        let mut found = 0;
        for folder in ["", "lib", "projection", "target"] {
            for entry in std::fs::read_dir(root.join(folder)).unwrap() {
                found += usize::from(entry.unwrap().path().extension().is_some());
            }
        }
        assert_eq!(found, FILES.len());
    }
}
