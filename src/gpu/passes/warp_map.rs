//! Pass "warp map": importance to monotone functions, `shaders/warp_map.wgsl`.

use crate::error::Result;
use crate::gpu::frame::{Binding, Dispatch, Frame, Groups, buffer};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::{Shader, flag};

pub const LABEL: &str = "warp map";

const SHADER: Shader = Shader::new("warp_map");

/// Functions that share an envelope, as in the shaders.
const BLOCK: u32 = 16;

/// Loops over the cells of a function, and over the texels after them, stay below 65,535 iterations.
pub const MAX_CELLS: u32 = 16384;

/// The file that fills the shaders' slot `warp`.
pub fn shader(warp: Option<&WarpMap>) -> &'static str {
    match warp {
        Some(_) => "warp/grid",
        None => "warp/none",
    }
}

/// Constants of the shaders that have that slot.
pub fn constants(warp: Option<&WarpMap>) -> Option<(&'static str, f64)> {
    let is_rectilinear = warp?.layout.functions == [1, 1];
    Some(("is_rectilinear", flag(is_rectilinear)))
}

/// A warp by functions along rows and columns, see `shaders/warp/grid.wgsl`.
pub struct WarpMap {
    pub table: PooledBuffer,
    pub layout: Layout,
    uniform: wgpu::Buffer,
}

shader_struct! {
    /// Where the functions stand in the table.
    pub struct Layout is Warp in "warp/grid" {
        /// Functions along x (one for each row), along y (one for each column).
        pub functions: [u32; 2],
        /// Cells of each function.
        pub cells: [u32; 2],
        /// First elements in the table: values at the boundaries of cells.
        pub forward: [u32; 2],
        inverse: [u32; 2],
        least: [u32; 2],
        greatest: [u32; 2],
    }
}

/// How functions follow from counts of receivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CountFit {
    /// Standard deviation, in rows of counts, of about a Gaussian among them.
    pub smoothing: f64,
    /// The power of a count that a cell is worth.
    pub exponent: f64,
    /// Part of the map, in [0, 1], that is shared out evenly.
    pub even_share: f64,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
}

shader_struct! {
    pub struct AxisUniform is WarpAxis in "warp_map" {
        functions: u32,
        cells: u32,
        rows: u32,
        texels: u32,
        window: u32,
        forward: u32,
        inverse: u32,
        least: u32,
        greatest: u32,
        along_y: u32,
        blur_sigma: f32,
        exponent: f32,
        even_share: f32,
    }
}

impl WarpMap {
    /// Room for `functions` functions of `cells` cells along each axis of a map of `resolution`
    /// texels; what they are is undefined.
    pub fn new(frame: &Frame, functions: u32, cells: u32, resolution: u32) -> Result<Self> {
        assert!(cells <= MAX_CELLS, "{cells} cells");
        let boundaries = u64::from(cells) + 1;
        let forward = u64::from(functions) * boundaries;
        let inverse = u64::from(functions) * u64::from(resolution);
        let envelope = u64::from(functions.div_ceil(BLOCK)) * boundaries;
        let size = 4 * 2 * (forward + inverse + 2 * envelope);
        // Refused here if it is more than 32 bits can count.
        let table = frame.storage(LABEL, size)?;
        let mut end = 0;
        let mut next = |size: u64| {
            let first = [end as u32, (end + size) as u32];
            end += 2 * size;
            first
        };
        let layout = Layout {
            functions: [functions; 2],
            cells: [cells; 2],
            forward: next(forward),
            inverse: next(inverse),
            least: next(envelope),
            greatest: next(envelope),
        };
        Ok(Self {
            table,
            uniform: frame.uniform("warp", &layout),
            layout,
        })
    }

