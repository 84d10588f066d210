//! Pass "warp map": importance to monotone functions, `shaders/warp_map.wgsl`.

use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel, Resource};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{Read, Recording, Source};
use crate::gpu::shader_struct::shader_struct;
use crate::map_size::MapSize;
use crate::warp::{self, Axis, CountFit, MAX_CELLS, Warp};

pub const LABEL: &str = "warp map";

/// Functions that share an envelope, as in the shaders.
const BLOCK: u32 = 16;

/// Rows that an invocation smooths, as in the shader.
const ROWS: u32 = 64;

/// A warp by functions along rows and columns, see `shaders/warp/grid.wgsl`.
pub struct WarpMap {
    pub table: PooledBuffer,
    pub layout: Layout,
    uniform: Resource,
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

impl Layout {
    /// The functions with those values.
    pub fn functions_of(&self, values: Vec<f32>) -> Warp {
        Warp {
            functions: self.functions[0] as usize,
            boundaries: self.cells[0] as usize + 1,
            values,
        }
    }
}

impl Kernel {
    /// Fills the slot of warps.
    pub fn warp(self, warp: Option<&WarpMap>) -> Self {
        let Some(warp) = warp else {
            return self;
        };
        self.fill("warp/grid")
            .bind(11, &warp.uniform)
            .bind(12, &warp.table)
            .constant("is_rectilinear", warp.layout.functions == [1, 1])
    }
}

impl WarpMap {
    /// Room for `functions` functions of `cells` cells along each axis of a map of so many
    /// texels; what they are is undefined.
    pub fn new(frame: &Recording, functions: u32, cells: u32, size: MapSize) -> Result<Self> {
        assert!(cells <= MAX_CELLS, "{cells} cells");
        let boundaries = u64::from(cells) + 1;
        let forward = u64::from(functions) * boundaries;
        let inverses =
            [size.width, size.height].map(|texels| u64::from(functions) * u64::from(texels));
        let envelope = u64::from(functions.div_ceil(BLOCK)) * boundaries;
        let bytes = 4 * (2 * forward + inverses[0] + inverses[1] + 4 * envelope);
        // Refused here if it is more than 32 bits can count.
        let table = frame.storage(LABEL, bytes)?;
        let mut end = 0;
        let mut next = |[along_x, along_y]: [u64; 2]| {
            let first = [end as u32, (end + along_x) as u32];
            end += along_x + along_y;
            first
        };
        let layout = Layout {
            functions: [functions; 2],
            cells: [cells; 2],
            forward: next([forward; 2]),
            inverse: next(inverses),
            least: next([envelope; 2]),
            greatest: next([envelope; 2]),
        };
        Ok(Self {
            table,
            uniform: Resource::uniform(&layout),
            layout,
        })
    }

