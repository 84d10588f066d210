//! Warps as tables: of each texel of the warped map, where its ray is before the warp.
//!
//! Between four neighbours a table is linear in two triangles, so that both directions are exact and each other's inverse.
//! A ring around it, one step wide, goes on as its border does: the border's texels are as wide as the others.

use super::tables::Table;
use crate::lanes::{Lane, V2};
use crate::map_size::MapSize;
use glam::{DMat2, DVec2};
use rayon::prelude::*;

/// Of a cell: what float64 may round off a place on the edge between two.
const TOLERANCE: f64 = 1e-9;

/// Cells that a search goes through before it asks the boxes.
const MOST_STEPS: usize = 6;

/// Cells along each side of the smallest boxes.
const LEAF: usize = 2;

/// Squares along each side of the plane of which each knows a cell near it.
const SQUARES: usize = 64;

/// A cell of a table, and a place in it, from 0 to 1.
type InCell = ([usize; 2], DVec2);

/// A table of samples over the texels of a map.
pub struct SampledWarp {
    pub given: Table,
    /// The same with the ring.
    table: Table,
    /// 1, or -1 of a table that is a mirror image.
    turn: f64,
    /// Boxes around 2 x 2 cells each, then around 2 x 2 of these, and so on: the last is around everything.
    boxes: Vec<Boxes>,
    /// Of each square of the plane the cell of its middle, if there is one.
    nearby: Vec<Option<[usize; 2]>>,
    size: MapSize,
    /// Where the rays of the texels are, row by row.
    x: Vec<f32>,
    y: Vec<f32>,
}

/// Least and greatest places in blocks of cells.
struct Boxes {
    columns: usize,
    sides: Vec<[DVec2; 2]>,
}

impl SampledWarp {
    pub fn new(given: &Table, size: MapSize) -> Self {
        let table = given.with_ring();
        let mut warp = Self {
            turn: given.turn(),
            given: given.clone(),
            boxes: boxes_of(&table),
            table,
            nearby: vec![],
            size,
            x: vec![],
            y: vec![],
        };
        let squares = (0..SQUARES * SQUARES).into_par_iter().map(|i| {
            let square = DVec2::new((i % SQUARES) as f64, (i / SQUARES) as f64);
            let found = warp.search((square + 0.5) / SQUARES as f64);
            found.map(|(cell, _)| cell)
        });
        warp.nearby = squares.collect();
        let places = (0..size.height).into_par_iter().flat_map_iter(|row| {
            let warp = &warp;
            (0..size.width).map(move |column| {
                let texel = DVec2::new(column.into(), row.into()) + 0.5;
                let place = warp.linear_from_warped(texel / size.texels());
                (place.x as f32, place.y as f32)
            })
        });
        (warp.x, warp.y) = places.unzip();
        warp
    }

    /// Samples along each side, without the ring.
    fn samples(&self) -> DVec2 {
        DVec2::new(self.table.columns as f64, self.table.rows as f64) - 2.0
    }

    /// Where the ray of a place of the warped map is before the warp, both from 0 to 1.
    pub fn linear_from_warped(&self, warped: DVec2) -> DVec2 {
        let sample = warped * self.samples() + 0.5;
        let last = self.samples();
        let cell = sample.floor().clamp(DVec2::ZERO, last);
        let part = sample - cell;
        let [a, b, c, d] = self.corners([cell.x as usize, cell.y as usize]);
        match part.x + part.y <= 1.0 {
            true => a + (b - a) * part.x + (c - a) * part.y,
            false => d + (c - d) * (1.0 - part.x) + (b - d) * (1.0 - part.y),
        }
    }

    /// Linear map coordinates of the centre of a texel.
    #[inline(always)]
    pub fn linear_from_texel<L: Lane>(&self, texel: V2<L>) -> V2<L> {
        let of = |table| L::gather(table, self.size.width as usize, texel.y, texel.x);
        V2::new(of(&self.x), of(&self.y))
    }

    /// Where places before the warp are after it, and the cells of the table that they are in: the asked ones of a row,
    /// side by side. `None` beside the table.
    #[inline(never)]
    pub fn warped_from_linear<const N: usize>(
        &self,
        [x, y]: [[f32; N]; 2],
        asked: u32,
    ) -> [Option<([f32; 2], [usize; 2])>; N] {
        let mut found = [None; N];
        let mut cell = None;
        for lane in (0..N).filter(|lane| asked >> lane & 1 != 0) {
            let place = DVec2::new(x[lane].into(), y[lane].into());
            // Neighbours are likely to be in cells side by side.
            found[lane] = self.find(place, cell).map(|(there, part)| {
                cell = Some(there);
                let warped = self.warped(there, part).as_vec2().to_array();
                (warped, there)
            });
        }
        found
    }