    /// For shaders with the slot `warp/grid`.
    pub fn bindings(&self) -> Vec<Binding<'_>> {
        vec![(11, buffer(&self.uniform)), (12, buffer(&self.table))]
    }

    fn axis(&self, axis: Axis, resolution: u32, window: u32, blur_sigma: f64) -> AxisUniform {
        let i = axis as usize;
        AxisUniform {
            functions: self.layout.functions[i],
            cells: self.layout.cells[i],
            rows: self.layout.cells[1 - i],
            texels: resolution,
            window,
            forward: self.layout.forward[i],
            inverse: self.layout.inverse[i],
            least: self.layout.least[i],
            greatest: self.layout.greatest[i],
            along_y: u32::from(axis == Axis::Y),
            blur_sigma: blur_sigma as f32,
            exponent: 1.0,
            even_share: 0.0,
        }
    }

    /// The functions along one axis from counts of receivers (Milet et al.), as many rows (columns) of
    /// cells as the functions along the other axis have. Each function serves its share of the rows.
    pub fn fit_counts(
        &self,
        frame: &mut Frame,
        axis: Axis,
        resolution: u32,
        counts: &wgpu::Buffer,
        fit: CountFit,
    ) -> Result<()> {
        let sigma = fit.smoothing;
        // Two windows of 2 h + 1 have the variance ((2 h + 1)^2 - 1) / 6.
        let window = (((6.0 * sigma * sigma + 1.0).sqrt() - 1.0) / 2.0).round() as u32;
        let window = window.min(self.layout.cells[1 - axis as usize]);
        let uniform = AxisUniform {
            exponent: fit.exponent as f32,
            even_share: fit.even_share as f32,
            ..self.axis(axis, resolution, window, 1.0)
        };
        let (functions, rows, cells) = (uniform.functions, uniform.rows, uniform.cells);
        let uniform = frame.uniform("warp axis", &uniform);
        let size = 8 * u64::from(rows) * u64::from(cells);
        let one = frame.storage("weights", size)?;
        let two = frame.storage("smoothed weights", size)?;
        let gpu = frame.gpu.clone();
        let widen = gpu.pipeline(SHADER, "widen", &[]);
        let smooth = gpu.pipeline(SHADER, "smooth_rows", &[]);
        let gather = gpu.pipeline(SHADER, "gather", &[]);
        let fit = gpu.pipeline(SHADER, "functions_of_counts", &[]);
        let adding = |pipeline, from, to, rows| Dispatch {
            pipeline,
            bindings: vec![(0, buffer(&uniform)), (2, buffer(from)), (3, buffer(to))],
            groups: Groups::Grid(cells.div_ceil(64), rows),
        };
        let mut dispatches = vec![Dispatch {
            pipeline: &widen,
            bindings: vec![(1, buffer(counts)), (3, buffer(&one))],
            groups: Groups::Linear((u64::from(rows) * u64::from(cells)).div_ceil(64)),
        }];
        if window > 0 {
            dispatches.push(adding(&smooth, &one, &two, 1));
            dispatches.push(adding(&smooth, &two, &one, 1));
        }
        dispatches.push(adding(&gather, &one, &two, functions));
        dispatches.push(Dispatch {
            pipeline: &fit,
            bindings: vec![
                (0, buffer(&uniform)),
                (2, buffer(&two)),
                (4, buffer(&self.table)),
            ],
            groups: Groups::Grid(functions.div_ceil(8), 1),
        });
        frame.pass(LABEL, &dispatches);
        Ok(())
    }

    /// The function along one axis from the maxima of an importance map (Rosen), blurred by a Gaussian
    /// of `sigma` cells.
    pub fn fit_maxima(
        &self,
        frame: &mut Frame,
        axis: Axis,
        resolution: u32,
        importance: &wgpu::Buffer,
        sigma: f64,
    ) -> Result<()> {
        let cells = self.layout.cells[axis as usize];
        // No blur is a narrow one, and none is wider than the map.
        let sigma = sigma.clamp(1e-3, f64::from(cells));
        let uniform = self.axis(axis, resolution, 0, sigma);
        let uniform = frame.uniform("warp axis", &uniform);
        let collapsed = frame.storage("maxima", 4 * u64::from(cells))?;
        let blurred = frame.storage("blurred maxima", 4 * u64::from(cells))?;
        let gpu = frame.gpu.clone();
        let collapse = gpu.pipeline(SHADER, "collapse", &[]);
        let blur = gpu.pipeline(SHADER, "blur", &[]);
        let fit = gpu.pipeline(SHADER, "function_of_maxima", &[]);
        frame.pass(
            LABEL,
            &[
                Dispatch {
                    pipeline: &collapse,
                    bindings: vec![
                        (0, buffer(&uniform)),
                        (1, buffer(importance)),
                        (5, buffer(&collapsed)),
                    ],
                    groups: Groups::Grid(cells.div_ceil(64), 1),
                },
                Dispatch {
                    pipeline: &blur,
                    bindings: vec![
                        (0, buffer(&uniform)),
                        (5, buffer(&collapsed)),
                        (6, buffer(&blurred)),
                    ],
                    groups: Groups::Grid(cells.div_ceil(64), 1),
                },
                Dispatch {
                    pipeline: &fit,
                    bindings: vec![
                        (0, buffer(&uniform)),
                        (4, buffer(&self.table)),
                        (6, buffer(&blurred)),
                    ],
                    groups: Groups::Linear(1),
                },
            ],
        );
        Ok(())
    }

    /// Inverses and envelopes, once the functions along both axes are there.
    pub fn finish(&self, frame: &mut Frame, resolution: u32) {
        let gpu = frame.gpu.clone();
        let invert = gpu.pipeline(SHADER, "invert", &[]);
        let envelope = gpu.pipeline(SHADER, "envelope", &[]);
        let uniforms = [Axis::X, Axis::Y].map(|axis| self.axis(axis, resolution, 0, 1.0));
        let buffers = uniforms.map(|uniform| frame.uniform("warp axis", &uniform));
        let mut dispatches = Vec::new();
        for (uniform, bound) in uniforms.iter().zip(&buffers) {
            let bindings = vec![(0, buffer(bound)), (4, buffer(&self.table))];
            dispatches.push(Dispatch {
                pipeline: &invert,
                bindings: bindings.clone(),
                groups: Groups::Grid(uniform.functions.div_ceil(8), 1),
            });
            dispatches.push(Dispatch {
                pipeline: &envelope,
                bindings,
                groups: Groups::Grid(
                    (uniform.cells + 1).div_ceil(64),
                    uniform.functions.div_ceil(BLOCK),
                ),
            });
        }
        frame.pass(LABEL, &dispatches);
    }
}
