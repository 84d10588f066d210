//! Twin tests: a function of a shader, run on the device, against the same formula in Rust.
//!
//! Formulas are generic over the scalar, so they are also run on numbers that carry a bound of what float32 may
//! round, whatever the order of sums: both twins must stay within it.

use crate::gpu;
use crate::lanes::Lane;
use glam::DVec3;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};
use wgpu::util::DeviceExt;

/// A float64 number, and how far float32 may be from it: infinitely far where it may overflow.
#[derive(Debug, Clone, Copy)]
pub struct Bounded {
    pub value: f64,
    pub error: f64,
}

/// One rounding, and what may be flushed to zero.
const STEP: f64 = f32::EPSILON as f64;
const TINY: f64 = f32::MIN_POSITIVE as f64;

impl Bounded {
    /// A sum of `size`, or what comes of it, after `roundings`.
    fn new(value: f64, error: f64, size: f64, roundings: f64) -> Self {
        let error = error + roundings * STEP * (size + error) + TINY;
        let is_known = value.abs() + size + error < f64::from(f32::MAX);
        let error = if is_known { error } else { f64::INFINITY };
        Self { value, error }
    }

    pub fn exact(value: f32) -> Self {
        let (value, error) = (f64::from(value), 0.0);
        Self { value, error }
    }

    fn holds(self, found: f32) -> bool {
        self.error.is_infinite() || (f64::from(found) - self.value).abs() <= self.error
    }
}

impl Add for Bounded {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (value, error) = (self.value + other.value, self.error + other.error);
        if error == 0.0 && f64::from(value as f32) == value {
            return Self { value, error };
        }
        let size = self.value.abs() + other.value.abs();
        Self::new(value, error, size, 1.0)
    }
}

impl Sub for Bounded {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Bounded {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let value = self.value * other.value;
        let error = self.value.abs() * other.error + (other.value.abs() + other.error) * self.error;
        Self::new(value, error, value.abs(), 1.0)
    }
}

impl Div for Bounded {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        let room = other.value.abs() - other.error;
        let error = (self.error + value.abs() * other.error) / room;
        let error = if room > TINY { error } else { f64::INFINITY };
        // As far off as WebGPU allows.
        Self::new(value, error, value.abs(), 3.0)
    }
}

impl Neg for Bounded {
    type Output = Self;
    fn neg(self) -> Self {
        let value = -self.value;
        Self { value, ..self }
    }
}

/// A comparison; none where rounding may turn it.
#[derive(Clone, Copy)]
pub struct Mask(Option<bool>);

impl BitAnd for Mask {
    type Output = Self;
    fn bitand(self, other: Self) -> Self {
        !(!self | !other)
    }
}

impl BitOr for Mask {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(match (self.0, other.0) {
            (Some(true), _) | (_, Some(true)) => Some(true),
            (Some(false), Some(false)) => Some(false),
            _ => None,
        })
    }
}

impl Not for Mask {
    type Output = Self;
    fn not(self) -> Self {
        Self(self.0.map(|is_set| !is_set))
    }
}

impl Lane for Bounded {
    type Mask = Mask;

    fn constant(self, value: f64) -> Self {
        let rounded = Self::exact(value as f32);
        let error = (value - rounded.value).abs();
        Self { error, ..rounded }
    }

    fn sqrt(self) -> Self {
        let value = self.value.max(0.0).sqrt();
        let low = (self.value - self.error).max(0.0).sqrt();
        let high = (self.value + self.error).max(0.0).sqrt();
        Self::new(value, (high - value).max(value - low), value, 3.0)
    }

    fn abs(self) -> Self {
        let value = self.value.abs();
        Self { value, ..self }
    }

    fn min(self, other: Self) -> Self {
        -(-self).max(-other)
    }

    fn max(self, other: Self) -> Self {
        let value = self.value.max(other.value);
        let error = match self.less(other).0 {
            Some(true) => other.error,
            Some(false) => self.error,
            None => self.error.max(other.error),
        };
        Self { value, error }
    }

    fn floor(self) -> Self {
        let low = (self.value - self.error).floor();
        let high = (self.value + self.error).floor();
        let error = if low == high { 0.0 } else { f64::INFINITY };
        let value = low;
        Self { value, error }
    }

    // As far off as WebGPU allows.
    fn exp(self) -> Self {
        let value = self.value.exp();
        let error = value * self.error.exp_m1();
        let roundings = 3.0 + 2.0 * (self.value.abs() + self.error);
        Self::new(value, error, value, roundings)
    }

    fn ln(self) -> Self {
        let value = self.value.ln();
        let low = self.value - self.error;
        if low.is_nan() || low <= TINY {
            let error = f64::INFINITY;
            return Self { value, error };
        }
        let error = value - low.ln();
        Self::new(value, error + 4.0 * STEP, value.abs(), 3.0)
    }

    fn gather(table: &[f32], width: usize, row: Self, column: Self) -> Self {
        if row.error + column.error > 0.1 {
            let (value, error) = (0.0, f64::INFINITY);
            return Self { value, error };
        }
        let whole = |lane: Self| lane.value.round() as usize;
        Self::exact(table[whole(row) * width + whole(column)])
    }

    fn less(self, other: Self) -> Mask {
        !other.at_most(self)
    }

    fn at_most(self, other: Self) -> Mask {
        let error = self.error + other.error;
        let is_sure = error == 0.0 || (self.value - other.value).abs() > error;
        Mask(is_sure.then_some(self.value <= other.value))
    }

