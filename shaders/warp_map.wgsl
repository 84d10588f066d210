// Importance to warp: monotone functions along one axis, their inverses and their envelopes.
//
// Non-orthogonal (Milet et al.): a function for each row (column) from the prefix sums of its counts
// (Eq. 1-5). Smoothing among the functions is a weighted average by receiver counts N_i; since
// N_i X_i(x) is the prefix sum itself, that average is the function of the *smoothed counts*. `smooth_rows`
// averages them over a window of rows (columns); twice makes a tent. `gather` adds up the rows that share
// a function. The sums may be taken to a power, and a part of the map may be shared out evenly:
// methods/notw.rs says why.
//
// Rectilinear (Rosen, 4.2): one function from the maxima of rows or columns, blurred by a Gaussian (Eq. 1).
//
// No loop comes near the 65,535 iterations after which some drivers stop in silence: `MAX_CELLS` in
// warp_map.rs sees to it. Sums of counts are integers, so that they are exact for any number of receivers;
// a function without any importance is the identity.
#import lib/invocations
#import lib/pairs

struct WarpAxis {
    functions: u32,
    cells: u32,
    rows: u32,                          // of the counts, or columns along y
    texels: u32,                        // along this axis
    window: u32,                        // rows on each side that `smooth_rows` averages
    forward: u32,                       // first elements in the table, see warp/grid.wgsl
    inverse: u32,
    least: u32,
    greatest: u32,
    along_y: u32,                       // which maxima `collapse` takes
    blur_sigma: f32,                    // cells
    exponent: f32,                      // of counts
    even_share: f32,                    // part of the map that does not depend on counts
}

@group(0) @binding(0) var<uniform> axis_uniform: WarpAxis;
@group(0) @binding(1) var<storage, read> counts: array<u32>;
@group(0) @binding(2) var<storage, read> weights: array<Pair>;
@group(0) @binding(3) var<storage, read_write> smoothed: array<Pair>;
@group(0) @binding(4) var<storage, read_write> warp_table: array<f32>;
@group(0) @binding(5) var<storage, read_write> collapsed: array<f32>;
@group(0) @binding(6) var<storage, read_write> blurred: array<f32>;

const BLOCK: u32 = 16u;
const POWER_UNIT: f32 = 256.0;

// ---- non-orthogonal ----

@compute @workgroup_size(GROUP)
fn widen(invocation: Invocation) {
    let index = index_of_invocation(invocation, GROUP);
    if index < arrayLength(&smoothed) {
        smoothed[index] = pair(counts[index], 0u);
    }
}

// Rows of a cell that an invocation slides a window over.
const ROWS: u32 = 64u;

@compute @workgroup_size(64)
fn smooth_rows(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let axis = axis_uniform;
    let cell = invocation.x;
    if cell >= axis.cells {
        return;
    }
    let first = invocation.y * ROWS;
    var sum = Pair();
    for (var i = first - min(axis.window, first); i < min(first + axis.window, axis.rows); i += 1u) {
        sum = sum_of(sum, weights[i * axis.cells + cell]);
    }
    for (var i = first; i < min(first + ROWS, axis.rows); i += 1u) {
        let entering = i + axis.window;
        if entering < axis.rows {
            sum = sum_of(sum, weights[entering * axis.cells + cell]);
        }
        if i > max(axis.window, first) {
            sum = difference_of(sum, weights[(i - axis.window - 1u) * axis.cells + cell]);
        }
        smoothed[i * axis.cells + cell] = sum;
    }
}

// The counts of all rows that share a function, to a power: a cell of a function an invocation.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let axis = axis_uniform;
    let cell = invocation.x;
    if cell >= axis.cells {
        return;
    }
    let index = invocation.y;
    var sum = Pair();
    for (var i = index * axis.rows / axis.functions; i < (index + 1u) * axis.rows / axis.functions; i += 1u) {
        sum = sum_of(sum, weights[i * axis.cells + cell]);
    }
    if axis.exponent != 1.0 {
        // Integers again: a sum in another order is the same sum.
        let power = round(POWER_UNIT * pow(float_from_integer(sum), axis.exponent));
        sum = integer_from_float(select(power, 0.0, is_zero(sum)));
    }
    smoothed[index * axis.cells + cell] = sum;
}

var<workgroup> sums: array<Pair, GROUP>;

// A function a workgroup: each invocation adds up a part of the cells, then all those before its own.
@compute @workgroup_size(GROUP)
fn functions_of_counts(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let axis = axis_uniform;
    let first = group.x * axis.cells;
    let each = (axis.cells + GROUP - 1u) / GROUP;
    let end = min((local + 1u) * each, axis.cells);
    var own = Pair();
    for (var cell = local * each; cell < end; cell += 1u) {
        own = sum_of(own, weights[first + cell]);
    }
    sums[local] = own;
    workgroupBarrier();
    var sum = Pair();
    var total = Pair();
    for (var i = 0u; i < GROUP; i += 1u) {
        if i == local {
            sum = total;
        }
        total = sum_of(total, sums[i]);
    }
    let start = axis.forward + group.x * (axis.cells + 1u);
    for (var cell = local * each; cell < end; cell += 1u) {
        let identity = f32(cell) / f32(axis.cells);
        let equalized = mix(float_from_integer(sum) / float_from_integer(total), identity, axis.even_share);
        warp_table[start + cell] = select(equalized, identity, is_zero(total));
        sum = sum_of(sum, weights[first + cell]);
    }
    if local == 0u {
        warp_table[start + axis.cells] = 1.0;
    }
}

