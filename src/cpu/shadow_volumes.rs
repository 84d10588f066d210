//! Shadow volumes: each receiver is in as many volumes as the eye is, and as a line of sight enters on its way to it, less
//! those that it leaves.
//!
//! What it enters and leaves are the sides of the volumes, of the edges where triangles, each turned to the light, do not
//! cancel; nothing seen hides the triangle that a volume begins with, but for those before the near plane. A side is a
//! triangle whose third corner lies opposite to the light, and nothing is clipped, so the count from the eye (z-pass) is as
//! sound as the count from infinity, which draws every triangle twice more (Hornus, Hoberock, Lefebvre and Hart, "ZP+:
//! correct Z-pass stencil shadows", I3D 2005).
//!
//! The image is halved again and again. A side that passes by a part of it, or lies behind all receivers there, is left out
//! of it; one that is before all of them is counted for the whole part (Aila and Akenine-Moeller, "A hierarchical shadow
//! volume algorithm", Graphics Hardware 2004). In blocks of 8 x 8 pixels eight are tested at once, and what float32 leaves
//! open is decided in float64.

use super::bins::eights;
use super::extents::Extent;
use super::lanes::{
    EPSILON, LANES, Simd, bits, columns, dispatch, each_row, f32x8, least, level, mask_bits,
    mask32x8, numbers, splat,
};
use super::rasterize::Image;
use super::receivers::{BlockPlaces, Receivers, ViewFromEye};
use super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS, cut};
use super::view::View;
use super::volume_faces::{Face, FaceRows, VolumeView};
use crate::edges::{Edge, Edges};
use crate::lanes::Each;
use crate::scene::Scene;
use crate::sides::{Source, sides_of_triangles};
use fearless_simd::prelude::*;
use glam::DVec2;
use rayon::prelude::*;

/// Of a nearness, what lanes may round it by, and its product with a weight.
const NEARNESS_SHARE: f32 = 8.0 * EPSILON;

/// Triangles of which it is asked at once whether the eye is behind them.
const MANY: usize = 1024;

/// 1 lit, 0 in shadow, NaN where nothing is seen, row by row; and how many sides there are.
pub fn shadow_volumes(receivers: &Receivers, edges: &Edges) -> (Vec<f32>, u64) {
    let (scene, image) = (receivers.scene, receivers.image);
    let view = VolumeView::new(receivers.camera, Source::of(receivers.light));
    let light_sides = sides_of_triangles(scene, receivers.light);
    let sides = sides(&view, scene, edges, &light_sides);
    let side_count = sides.len() as u64;
    let (mut faces, at_eye) = seen_from_eye(&view, scene, &light_sides);
    faces.extend(sides.into_iter().flatten());
    let counting = Counting {
        receivers,
        view: &view.view,
        rows: faces.par_iter().map(|face| face.rows(&view)).collect(),
        faces,
        depths: Depths::new(receivers, &view.view),
    };
    let mut visibility = vec![0.0; image.tiling.width * image.tiling.height];
    let tiles = cut(&mut visibility, image.tiling);
    let tiles = tiles.into_par_iter().zip(counting.tiles(at_eye));
    tiles.enumerate().for_each(|(tile, (mut rows, part))| {
        let mut lit = [0.0; TILE_PIXELS];
        dispatch!(level(), simd => {
            if let Some(part) = part {
                counting.answer(simd, part, &mut lit);
            }
            write(simd, image, tile, &lit, &mut rows);
        });
    });
    (visibility, side_count)
}

