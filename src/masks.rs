//! Masked triangles: surfaces that are there only where an alpha image reaches a cutoff.
//!
//! Leaves, fences and chains are drawn on a few large triangles, and an image says where these have holes. It is sampled
//! at its base level, bilinearly or by the nearest texel, as for glTF's `alphaMode: MASK`: whether a ray is stopped follows
//! from the point that it meets, and from nothing else.

use crate::error::{Error, Result, ensure_value};
use glam::{DVec2, DVec3, Vec3Swizzles};

/// No mask, in place of the number of a masked triangle.
const OPAQUE: u32 = u32::MAX;

/// Texels of all alpha images of a scene together: eight images of 4096 x 4096. They are one binding on a device.
pub const MAX_TEXELS: usize = 1 << 27;

/// Texture coordinates beyond which float32 knows a texel no more.
const MAX_COORDINATE: f64 = 1e6;

/// The alpha of a texel that hides everything.
const FULL: f64 = 255.0;

/// How an image goes on beyond its sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wrap {
    Repeat,
    Mirror,
    Clamp,
}

impl Wrap {
    pub const NAMES: [(&str, Self); 3] = [
        ("repeat", Self::Repeat),
        ("mirror", Self::Mirror),
        ("clamp", Self::Clamp),
    ];

    /// The texel of a row of so many that stands at a whole number.
    pub fn texel(self, index: i64, count: u32) -> usize {
        let count = i64::from(count);
        let texel = match self {
            Self::Repeat => index.rem_euclid(count),
            Self::Mirror => {
                let within = index.rem_euclid(2 * count);
                within.min(2 * count - 1 - within)
            }
            Self::Clamp => index.clamp(0, count - 1),
        };
        texel as usize
    }
}

/// What lies between the middles of texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    Linear,
    Nearest,
}

impl Sampling {
    pub const NAMES: [(&str, Self); 2] = [("linear", Self::Linear), ("nearest", Self::Nearest)];
}

/// An alpha image, rows from v = 0, and from which alpha on a surface is there.
#[derive(Debug, Clone)]
pub struct AlphaImage {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<u8>,
    /// Along u and v.
    pub wraps: [Wrap; 2],
    pub sampling: Sampling,
    /// In units of a texel.
    pub cutoff: f64,
}

impl AlphaImage {
    /// The cutoff is a share of full alpha.
    pub fn new(
        (width, height): (usize, usize),
        texels: Vec<u8>,
        (wraps, sampling): ([Wrap; 2], Sampling),
        cutoff: f64,
    ) -> Result<Self> {
        ensure_value!(
            width > 0 && height > 0 && texels.len() <= MAX_TEXELS,
            "alpha images must have 1 to {MAX_TEXELS} texels, got {height} rows of {width}"
        );
        ensure_value!(
            cutoff.is_finite() && cutoff >= 0.0,
            "cutoff must be finite and at least 0, got {cutoff}"
        );
        Ok(Self {
            width: width as u32,
            height: height as u32,
            texels,
            wraps,
            sampling,
            cutoff: cutoff * FULL,
        })
    }

    /// Texels stand at whole numbers.
    fn alpha_at(&self, place: DVec2) -> f64 {
        let (first, share) = match self.sampling {
            Sampling::Linear => (place.floor(), place - place.floor()),
            Sampling::Nearest => ((place + 0.5).floor(), DVec2::ZERO),
        };
        let [along_u, along_v] = self.wraps;
        let (x, y) = (first.x as i64, first.y as i64);
        let columns = [x, x + 1].map(|x| along_u.texel(x, self.width));
        let of_row = |y: i64| {
            let row = along_v.texel(y, self.height) * self.width as usize;
            let [a, b] = columns.map(|column| f64::from(self.texels[row + column]));
            a + share.x * (b - a)
        };
        let (above, below) = (of_row(y), of_row(y + 1));
        above + share.y * (below - above)
    }