// ---- rectilinear ----

// Maxima of the columns, or of the rows along y: a cell an invocation.
@compute @workgroup_size(64)
fn collapse(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let axis = axis_uniform;
    let cell = invocation.x;
    if cell >= axis.cells {
        return;
    }
    let stride = select(axis.cells, 1u, axis.along_y != 0u);
    let first = select(cell, cell * axis.cells, axis.along_y != 0u);
    var greatest = 0u;
    for (var i = 0u; i < axis.cells; i += 1u) {
        greatest = max(greatest, counts[first + i * stride]);
    }
    collapsed[cell] = bitcast<f32>(greatest);
}

// A Gaussian blur of the maxima: a cell an invocation.
@compute @workgroup_size(64)
fn blur(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let axis = axis_uniform;
    let cell = i32(invocation.x);
    let cells = i32(axis.cells);
    if cell >= cells {
        return;
    }
    let reach = min(i32(ceil(3.0 * axis.blur_sigma)), cells);
    var sum = 0.0;
    var weight = 0.0;
    for (var place = max(cell - reach, 0); place <= min(cell + reach, cells - 1); place += 1) {
        let offset = f32(place - cell) / axis.blur_sigma;
        let w = exp(-0.5 * offset * offset);
        sum += w * collapsed[place];
        weight += w;
    }
    blurred[cell] = sum / weight;
}

// Cells that are added up together: a multiple of GROUP, so that an invocation comes back to cells of its own.
const PART: u32 = 256u;
var<workgroup> maxima: array<f32, PART>;

// One function: a workgroup moves the numbers, and one invocation adds them up, in the same order everywhere.
@compute @workgroup_size(GROUP)
fn function_of_maxima(@builtin(local_invocation_index) local: u32) {
    let axis = axis_uniform;
    var sum = 0.0;
    for (var start = 0u; start < axis.cells; start += PART) {
        let count = min(PART, axis.cells - start);
        for (var i = local; i < count; i += GROUP) {
            maxima[i] = blurred[start + i];
        }
        workgroupBarrier();
        if local == 0u {
            for (var i = 0u; i < count; i += 1u) {
                let own = maxima[i];
                maxima[i] = sum;
                sum += own;
            }
        }
        workgroupBarrier();
        for (var i = local; i < count; i += GROUP) {
            warp_table[axis.forward + start + i] = maxima[i];
        }
        workgroupBarrier();
    }
    if local == 0u {
        maxima[0] = sum;
        warp_table[axis.forward + axis.cells] = 1.0;
    }
    let total = workgroupUniformLoad(&maxima[0]);
    for (var cell = local; cell < axis.cells; cell += GROUP) {
        let identity = f32(cell) / f32(axis.cells);
        let before = warp_table[axis.forward + cell];
        warp_table[axis.forward + cell] = select(before / total, identity, total == 0.0);
    }
}

// ---- both ----

// Inverses at the centres of texels: a texel an invocation, which searches for the first cell that reaches it.
@compute @workgroup_size(64)
fn invert(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let axis = axis_uniform;
    let texel = invocation.x;
    if texel >= axis.texels {
        return;
    }
    let forward = axis.forward + invocation.y * (axis.cells + 1u);
    let centre = (f32(texel) + 0.5) / f32(axis.texels);
    var cell = 0u;
    var last = axis.cells - 1u;
    while cell < last {
        let middle = (cell + last) / 2u;
        let is_short = warp_table[forward + middle + 1u] < centre;
        cell = select(cell, middle + 1u, is_short);
        last = select(middle, last, is_short);
    }
    let a = warp_table[forward + cell];
    let b = warp_table[forward + cell + 1u];
    let part = clamp((centre - a) / max(b - a, 1e-30), 0.0, 1.0);
    let inverse = axis.inverse + invocation.y * axis.texels;
    warp_table[inverse + texel] = (f32(cell) + part) / f32(axis.cells);
}

// Least and greatest values of blocks of functions: a boundary of a block an invocation.
@compute @workgroup_size(64)
fn envelope(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let axis = axis_uniform;
    let boundary = invocation.x;
    if boundary > axis.cells {
        return;
    }
    let block = invocation.y;
    var least = 1.0;
    var greatest = 0.0;
    for (var i = block * BLOCK; i < min((block + 1u) * BLOCK, axis.functions); i += 1u) {
        let value = warp_table[axis.forward + i * (axis.cells + 1u) + boundary];
        least = min(least, value);
        greatest = max(greatest, value);
    }
    warp_table[axis.least + block * (axis.cells + 1u) + boundary] = least;
    warp_table[axis.greatest + block * (axis.cells + 1u) + boundary] = greatest;
}