/// Of the edges where triangles do not cancel, the sides; `None` where one has no area.
fn sides(view: &VolumeView, scene: &Scene, edges: &Edges, sides: &[i8]) -> Vec<Option<Face>> {
    let volumes = |edge: &Edge| -> i32 {
        let uses = &edges.uses[edge.first_use as usize..][..edge.use_count as usize];
        let side = |of: &u32| {
            let side = i32::from(sides[*of as usize >> 1]);
            if of & 1 == 1 { -side } else { side }
        };
        uses.iter().map(side).sum()
    };
    let edges = edges.edges.par_iter().with_min_len(MANY);
    let found = edges.filter_map(|edge| {
        let volumes = volumes(edge);
        let [from, to] = edge
            .vertices
            .map(|vertex| scene.vertices()[vertex as usize]);
        (volumes != 0).then(|| view.side(from, to, volumes))
    });
    found.collect()
}

/// The triangles before the near plane, and how many volumes the eye is in.
fn seen_from_eye(view: &VolumeView, scene: &Scene, sides: &[i8]) -> (Vec<Face>, i32) {
    let triangles = 0..scene.triangles().len() as u32;
    let casters = triangles.into_par_iter().with_min_len(MANY);
    let casters = casters.filter(|&triangle| sides[triangle as usize] != 0);
    let of_triangle = |triangle: u32| (scene.corners(triangle), sides[triangle as usize]);
    let caps = casters.clone().filter_map(|triangle| {
        let (corners, side) = of_triangle(triangle);
        view.cap(corners, side)
    });
    let holds_eye = |&triangle: &u32| {
        let (corners, side) = of_triangle(triangle);
        view.holds_eye(corners, side)
    };
    (caps.collect(), casters.filter(holds_eye).count() as i32)
}

#[inline(always)]
fn write<S: Simd>(
    simd: S,
    image: &Image,
    tile: usize,
    lit: &[f32; TILE_PIXELS],
    rows: &mut [&mut [f32]],
) {
    for (x, y) in image.tiling.blocks(tile) {
        image.write(simd, rows, (x, y), |i| {
            let first = (y % TILE + i) * TILE + x % TILE;
            f32x8::from_slice(simd, &lit[first..first + BLOCK])
        });
    }
}

/// The receivers of a block of pixels.
#[derive(Clone, Copy)]
struct Block {
    nearness: [[f32; LANES]; BLOCK],
    asking: [u32; BLOCK],
}

/// Least and greatest nearness of receivers.
type Range = [f32; 2];

/// Receivers, and between which nearness they are in each part of the image.
struct Depths {
    blocks: Vec<Block>,
    /// Of blocks, of two by two of them, and so on: how many columns there are, and each part's range.
    levels: Vec<(usize, Vec<Range>)>,
}

impl Depths {
    const NONE: Range = [f32::INFINITY, f32::NEG_INFINITY];

    fn new(receivers: &Receivers, view: &View) -> Self {
        let tiling = receivers.image.tiling;
        let (columns, rows) = (tiling.width.div_ceil(BLOCK), tiling.height.div_ceil(BLOCK));
        let none = Block {
            nearness: [[0.0; LANES]; BLOCK],
            asking: [0; BLOCK],
        };
        let mut blocks = vec![none; columns * rows];
        let mut ranges = vec![Self::NONE; blocks.len()];
        let seen = ViewFromEye::new(view, receivers.eye);
        let of_rows = blocks.par_chunks_mut(columns);
        let of_rows = of_rows.zip(ranges.par_chunks_mut(columns)).enumerate();
        of_rows.for_each(|(by, (blocks, ranges))| {
            dispatch!(level(), simd => find_row(simd, receivers, &seen, by, blocks, ranges));
        });
        let mut levels = vec![(columns, ranges)];
        while levels.len() <= LEVELS_OF_TILE || levels[levels.len() - 1].1.len() > 1 {
            let (columns, below) = &levels[levels.len() - 1];
            levels.push(halved(*columns, below));
        }
        Self { blocks, levels }
    }

    /// That of a part; `None` where nothing asks.
    fn range(&self, level: usize, x: usize, y: usize) -> Option<Range> {
        let (columns, ranges) = &self.levels[level];
        let range = *ranges.get(y * columns + x).filter(|_| x < *columns)?;
        (range[0] <= range[1]).then_some(range)
    }
}