    /// Least and greatest alpha no farther from a place than a reach along each axis.
    fn range(&self, place: DVec2, reach: DVec2) -> [f64; 2] {
        if reach.max_element() > 0.5 {
            return [0.0, FULL];
        }
        // Between whole numbers it is bilinear, and so least and greatest at the corners of a box; the nearest texels
        // of a box are those of its corners.
        let of_axis = |place: f64, reach: f64| {
            let [low, high] = [place - reach, place + reach];
            [low, high.floor().max(low), high]
        };
        let columns = of_axis(place.x, reach.x);
        let rows = of_axis(place.y, reach.y);
        let none = [f64::INFINITY, f64::NEG_INFINITY];
        let places = columns.iter().flat_map(|&x| rows.map(|y| DVec2::new(x, y)));
        places
            .map(|place| self.alpha_at(place))
            .fold(none, |[low, high], a| [low.min(a), high.max(a)])
    }
}

/// Whether a masked triangle is there, where rounding may move the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solidity {
    Solid,
    Hole,
    /// Nobody can say; at the point itself it is.
    Open(bool),
}

/// What masks a triangle.
#[derive(Debug, Clone, Copy)]
pub struct Mask<'a> {
    pub image: &'a AlphaImage,
    /// Of each corner: column and row in the image, where texels stand at whole numbers, and a factor of alpha.
    pub corners: &'a [DVec3; 3],
}

impl Mask<'_> {
    /// Column, row and factor at a point, of which each corner has a share.
    fn at(&self, [a, b, c]: [f64; 3]) -> DVec3 {
        let [of_a, of_b, of_c] = *self.corners;
        (of_a * a + of_b * b + of_c * c) / (a + b + c)
    }

    /// Whether the surface is there.
    pub fn is_solid(&self, shares: [f64; 3]) -> bool {
        self.is_solid_at(self.at(shares))
    }

    /// The same by column, row and factor.
    pub fn is_solid_at(&self, at: DVec3) -> bool {
        self.image.alpha_at(at.xy()) * at.z >= self.image.cutoff
    }

    /// Whether it is where column, row and factor may be off by a reach.
    pub fn solidity(&self, shares: [f64; 3], reach: DVec3) -> Solidity {
        self.solidity_at(self.at(shares), reach)
    }

    /// The same by column, row and factor.
    pub fn solidity_at(&self, at: DVec3, reach: DVec3) -> Solidity {
        if !at.is_finite() || !reach.is_finite() {
            return Solidity::Open(false);
        }
        let cutoff = self.image.cutoff;
        let alpha = self.image.alpha_at(at.xy()) * at.z;
        // No alpha changes by more than all of it from one texel to the next.
        let slack = match self.image.sampling {
            Sampling::Linear => FULL * ((reach.x + reach.y) * at.z.abs() + reach.z),
            Sampling::Nearest => f64::INFINITY,
        };
        let is_solid = alpha >= cutoff;
        let [low, high] = match (alpha - cutoff).abs() > slack {
            true => [alpha, alpha],
            false => {
                let [low, high] = self.image.range(at.xy(), reach.xy());
                [low * (at.z - reach.z).max(0.0), high * (at.z + reach.z)]
            }
        };
        match (low >= cutoff, high < cutoff) {
            (true, _) => Solidity::Solid,
            (_, true) => Solidity::Hole,
            _ => Solidity::Open(is_solid),
        }
    }
}

/// One triangle of a scene that is masked.
#[derive(Debug, Clone)]
struct MaskedTriangle {
    image: u32,
    corners: [DVec3; 3],
}

/// The masked triangles of a scene.
#[derive(Debug, Clone)]
pub struct Masks {
    images: Vec<AlphaImage>,
    /// Of each triangle of the scene.
    numbers: Vec<u32>,
    masked: Vec<MaskedTriangle>,
}

