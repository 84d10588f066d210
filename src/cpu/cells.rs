//! Grids of cells that all threads fill.

use super::tiles::share_jobs;
use rayon::prelude::*;

/// Cells of the grids that threads fill at one time, together.
const MOST_CELLS: usize = 1 << 27;

/// What is put together of the grids of zeros that jobs fill, each thread its own: whoever did which job, the same.
pub fn filled(
    cells: usize,
    jobs: usize,
    both: fn(u32, u32) -> u32,
    work: impl Fn(&mut [u32], usize) + Sync,
) -> Vec<u32> {
    let grids = rayon::current_num_threads()
        .min(jobs)
        .min(MOST_CELLS / cells)
        .max(1);
    // Zeros, which the threads that fill them in come upon first: the system hands them out as they are touched.
    let mut grids: Vec<_> = (0..grids).map(|_| vec![0; cells]).collect();
    share_jobs(&mut grids, jobs, |grid, job| work(grid, job));
    let mut first = grids.swap_remove(0);
    for other in grids {
        let pairs = first.par_iter_mut().zip(&other).with_min_len(1 << 14);
        pairs
            .filter(|(_, b)| **b != 0)
            .for_each(|(a, &b)| *a = both(*a, b));
    }
    first
}
