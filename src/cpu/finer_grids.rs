//! The finer grids of crowds: of the triangles of their cells alone, in a view of these cells.

use super::crowds::{Cells, Crowd};
use super::extents::Extent;
use super::light_grid::{CELL, LightGrid, fitted};
use super::view::{Place, View};
use crate::scene::Scene;
use rayon::prelude::*;

/// Of how many triangles one is in a finer grid, where the places of its own vertices alone are worth a list of them.
const FEW: usize = 4;

/// Makes the grids that were wanted, or all, and those in them; whether there were any to make. Two frames may make the same
/// one: a thread that waits for the other could not help it.
pub fn make_finer(grid: &LightGrid, scene: &Scene, is_all: bool) -> bool {
    let make = |crowd: &Crowd<LightGrid>| {
        let is_missing = crowd.grid().is_none() && (is_all || crowd.is_wanted());
        if is_missing {
            // Whoever was first made the same.
            crowd.keep(finer(grid, &crowd.cells, scene));
        }
        let finer = crowd.grid();
        is_missing | finer.is_some_and(|finer| make_finer(finer, scene, is_all))
    };
    let crowds = grid.crowds.all.par_iter().map(make);
    crowds.reduce(|| false, |a, b| a | b)
}

fn finer(grid: &LightGrid, cells: &Cells, scene: &Scene) -> LightGrid {
    let Cells { columns, rows } = cells;
    let unit = |cell: usize| (cell * CELL) as f32;
    let extent = Extent {
        low: [unit(columns.start), unit(rows.start), 0.0],
        high: [unit(columns.end), unit(rows.end), 0.0],
    };
    let view = fitted(&grid.view, &extent);
    let triangles = triangles(grid, cells, scene);
    let places = match triangles.len() < scene.triangles().len() / FEW {
        true => places_of(&view, scene, &triangles),
        false => view.places(scene),
    };
    LightGrid::among(view, (scene, Some(&triangles)), places, grid.depth + 1)
}

/// Those in its cells, each once, in the scene's order.
fn triangles(grid: &LightGrid, cells: &Cells, scene: &Scene) -> Vec<u32> {
    let mut is_in = Marks::new(scene.triangles().len());
    for row in cells.rows.clone() {
        for column in cells.columns.clone() {
            grid.cell(column, row)
                .ids()
                .for_each(|id| is_in.mark(id as usize));
        }
    }
    is_in.marked().collect()
}

/// The places of the vertices of some triangles; those of others are not touched, nor is the memory for them.
fn places_of(view: &View, scene: &Scene, triangles: &[u32]) -> Vec<Place> {
    const WORDS: usize = 64;
    let vertices = scene.vertices();
    let mut is_needed = Marks::new(vertices.len());
    for &id in triangles {
        for vertex in scene.triangles()[id as usize] {
            is_needed.mark(vertex as usize);
        }
    }
    let mut places = vec![[0.0; 4]; vertices.len()];
    let chunks = places.par_chunks_mut(64 * WORDS).enumerate();
    chunks.for_each(|(chunk, places)| {
        let words = is_needed.words()[chunk * WORDS..].iter().take(WORDS);
        for (i, &word) in words.enumerate() {
            for place in bits64(word).map(|bit| 64 * i + bit) {
                places[place] = view.place(vertices[chunk * WORDS * 64 + place]);
            }
        }
    });
    places
}

/// A bit for each of so many things.
struct Marks(Vec<u64>);

impl Marks {
    fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    fn mark(&mut self, i: usize) {
        self.0[i / 64] |= 1 << (i % 64);
    }

    /// The words with 64 marks each.
    fn words(&self) -> &[u64] {
        &self.0
    }

    fn marked(&self) -> impl Iterator<Item = u32> {
        let words = self.0.iter().enumerate();
        words.flat_map(|(i, &word)| bits64(word).map(move |bit| (64 * i + bit) as u32))
    }
}

/// The places of the bits that are set.
fn bits64(mut word: u64) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let bit = (word != 0).then(|| word.trailing_zeros() as usize)?;
        word &= word - 1;
        Some(bit)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_found_in_their_order() {
        let mut marks = Marks::new(200);
        let numbers = [199, 3, 64, 63, 128, 3];
        numbers.iter().for_each(|&i| marks.mark(i));
        assert_eq!(marks.marked().collect::<Vec<_>>(), [3, 63, 64, 128, 199]);
    }
}
