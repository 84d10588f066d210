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
    filled_beside(cells, jobs, both, || (), |grid, (), job| work(grid, job)).0
}

/// The same, and what the jobs make beside it, in any order; each thread has its own state.
pub fn filled_beside<T: Send, R: Send>(
    cells: usize,
    jobs: usize,
    both: fn(u32, u32) -> u32,
    state: impl Fn() -> T,
    work: impl Fn(&mut [u32], &mut T, usize) -> R + Sync,
) -> (Vec<u32>, Vec<R>) {
    let grids = rayon::current_num_threads()
        .min(jobs)
        .min(MOST_CELLS / cells)
        .max(1);
    // Zeros, which the threads that fill them in come upon first: the system hands them out as they are touched.
    let grids = (0..grids).map(|_| (vec![0; cells], state(), vec![]));
    let mut grids: Vec<_> = grids.collect();
    share_jobs(&mut grids, jobs, |(grid, state, made), job| {
        made.push(work(grid, state, job));
    });
    let (mut first, _, mut made) = grids.swap_remove(0);
    for (other, _, made_there) in grids {
        made.extend(made_there);
        let pairs = first.par_iter_mut().zip(&other).with_min_len(1 << 14);
        pairs
            .filter(|(_, b)| **b != 0)
            .for_each(|(a, &b)| *a = both(*a, b));
    }
    (first, made)
}