impl Masks {
    /// `image_of_triangle` is negative where a triangle is opaque; `corners` has texture coordinates and a factor of alpha for
    /// the corners of the others, in their order. `None` where nothing has a hole.
    pub fn new(
        images: Vec<AlphaImage>,
        image_of_triangle: &[i32],
        corners: &[[DVec3; 3]],
    ) -> Result<Option<Self>> {
        let texels: usize = images.iter().map(|image| image.texels.len()).sum();
        ensure_value!(
            texels <= MAX_TEXELS,
            "alpha images must have at most {MAX_TEXELS} texels together, got {texels}"
        );
        let least: Vec<_> = images
            .iter()
            .map(|image| image.texels.iter().min().copied().unwrap_or(0))
            .collect();
        let mut masks = Self {
            numbers: vec![OPAQUE; image_of_triangle.len()],
            masked: Vec::new(),
            images,
        };
        let of_masked = image_of_triangle.iter().enumerate();
        let of_masked = of_masked.filter(|(_, image)| **image >= 0);
        let count = of_masked.clone().count();
        ensure_value!(
            corners.len() == count,
            "uv must have one row for each of {count} masked triangles, got {}",
            corners.len()
        );
        for ((triangle, &number), corners) in of_masked.zip(corners) {
            let known = masks.images.len();
            let Some(image) = masks.images.get(number as usize) else {
                return Err(Error::Value(format!(
                    "face_alpha must index one of {known} alpha images: face {triangle} has {number}"
                )));
            };
            let is_known =
                |corner: &DVec3| corner.is_finite() && corner.abs().max_element() < MAX_COORDINATE;
            ensure_value!(
                corners.iter().all(is_known),
                "uv must be finite and smaller than {MAX_COORDINATE:e}: face {triangle} has {:?}",
                corners.map(|corner| corner.xy().to_array())
            );
            let factor = corners
                .iter()
                .fold(f64::INFINITY, |least, c| least.min(c.z));
            if f64::from(least[number as usize]) * factor >= image.cutoff {
                continue;
            }
            let size = DVec3::new(f64::from(image.width), f64::from(image.height), 1.0);
            let to_middle = DVec3::new(0.5, 0.5, 0.0);
            masks.numbers[triangle] = masks.masked.len() as u32;
            masks.masked.push(MaskedTriangle {
                image: number as u32,
                corners: corners.map(|corner| corner * size - to_middle),
            });
        }
        Ok((!masks.masked.is_empty()).then_some(masks))
    }

    pub fn images(&self) -> &[AlphaImage] {
        &self.images
    }

    /// Each triangle's number among the masked ones.
    pub fn numbers(&self) -> impl Iterator<Item = Option<usize>> {
        let numbers = self.numbers.iter();
        numbers.map(|&number| (number != OPAQUE).then_some(number as usize))
    }

    /// The masked ones in the order of their numbers, each with the number of its image.
    pub fn masked(&self) -> impl Iterator<Item = (usize, Mask<'_>)> {
        let masked = self.masked.iter();
        masked.map(|masked| (masked.image as usize, self.mask_of(masked)))
    }

    pub fn triangle_count(&self) -> usize {
        self.numbers.len()
    }

    /// How many have holes.
    pub fn masked_count(&self) -> usize {
        self.masked.len()
    }