    /// Where a place before the warp is after it, both from 0 to 1.
    pub fn warped_place(&self, place: DVec2) -> Option<DVec2> {
        let (cell, part) = self.find(place, None)?;
        Some(self.warped(cell, part))
    }

    /// How much further a function of places goes from one texel to the next, along each axis, whose gradient before the
    /// warp is given.
    pub fn gradient_after(&self, cell: [usize; 2], gradient: DVec2) -> DVec2 {
        self.steps_in(cell).transpose() * gradient
    }

    /// The steps from a texel to the next before the warp, along rows and columns, in texels; `None` beside the table.
    pub fn steps(&self, place: DVec2) -> Option<DMat2> {
        let (cell, _) = self.find(place, None)?;
        Some(self.steps_in(cell))
    }

    fn steps_in(&self, cell: [usize; 2]) -> DMat2 {
        let [a, b, c, d] = self.corners(cell);
        let samples = self.samples();
        let across = |from: DVec2, to: DVec2, samples: f64| 0.5 * (to - from) * samples;
        let [x, y] = [
            across(a + c, b + d, samples.x),
            across(a + b, c + d, samples.y),
        ];
        // Shares of the sides, which may have different numbers of texels.
        let aspect = self.size.aspect();
        DMat2::from_cols(DVec2::new(x.x, x.y / aspect), DVec2::new(y.x * aspect, y.y))
    }

    /// How much the warp widens along its rows and columns where it widens most.
    pub fn greatest_scale(&self) -> DVec2 {
        let [last_column, last_row] = self.last_cell();
        let rows = 1..last_row;
        let shortest = rows.into_par_iter().map(|row| {
            let lengths = (1..last_column).map(|column| {
                let DMat2 { x_axis, y_axis } = self.steps_in([column, row]);
                DVec2::new(x_axis.length(), y_axis.length())
            });
            lengths.fold(DVec2::INFINITY, DVec2::min)
        });
        shortest.reduce(|| DVec2::INFINITY, DVec2::min).recip()
    }

    /// The cell at the far end of the ring.
    fn last_cell(&self) -> [usize; 2] {
        [self.table.columns - 2, self.table.rows - 2]
    }

    fn corners(&self, [column, row]: [usize; 2]) -> [DVec2; 4] {
        let [a, b] = [0, 1].map(|i| self.table.at(column + i, row));
        let [c, d] = [0, 1].map(|i| self.table.at(column + i, row + 1));
        [a, b, c, d]
    }

    fn is_in_ring(&self, [column, row]: [usize; 2]) -> bool {
        let [last_column, last_row] = self.last_cell();
        column == 0 || row == 0 || column == last_column || row == last_row
    }

    /// Where a place is after the warp.
    fn warped(&self, [column, row]: [usize; 2], part: DVec2) -> DVec2 {
        (DVec2::new(column as f64, row as f64) + part - 0.5) / self.samples()
    }

    /// A place as a cell sees it, from 0 to 1 inside; not numbers in a part of the ring that is folded.
    fn part(&self, cell: [usize; 2], place: DVec2) -> DVec2 {
        let [a, b, c, d] = self.corners(cell);
        let near = self.coordinates([b - a, c - a], place - a);
        match near.x + near.y <= 1.0 {
            true => near,
            false => 1.0 - self.coordinates([c - d, b - d], place - d),
        }
    }

    fn coordinates(&self, [x, y]: [DVec2; 2], from_corner: DVec2) -> DVec2 {
        let area = x.perp_dot(y);
        match area * self.turn > 0.0 {
            true => DVec2::new(from_corner.perp_dot(y), x.perp_dot(from_corner)) / area,
            false => DVec2::NAN,
        }
    }

    /// The cell of a place, which may be near another one.
    fn find(&self, place: DVec2, near: Option<[usize; 2]>) -> Option<InCell> {
        let square =
            (place * SQUARES as f64).clamp(DVec2::ZERO, DVec2::splat(SQUARES as f64 - 1.0));
        let nearby = self.nearby[square.y as usize * SQUARES + square.x as usize];
        let mut starts = [near, nearby].into_iter().flatten();
        let walked = starts.find_map(|cell| self.walk(cell, place));
        walked.or_else(|| self.search(place))
    }