#[inline(always)]
fn find_row<S: Simd>(
    simd: S,
    receivers: &Receivers,
    seen: &ViewFromEye,
    by: usize,
    blocks: &mut [Block],
    ranges: &mut [Range],
) {
    let mut places = BlockPlaces::none(simd);
    receivers.each_block(
        simd,
        by * BLOCK,
        #[inline(always)]
        |x, block| {
            seen.places(simd, block, &block.facing, &mut places);
            let mut extent = Extent::EMPTY;
            extent.add(simd, &places, &block.facing);
            ranges[x / BLOCK] = [extent.low[2], extent.high[2]];
            let found = &mut blocks[x / BLOCK];
            found.asking = block.facing;
            for (row, nearness) in found.nearness.iter_mut().zip(&places.nearness) {
                *row = nearness.to_array();
            }
        },
    );
}

/// Two by two of them as one.
fn halved(columns: usize, ranges: &[Range]) -> (usize, Vec<Range>) {
    let (halved_columns, rows) = (columns.div_ceil(2), (ranges.len() / columns).div_ceil(2));
    let mut found = vec![Depths::NONE; halved_columns * rows];
    for (i, range) in ranges.iter().enumerate() {
        let (x, y) = (i % columns / 2, i / columns / 2);
        let [low, high] = &mut found[y * halved_columns + x];
        (*low, *high) = (low.min(range[0]), high.max(range[1]));
    }
    (halved_columns, found)
}

/// A square part of the image, and what is still to be counted there.
#[derive(Debug, Default)]
struct Part {
    /// Its side is that of a block, doubled so often; where it lies is counted in such sides.
    level: usize,
    place: [usize; 2],
    faces: Vec<u32>,
    /// Volumes that all of its receivers are in.
    count: i32,
}

/// The levels from a block to a tile.
const LEVELS_OF_TILE: usize = BLOCKS.ilog2() as usize;

struct Counting<'a> {
    receivers: &'a Receivers<'a>,
    view: &'a View,
    faces: Vec<Face>,
    rows: Vec<FaceRows>,
    depths: Depths,
}