    /// What masks a triangle, if anything.
    #[inline]
    pub fn of_triangle(&self, triangle: u32) -> Option<Mask<'_>> {
        let number = self.numbers[triangle as usize];
        Some(self.mask_of(self.masked.get(number as usize)?))
    }

    #[inline]
    fn mask_of<'a>(&'a self, masked: &'a MaskedTriangle) -> Mask<'a> {
        Mask {
            image: &self.images[masked.image as usize],
            corners: &masked.corners,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::Random;

    const REPEATED: ([Wrap; 2], Sampling) = ([Wrap::Repeat; 2], Sampling::Linear);

    fn image(random: &mut Random, cutoff: f64) -> AlphaImage {
        let (width, height) = (1 + random.below(5), 1 + random.below(5));
        // Few levels, so that neighbours are often the same and some are the cutoff itself.
        let texels = (0..width * height).map(|_| [0, 51, 102, 255][random.below(4)]);
        let texels = texels.collect();
        let mut wrap = || Wrap::NAMES[random.below(3)].1;
        let wraps = [wrap(), wrap()];
        let sampling = Sampling::NAMES[random.below(2)].1;
        AlphaImage::new((width, height), texels, (wraps, sampling), cutoff).unwrap()
    }

    #[test]
    fn a_row_goes_on_as_it_is_told() {
        let row = |wrap: Wrap| (-4..7).map(|i| wrap.texel(i, 3)).collect::<Vec<_>>();
        assert_eq!(row(Wrap::Repeat), [2, 0, 1, 2, 0, 1, 2, 0, 1, 2, 0]);
        assert_eq!(row(Wrap::Mirror), [2, 2, 1, 0, 0, 1, 2, 2, 1, 0, 0]);
        assert_eq!(row(Wrap::Clamp), [0, 0, 0, 0, 0, 1, 2, 2, 2, 2, 2]);
    }

    #[test]
    fn what_is_sure_is_so_at_every_point_within_reach() {
        let mut random = Random(3);
        let mut counts = [0; 3];
        for _ in 0..4000 {
            let cutoff = [0.0, 0.2, 0.3, 0.4, 1.0, 1.5][random.below(6)];
            let image = image(&mut random, cutoff);
            let mut place = || {
                let [x, y, factor] = [6.0, 6.0, 1.5].map(|most| most * random.share());
                DVec3::new(x - 2.0, y - 2.0, factor)
            };
            let corners = [place(), place(), place()];
            let mask = Mask {
                image: &image,
                corners: &corners,
            };
            let share = random.share();
            let shares = [share, (1.0 - share) * random.share(), 0.0];
            let shares = [shares[0], shares[1], 1.0 - shares[0] - shares[1]];
            let mut reach = || [0.0, 1e-9, 0.01, 0.2, 0.8][random.below(5)];
            let reach = DVec3::new(reach(), reach(), 0.2 * reach());
            let solidity = mask.solidity(shares, reach);
            let off = |random: &mut Random| 1.9999 * (random.share() - 0.5);
            let solid_count = (0..50).filter(|_| {
                let step = DVec3::new(off(&mut random), off(&mut random), off(&mut random));
                let at = mask.at(shares) + step * reach;
                // No factor is negative.
                mask.is_solid_at(at.xy().extend(at.z.max(0.0)))
            });
            let solid_count = solid_count.count();
            let kind = match solidity {
                Solidity::Solid => usize::from(solid_count != 50) * 3,
                Solidity::Hole => 1 + usize::from(solid_count != 0) * 3,
                Solidity::Open(is_solid) => 2 + usize::from(is_solid != mask.is_solid(shares)) * 3,
            };
            assert!(
                kind < 3,
                "{solidity:?} {solid_count} {reach} {image:?} {corners:?}"
            );
            counts[kind] += 1;
        }
        assert!(counts.iter().all(|&count| count > 300), "{counts:?}");
    }

    #[test]
    fn a_wide_flat_part_at_the_cutoff_is_sure() {
        let image = AlphaImage::new((2, 2), vec![102; 4], REPEATED, 102.0 / 255.0);
        let image = image.unwrap();
        let corners = [
            DVec3::Z,
            DVec3::new(1.0, 0.0, 1.0),
            DVec3::new(0.0, 1.0, 1.0),
        ];
        let mask = Mask {
            image: &image,
            corners: &corners,
        };
        let reach = DVec3::new(0.1, 0.1, 0.0);
        assert_eq!(mask.solidity([0.2, 0.3, 0.5], reach), Solidity::Solid);
    }

    #[test]
    fn images_without_a_hole_mask_nothing() {
        let whole = AlphaImage::new((1, 2), vec![128, 255], REPEATED, 0.5).unwrap();
        let corners = [[DVec3::Z; 3]; 2];
        let masks = Masks::new(vec![whole.clone()], &[0, -1, 0], &corners).unwrap();
        assert!(masks.is_none());
        // One corner is enough.
        for dim in [[0.9; 3], [0.9, 1.0, 1.0], [1.0, 1.0, 0.9]] {
            let corners = [dim.map(|factor| DVec3::Z * factor), [DVec3::Z; 3]];
            let masks = Masks::new(vec![whole.clone()], &[0, -1, 0], &corners);
            let masks = masks.unwrap().unwrap();
            assert_eq!(masks.masked_count(), 1);
            assert!(masks.of_triangle(0).is_some());
            assert!(masks.of_triangle(1).is_none() && masks.of_triangle(2).is_none());
        }
    }
}