    /// From cell to cell to the one of a place; `None` where that leads nowhere, or into the ring.
    fn walk(&self, mut cell: [usize; 2], place: DVec2) -> Option<InCell> {
        for _ in 0..MOST_STEPS {
            if self.is_in_ring(cell) {
                return None;
            }
            let part = self.part(cell, place);
            if is_inside(part) {
                return Some((cell, part));
            }
            let last = self.last_cell();
            let next = |axis: usize| {
                let there = cell[axis] as f64 + part[axis].floor();
                there.clamp(0.0, last[axis] as f64) as usize
            };
            let next = [next(0), next(1)];
            if next == cell {
                return None;
            }
            cell = next;
        }
        None
    }

    /// The cell of a place, by the boxes around cells. One of the ring is taken where there is no other.
    fn search(&self, place: DVec2) -> Option<InCell> {
        let mut in_ring = None;
        let found = self.search_block((self.boxes.len() - 1, [0, 0]), place, &mut in_ring);
        found.or(in_ring)
    }

    fn search_block(
        &self,
        (level, block): (usize, [usize; 2]),
        place: DVec2,
        in_ring: &mut Option<InCell>,
    ) -> Option<InCell> {
        if !self.boxes[level].contains(block, place) {
            return None;
        }
        let below = level.checked_sub(1);
        let last = below.map_or(self.last_cell(), |level| self.boxes[level].last());
        children(block, last).find_map(|child| match below {
            Some(level) => self.search_block((level, child), place, in_ring),
            None => {
                let found = Some((child, self.part(child, place)));
                let found = found.filter(|(_, part)| is_inside(*part));
                match self.is_in_ring(child) {
                    true => {
                        *in_ring = in_ring.or(found);
                        None
                    }
                    false => found,
                }
            }
        })
    }
}

fn is_inside(part: DVec2) -> bool {
    let (low, high) = (DVec2::splat(-TOLERANCE), DVec2::splat(1.0 + TOLERANCE));
    low.cmple(part).all() && part.cmple(high).all()
}

/// What a block is of.
fn children([x, y]: [usize; 2], last: [usize; 2]) -> impl Iterator<Item = [usize; 2]> {
    let range = |first: usize, last: usize| LEAF * first..(LEAF * (first + 1)).min(last + 1);
    let columns = range(x, last[0]);
    range(y, last[1]).flat_map(move |y| columns.clone().map(move |x| [x, y]))
}

impl Boxes {
    fn contains(&self, [x, y]: [usize; 2], place: DVec2) -> bool {
        let [low, high] = self.sides[y * self.columns + x];
        low.cmple(place).all() && place.cmple(high).all()
    }

    fn last(&self) -> [usize; 2] {
        [self.columns - 1, self.sides.len() / self.columns - 1]
    }

    /// Of the blocks of what is given by its last column and row.
    fn around(last: [usize; 2], sides_of: impl Fn([usize; 2]) -> [DVec2; 2] + Sync) -> Self {
        let [columns, rows] = last.map(|last| last / LEAF + 1);
        let sides = (0..rows).into_par_iter().flat_map_iter(|y| {
            let sides_of = &sides_of;
            (0..columns).map(move |x| {
                let inside = children([x, y], last).map(sides_of);
                let nothing = [DVec2::INFINITY, DVec2::NEG_INFINITY];
                inside.fold(nothing, |a, b| [a[0].min(b[0]), a[1].max(b[1])])
            })
        });
        Self {
            columns,
            sides: sides.collect(),
        }
    }
}