impl Counting<'_> {
    /// The tiles' parts; `None` where nothing asks.
    fn tiles(&self, at_eye: i32) -> Vec<Option<Part>> {
        let tiling = self.receivers.image.tiling;
        let mut level = LEVELS_OF_TILE;
        while BLOCK << level < tiling.width.max(tiling.height) {
            level += 1;
        }
        let mut parts = vec![Part {
            level,
            place: [0; 2],
            faces: (0..self.faces.len() as u32).collect(),
            count: at_eye,
        }];
        while level > LEVELS_OF_TILE {
            let split = |part: Part| {
                let mut parts = Vec::new();
                dispatch!(super::lanes::level(), simd => self.split(simd, &part, &mut parts));
                parts
            };
            parts = parts.into_par_iter().flat_map_iter(split).collect();
            level -= 1;
        }
        let mut tiles: Vec<_> = (0..tiling.tiles()).map(|_| None).collect();
        for part in parts {
            let [x, y] = part.place;
            tiles[y * tiling.columns + x] = Some(part);
        }
        tiles
    }

    /// Quarters a part.
    #[inline(always)]
    fn split<S: Simd>(&self, simd: S, part: &Part, found: &mut Vec<Part>) {
        let level = part.level - 1;
        let place = |i: usize| [2 * part.place[0] + i % 2, 2 * part.place[1] + i / 2];
        let size = (BLOCK << level) as f64;
        let middle = self.middle_of_image();
        // The middles of the first and of the last pixel.
        let sides = |k: usize| {
            [0, 1].map(|half| {
                let first = (2 * part.place[k] + half) as f64 * size + 0.5 - middle[k];
                [first as f32, (first + size - 1.0) as f32]
            })
        };
        let (columns_of, rows_of) = (sides(0), sides(1));
        let mut quarters: [Option<(Range, Part)>; 4] = [0, 1, 2, 3].map(|i| {
            let [x, y] = place(i);
            let range = self.depths.range(level, x, y)?;
            let part = Part {
                level,
                place: [x, y],
                faces: Vec::new(),
                count: part.count,
            };
            Some((range, part))
        });
        for (places, count) in eights(0..part.faces.len()) {
            let ids = places.map(|place| part.faces[place]);
            let lanes = FaceLanes::new(simd, ids.map(|id| &self.rows[id as usize]));
            let [left, right] = columns_of;
            let along_x = [lanes.ranges(simd, left, 0), lanes.ranges(simd, right, 0)];
            let [top, bottom] = rows_of;
            let along_y = [lanes.ranges(simd, top, 1), lanes.ranges(simd, bottom, 1)];
            for (i, quarter) in quarters.iter_mut().enumerate() {
                let Some((range, part)) = quarter else {
                    continue;
                };
                let (open, passed) = lanes.part(simd, &along_x[i % 2], &along_y[i / 2], *range);
                let there = (1 << count) - 1;
                for lane in bits(passed & there) {
                    part.count += self.faces[ids[lane] as usize].entered;
                }
                part.faces.extend(bits(open & there).map(|lane| ids[lane]));
            }
        }
        found.extend(quarters.into_iter().flatten().map(|(_, part)| part));
    }

    /// Finds which receivers of a part are in no volume.
    fn answer<S: Simd>(&self, simd: S, part: Part, lit: &mut [f32; TILE_PIXELS]) {
        let mut parts = vec![part];
        while let Some(part) = parts.pop() {
            simd.vectorize(
                #[inline(always)]
                || match part.level {
                    0 => self.answer_block(simd, &part, lit),
                    _ => self.split(simd, &part, &mut parts),
                },
            );
        }
    }

    #[inline(always)]
    fn answer_block<S: Simd>(&self, simd: S, part: &Part, lit: &mut [f32; TILE_PIXELS]) {
        let [bx, by] = part.place;
        let block = &self.depths.blocks[by * self.depths.levels[0].0 + bx];
        let middle = self.middle_of_image();
        let (first_x, first_y) = (bx * BLOCK, by * BLOCK);
        let x = numbers(simd) + (first_x as f64 + 0.5 - middle.x) as f32;
        let y = (first_y as f64 + 0.5 - middle.y) as f32;
        let mut counts = [splat(simd, part.count as f32); BLOCK];
        for &id in &part.faces {
            let [p, q, r, [weight, entered, ..]] = self.rows[id as usize];
            let at = |[a, b, c]: [f32; 3]| x.mul_add(splat(simd, a), splat(simd, b.mul_add(y, c)));
            let functions = [p, q, r].each(|[a, b, c, _]| (at([a, b, c]), b));
            let plane = (at([p[3], q[3], r[3]]), q[3]);
            for (i, count) in counts.iter_mut().enumerate() {
                let down = i as f32;
                let inside = least(functions.each(|(first, step)| first + step * down));
                let nearness = f32x8::simd_from(simd, block.nearness[i]) * weight;
                let ahead = plane.0 + plane.1 * down - nearness;
                let room = nearness.mul_add(splat(simd, NEARNESS_SHARE), splat(simd, 1.0));
                let passed = splat(simd, 1.0).simd_lt(inside) & room.simd_lt(ahead);
                let may = splat(simd, -1.0).simd_le(inside) & (-room).simd_le(ahead);
                *count += passed.select(splat(simd, entered), splat(simd, 0.0));
                let open = mask_bits(may & !passed) & block.asking[i];
                if open != 0 {
                    let place = (first_x, first_y + i);
                    self.decide(simd, id, place, open, count);
                }
            }
        }
        for (i, count) in counts.iter().enumerate() {
            let is_lit = mask_bits(count.simd_le(splat(simd, 0.0))) & block.asking[i];
            for lane in bits(is_lit) {
                lit[(first_y + i) % TILE * TILE + first_x % TILE + lane] = 1.0;
            }
        }
    }

    /// Counts a face in pixels of a row, from a column on, that float32 leaves open.
    #[inline(never)]
    fn decide<S: Simd>(
        &self,
        simd: S,
        id: u32,
        (x, y): (usize, usize),
        open: u32,
        count: &mut f32x8<S>,
    ) {
        let face = &self.faces[id as usize];
        let scene = self.receivers.scene;
        for lane in bits(open) {
            let place = DVec2::new((x + lane) as f64, y as f64) + 0.5 - self.middle_of_image();
            let triangle = self.receivers.image.triangle_at(x + lane, y);
            let triangle = triangle.expect("a receiver");
            if face.is_passed(place, self.view.nearness_of_plane(scene, place, triangle)) {
                let here = mask32x8::from_bitmask(simd, 1 << lane);
                *count += here.select(splat(simd, face.entered as f32), splat(simd, 0.0));
            }
        }
    }

    fn middle_of_image(&self) -> DVec2 {
        let tiling = self.receivers.image.tiling;
        0.5 * DVec2::new(tiling.width as f64, tiling.height as f64)
    }
}