    fn select(mask: Mask, yes: Self, no: Self) -> Self {
        match mask.0 {
            Some(true) => yes,
            Some(false) => no,
            None => {
                let apart = (yes.value - no.value).abs();
                Self::new(yes.value, apart + yes.error.max(no.error), 0.0, 0.0)
            }
        }
    }
}

/// The same numbers at every run (Steele et al., "Fast splittable pseudorandom number generators", 2014).
pub struct Random(pub u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    pub fn below(&mut self, end: usize) -> usize {
        (self.next() % end as u64) as usize
    }

    /// From 0 to 1.
    pub fn share(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// From -1 to 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.share() - 1.0
    }

    /// Of such coordinates.
    pub fn vector(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    /// From a millionth to a million, of either sign, or what a formula may stumble on.
    pub fn number(&mut self) -> f32 {
        let sign = if self.below(2) == 0 { 1.0 } else { -1.0 };
        let hard = [0.0, 1.0, 0.5, 1e-6, 1e6];
        let size = match self.below(8) {
            0 => hard[self.below(hard.len())],
            1 => 10f64.powf(12.0 * self.share() - 6.0),
            _ => 10f64.powf(2.0 * self.share() - 1.0),
        };
        (sign * size) as f32
    }
}

/// A formula of Rust for every scalar.
pub trait Twin {
    fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L>;
}

/// Asserts that the function `twin(i)` of WGSL, which reads numbers from `inputs[i + ...]` and gives an array, and
/// from a warp's table where there is one, and the twin in Rust give the same outputs for all inputs, and that rounding hides few of them.
pub fn assert_twins<const INPUTS: usize>(
    source: &str,
    twin_in_rust: &impl Twin,
    cases: &[[f32; INPUTS]],
    table: &[f32],
) {
    let outputs = twin_in_rust.evaluate(&cases[0]).len();
    let found = run_on_device(source, cases, table, outputs);
    let mut known = vec![0; outputs];
    for (case, found) in cases.iter().zip(found.chunks_exact(outputs)) {
        let bounds = twin_in_rust.evaluate(&case.map(Bounded::exact));
        let in_rust = twin_in_rust.evaluate(case);
        for (i, bound) in bounds.iter().enumerate() {
            assert!(
                bound.holds(in_rust[i]),
                "Rust, output {i} of {case:?}: {} {bound:?}",
                in_rust[i]
            );
            assert!(
                bound.holds(found[i]),
                "WGSL, output {i} of {case:?}: {} {bound:?}",
                found[i]
            );
            known[i] += usize::from(bound.error <= 1e-2 * bound.value.abs() + 1e-6);
        }
    }
    let least = cases.len() / 3;
    assert!(
        known.iter().all(|&count| count > least),
        "{known:?} of {}",
        cases.len()
    );
}

/// What the function `twin(i)` of WGSL gives for all inputs, one after the other.
pub fn run_on_device<const INPUTS: usize>(
    source: &str,
    cases: &[[f32; INPUTS]],
    table: &[f32],
    outputs: usize,
) -> Vec<f32> {
    let source = format!(
        "{source}
        @group(0) @binding(30) var<storage, read> inputs: array<f32>;
        @group(0) @binding(31) var<storage, read_write> outputs: array<f32>;
        @compute @workgroup_size(64)
        fn run(@builtin(global_invocation_id) id: vec3<u32>) {{
            if id.x < {}u {{
                var values = twin(id.x * {INPUTS}u);
                for (var i = 0u; i < {outputs}u; i += 1u) {{
                    outputs[id.x * {outputs}u + i] = values[i];
                }}
            }}
        }}",
        cases.len()
    );
    let gpu = gpu::gpu("").unwrap();
    let device = &gpu.device;
    let refused = device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
        label: None,
        source: wgpu::ShaderSource::Wgsl(source.into()),
    });
    let pipeline = device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: None,
        layout: None,
        module: &module,
        entry_point: Some("run"),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    let given = |values: &[f32]| {
        device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: None,
            contents: bytemuck::cast_slice(values),
            usage: wgpu::BufferUsages::STORAGE,
        })
    };
    let inputs = given(cases.as_flattened());
    let table_values = given(table);
    let buffer = |usage| {
        device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: (4 * outputs * cases.len()) as u64,
            usage,
            mapped_at_creation: false,
        })
    };
    let found = buffer(wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC);
    let read = buffer(wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST);
    let entries = [(30, &inputs), (31, &found), (12, &table_values)].map(|(binding, buffer)| {
        wgpu::BindGroupEntry {
            binding,
            resource: buffer.as_entire_binding(),
        }
    });
    let used = if table.is_empty() { 2 } else { 3 };
    let bindings = device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries[..used],
    });
    let mut encoder = device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
    pass.set_pipeline(&pipeline);
    pass.set_bind_group(0, &bindings, &[]);
    pass.dispatch_workgroups(cases.len().div_ceil(64) as u32, 1, 1);
    drop(pass);
    encoder.copy_buffer_to_buffer(&found, 0, &read, 0, None);
    gpu.queue.submit([encoder.finish()]);
    let refused = pollster::block_on(refused.pop());
    assert!(refused.is_none(), "{}", refused.unwrap());
    read.map_async(wgpu::MapMode::Read, .., |result| result.unwrap());
    device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
    bytemuck::cast_slice(&read.get_mapped_range(..).unwrap()).to_vec()
}