    fn axis(&self, axis: Axis, size: MapSize, window: u32, blur_sigma: f64) -> AxisUniform {
        let i = axis as usize;
        AxisUniform {
            functions: self.layout.functions[i],
            cells: self.layout.cells[i],
            rows: self.layout.cells[1 - i],
            texels: size.along(axis),
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
        frame: &mut Recording,
        axis: Axis,
        size: MapSize,
        counts: &wgpu::Buffer,
        fit: CountFit,
    ) -> Result<()> {
        let window = fit.window(self.layout.cells[1 - axis as usize]);
        let uniform = AxisUniform {
            exponent: fit.exponent as f32,
            even_share: fit.even_share as f32,
            ..self.axis(axis, size, window, 1.0)
        };
        let AxisUniform {
            functions,
            rows,
            cells,
            ..
        } = uniform;
        let bytes = 8 * u64::from(rows) * u64::from(cells);
        let one = frame.storage("weights", bytes)?;
        let two = frame.storage("smoothed weights", bytes)?;
        let with_axis = Kernel::new("warp_map").uniform(0, &uniform);
        let widen = Kernel::new("warp_map").entry("widen").bind(1, counts);
        let by_weight = Groups::Linear((u64::from(rows) * u64::from(cells)).div_ceil(64));
        let adding = |entry_point, from, to, rows| {
            let kernel = with_axis.clone().entry(entry_point);
            let by_cell = Groups::Grid(cells.div_ceil(64), rows);
            kernel.bind(2, from).bind(3, to).dispatch(by_cell)
        };
        let mut dispatches = vec![widen.bind(3, &one).dispatch(by_weight)];
        if window > 0 {
            let blocks = rows.div_ceil(ROWS);
            dispatches.push(adding("smooth_rows", &one, &two, blocks));
            dispatches.push(adding("smooth_rows", &two, &one, blocks));
        }
        dispatches.push(adding("gather", &one, &two, functions));
        let fit = with_axis.entry("functions_of_counts").bind(2, &two);
        let by_function = Groups::Grid(functions, 1);
        dispatches.push(fit.bind(4, &self.table).dispatch(by_function));
        frame.pass(LABEL, &dispatches);
        Ok(())
    }

    /// The function along one axis from the maxima of an importance map (Rosen), blurred by a Gaussian
    /// of `sigma` cells.
    pub fn fit_maxima(
        &self,
        frame: &mut Recording,
        axis: Axis,
        size: MapSize,
        importance: &wgpu::Buffer,
        sigma: f64,
    ) -> Result<()> {
        let cells = self.layout.cells[axis as usize];
        let sigma = warp::blur_within(cells, sigma);
        let uniform = self.axis(axis, size, 0, sigma);
        let collapsed = frame.storage("maxima", 4 * u64::from(cells))?;
        let blurred = frame.storage("blurred maxima", 4 * u64::from(cells))?;
        let kernel = Kernel::new("warp_map").uniform(0, &uniform);
        let collapse = kernel.clone().entry("collapse").bind(1, importance);
        let blur = kernel.clone().entry("blur").bind(6, &blurred);
        let fit = kernel.entry("function_of_maxima").bind(6, &blurred);
        let by_cell = Groups::Grid(cells.div_ceil(64), 1);
        let dispatches = [
            collapse.bind(5, &collapsed).dispatch(by_cell.clone()),
            blur.bind(5, &collapsed).dispatch(by_cell),
            fit.bind(4, &self.table).dispatch(Groups::ONE),
        ];
        frame.pass(LABEL, &dispatches);
        Ok(())
    }

    /// The values of its functions, which are the first numbers of the table.
    pub fn read(&self, frame: &mut Recording) -> Result<Read<f32>> {
        let Layout {
            functions, cells, ..
        } = self.layout;
        let count = 2 * functions[0] as usize * (cells[0] as usize + 1);
        frame.read(Source::Kept(&self.table), count)
    }

    /// Functions as they are given: they are the first numbers of the table.
    pub fn set(&self, frame: &mut Recording, values: &[f32]) {
        frame.write(&self.table, values);
    }

    /// Inverses and envelopes, once the functions along both axes are there.
    pub fn finish(&self, frame: &mut Recording, size: MapSize) {
        let mut dispatches = Vec::new();
        for axis in [Axis::X, Axis::Y] {
            let uniform = self.axis(axis, size, 0, 1.0);
            let (functions, boundaries) = (uniform.functions, uniform.cells + 1);
            let by_texel = Groups::Grid(uniform.texels.div_ceil(64), functions);
            let by_boundary = Groups::Grid(boundaries.div_ceil(64), functions.div_ceil(BLOCK));
            let kernel = Kernel::new("warp_map").uniform(0, &uniform);
            let kernel = kernel.bind(4, &self.table);
            dispatches.push(kernel.clone().entry("invert").dispatch(by_texel));
            dispatches.push(kernel.entry("envelope").dispatch(by_boundary));
        }
        frame.pass(LABEL, &dispatches);
    }
}