/// Eight faces.
struct FaceLanes<S: Simd> {
    /// Of three edges, then of the plane: column, row, 1.
    functions: [[f32x8<S>; 3]; 4],
    weight: f32x8<S>,
}

/// Of each function, the least and the greatest of what one coordinate adds.
type Ranges<S> = [[f32x8<S>; 2]; 4];

impl<S: Simd> FaceLanes<S> {
    #[inline(always)]
    fn new(simd: S, rows: [&FaceRows; LANES]) -> Self {
        let row = |i: usize| rows.map(|rows| rows[i]);
        let a = columns(simd, each_row(&row(0)));
        let b = columns(simd, each_row(&row(1)));
        let c = columns(simd, each_row(&row(2)));
        let last = columns(simd, each_row(&row(3)));
        let edge = |[x, y, one, _]: [f32x8<S>; 4]| [x, y, one];
        Self {
            functions: [edge(a), edge(b), edge(c), [a[3], b[3], c[3]]],
            weight: last[0],
        }
    }

    #[inline(always)]
    fn ranges(&self, simd: S, [low, high]: [f32; 2], k: usize) -> Ranges<S> {
        let mut ranges = [[splat(simd, 0.0); 2]; 4];
        for (range, function) in ranges.iter_mut().zip(&self.functions) {
            let (a, b) = (function[k] * low, function[k] * high);
            *range = [a.min(b), a.max(b)];
        }
        ranges
    }

    /// Which of them some receivers of a part may pass, and others may not; and which all of them pass.
    #[inline(always)]
    fn part(&self, simd: S, x: &Ranges<S>, y: &Ranges<S>, [far, near]: Range) -> (u32, u32) {
        let reach = |i: usize, k: usize| x[i][k] + y[i][k] + self.functions[i][2];
        let (fewest, most) = (
            least([reach(0, 0), reach(1, 0), reach(2, 0)]),
            least([reach(0, 1), reach(1, 1), reach(2, 1)]),
        );
        // Half a unit of what is sure is for the rounding here.
        let nearest = self.weight * near;
        let room = nearest.mul_add(splat(simd, NEARNESS_SHARE), splat(simd, 1.5));
        let ahead = reach(3, 0) - nearest;
        let farthest_ahead = reach(3, 1) - self.weight * far;
        let may = splat(simd, -1.5).simd_le(most) & (-room).simd_le(farthest_ahead);
        let passed = splat(simd, 1.5).simd_lt(fewest) & room.simd_lt(ahead);
        (mask_bits(may & !passed), mask_bits(passed))
    }
}
