//! What a frame is asked for.

use crate::error::{Error, Result};

/// What a frame may have to show beside the visibility image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Output {
    TriangleId,
    ShadowMap,
    ImportanceMap,
    WarpMap,
    LightMatrix,
    Projections,
    AliasingError,
    LargestAliasingError,
    MaxEffectiveResolution,
    Pages,
    PageLevels,
}

const OUTPUTS: &[(&str, Output)] = &[
    ("triangle_id", Output::TriangleId),
    ("shadow_map", Output::ShadowMap),
    ("importance_map", Output::ImportanceMap),
    ("warp_map", Output::WarpMap),
    ("light_matrix", Output::LightMatrix),
    ("projections", Output::Projections),
    ("aliasing_error", Output::AliasingError),
    ("largest_aliasing_error", Output::LargestAliasingError),
    ("max_effective_resolution", Output::MaxEffectiveResolution),
    ("pages", Output::Pages),
    ("page_levels", Output::PageLevels),
];

/// A set of them, and how they are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Outputs {
    set: u16,
    /// Whether what cannot change a picture is left out.
    pub(super) culls: bool,
}

impl Outputs {
    pub fn from_names(names: &[String], culls: bool) -> Result<Self> {
        let mut outputs = Self { set: 0, culls };
        for name in names {
            let Some((_, output)) = OUTPUTS.iter().find(|(known, _)| known == name) else {
                let known: Vec<_> = OUTPUTS.iter().map(|(known, _)| *known).collect();
                let known = known.join("', '");
                return Err(Error::Value(format!(
                    "outputs must be among '{known}', got '{name}'"
                )));
            };
            outputs.set |= 1 << *output as u8;
        }
        Ok(outputs)
    }

    pub fn has(self, output: Output) -> bool {
        self.set & (1 << output as u8) != 0
    }

    pub(super) fn has_any(self, outputs: &[Output]) -> bool {
        outputs.iter().any(|&output| self.has(output))
    }

    /// Whether triangles are read back, to be shown or to find the surfaces that pixels see.
    pub(super) fn reads_triangles(self) -> bool {
        self.has_any(&[
            Output::TriangleId,
            Output::AliasingError,
            Output::LargestAliasingError,
        ])
    }

    /// Whether warps are read back, to be shown or to measure the widths of texels.
    pub(super) fn reads_warps(self) -> bool {
        self.has_any(&[
            Output::WarpMap,
            Output::AliasingError,
            Output::LargestAliasingError,
            Output::MaxEffectiveResolution,
        ])
    }
}