fn boxes_of(table: &Table) -> Vec<Boxes> {
    // As much wider as a place in it may be rounded.
    let room = DVec2::splat(1e-12);
    let of_cell = |[column, row]: [usize; 2]| {
        let corners = [0, 1, 2, 3].map(|i| table.at(column + i % 2, row + i / 2));
        let end =
            |f: fn(DVec2, DVec2) -> DVec2| corners[1..].iter().fold(corners[0], |a, b| f(a, *b));
        [end(DVec2::min) - room, end(DVec2::max) + room]
    };
    let cells = [table.columns - 2, table.rows - 2];
    let mut boxes = vec![Boxes::around(cells, of_cell)];
    while let Some(below) = boxes.last().filter(|boxes| boxes.sides.len() > 1) {
        let of_block = |[x, y]: [usize; 2]| below.sides[y * below.columns + x];
        let above = Boxes::around(below.last(), of_block);
        boxes.push(above);
    }
    boxes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::Random;

    /// A plane that is turned around its middle, and stretched, in a table of so many rows.
    fn swirl(columns: usize, rows: usize, angle: f64) -> Table {
        let places = (0..rows * columns).flat_map(|i| {
            let sample = DVec2::new((i % columns) as f64, (i / columns) as f64) + 0.5;
            let from_middle = sample / DVec2::new(columns as f64, rows as f64) - 0.5;
            let fall = (1.0 - 4.0 * from_middle.length_squared()).max(0.0);
            let turned = DVec2::from_angle(angle * fall * fall).rotate(from_middle);
            (turned + 0.5).as_vec2().to_array()
        });
        Table {
            columns,
            rows,
            values: places.collect::<Vec<_>>().into(),
        }
    }

    #[test]
    fn both_directions_are_inverse() {
        let mut random = Random(7);
        for (columns, rows, angle) in [(2, 2, 0.0), (40, 31, 0.9), (65, 64, -1.4)] {
            let given = swirl(columns, rows, angle);
            assert_eq!(given.fault(), None);
            let warp = SampledWarp::new(&given, MapSize::square(16));
            let mut row = [[0.0; 8]; 2];
            for i in 0..800 {
                let place = DVec2::new(random.share(), random.share());
                let there = warp.warped_place(place).unwrap();
                let back = warp.linear_from_warped(there);
                assert!((back - place).length() < 1e-9, "{place} {there} {back}");
                (row[0][i % 8], row[1][i % 8]) = (place.x as f32, place.y as f32);
                if i % 8 < 7 {
                    continue;
                }
                // A row of places that lie anywhere, one of which is not asked for.
                let found = warp.warped_from_linear(row, 0b1110_1111);
                assert_eq!(found[4], None);
                for (k, found) in found.iter().enumerate().filter(|(k, _)| *k != 4) {
                    let place = DVec2::new(row[0][k].into(), row[1][k].into());
                    let (there, _) = found.unwrap();
                    let there = DVec2::from(there.map(f64::from));
                    assert!((there - warp.warped_place(place).unwrap()).length() < 1e-6);
                }
            }
        }
    }

    #[test]
    fn a_texel_has_the_ray_of_its_sample() {
        let size = MapSize {
            width: 24,
            height: 16,
        };
        let given = swirl(24, 16, 1.1);
        let warp = SampledWarp::new(&given, size);
        for (i, place) in given.values.as_chunks::<2>().0.iter().enumerate() {
            let texel = V2::new((i % 24) as f32, (i / 24) as f32);
            let ray = warp.linear_from_texel(texel);
            assert_eq!([ray.x, ray.y], *place);
            let centre = (DVec2::new(texel.x.into(), texel.y.into()) + 0.5) / size.texels();
            let there = warp.warped_place(DVec2::from(place.map(f64::from)));
            assert!((there.unwrap() - centre).length() < 1e-9);
        }
    }

    #[test]
    fn steps_are_those_between_texels() {
        let size = MapSize {
            width: 64,
            height: 24,
        };
        let warp = SampledWarp::new(&swirl(64, 64, 1.2), size);
        for place in [DVec2::new(0.31, 0.62), DVec2::new(0.5, 0.44)] {
            let there = warp.warped_place(place).unwrap();
            let steps = warp.steps(place).unwrap();
            for (axis, step) in [(DVec2::X, steps.x_axis), (DVec2::Y, steps.y_axis)] {
                let h = 0.5 * axis / size.texels();
                let [before, after] = [-h, h].map(|h| warp.linear_from_warped(there + h));
                let found = (after - before) * size.texels();
                assert!((found - step).length() < 0.05, "{found} {step}");
            }
        }
        assert!(warp.steps(DVec2::splat(1.5)).is_none());
    }

    #[test]
    fn beside_a_table_is_nothing() {
        // A turned square that leaves the corners of the plane.
        let small = |v: &f32| 0.5 + 0.4 * (v - 0.5);
        let plain = swirl(20, 20, 0.0);
        let turned = plain.values.as_chunks::<2>().0.iter().flat_map(|[x, y]| {
            let (x, y) = (small(x) - 0.5, small(y) - 0.5);
            [0.5 + x - y, 0.5 + x + y]
        });
        let table = Table {
            values: turned.collect::<Vec<_>>().into(),
            ..plain
        };
        assert_eq!(table.fault(), None);
        let warp = SampledWarp::new(&table, MapSize::square(20));
        assert!(warp.warped_place(DVec2::splat(0.5)).is_some());
        assert!(warp.warped_place(DVec2::new(0.5, 0.11)).is_some());
        assert!(warp.warped_place(DVec2::splat(0.05)).is_none());
        assert!(warp.warped_place(DVec2::NAN).is_none());
    }
}
