//! Numbers that a formula is written for once: float64 for fits, float32, and later several at once in SIMD
//! lanes. So a comparison gives a mask, and both sides of a choice are computed.

use glam::{DVec2, DVec3};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub trait Lane:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    type Mask: Copy
        + BitAnd<Output = Self::Mask>
        + BitOr<Output = Self::Mask>
        + Not<Output = Self::Mask>;

    /// A number that is the same in all lanes.
    fn constant(self, value: f64) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn floor(self) -> Self;
    fn exp(self) -> Self;
    fn ln(self) -> Self;
    /// A value of a table of rows, at whole numbers.
    fn gather(table: &[f32], width: usize, row: Self, column: Self) -> Self;

    /// The same, and the one after it.
    #[inline(always)]
    fn gather_two(table: &[f32], width: usize, row: Self, column: Self) -> [Self; 2] {
        [0.0, 1.0].each(|k| Self::gather(table, width, row, column + column.constant(k)))
    }

    /// The same, and the three after it.
    #[inline(always)]
    fn gather_four(table: &[f32], width: usize, row: Self, column: Self) -> [Self; 4] {
        [0.0, 1.0, 2.0, 3.0].each(|k| Self::gather(table, width, row, column + column.constant(k)))
    }

    fn less(self, other: Self) -> Self::Mask;
    fn at_most(self, other: Self) -> Self::Mask;
    /// `yes` where the mask is set, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// 1 above zero, -1 below it, and zero.
    #[inline(always)]
    fn sign(self) -> Self {
        let (zero, one) = (self.constant(0.0), self.constant(1.0));
        Self::select(
            zero.less(self),
            one,
            Self::select(self.less(zero), -one, zero),
        )
    }

    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }
}

macro_rules! scalar_lane {
    ($scalar:ident) => {
        impl Lane for $scalar {
            type Mask = bool;

            #[inline(always)]
            fn constant(self, value: f64) -> Self {
                value as Self
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.sqrt()
            }

            #[inline(always)]
            fn abs(self) -> Self {
                self.abs()
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.min(other)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.max(other)
            }

            #[inline(always)]
            fn floor(self) -> Self {
                self.floor()
            }

            #[inline(always)]
            fn exp(self) -> Self {
                self.exp()
            }

            #[inline(always)]
            fn ln(self) -> Self {
                self.ln()
            }

            #[inline(always)]
            fn gather(table: &[f32], width: usize, row: Self, column: Self) -> Self {
                table[row as usize * width + column as usize].into()
            }

            #[inline(always)]
            fn less(self, other: Self) -> bool {
                self < other
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> bool {
                self <= other
            }

            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
        }
    };
}

scalar_lane!(f64);
scalar_lane!(f32);

/// A vector of two lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct V2<L> {
    pub x: L,
    pub y: L,
}

/// A vector of three lanes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct V3<L> {
    pub x: L,
    pub y: L,
    pub z: L,
}

/// What a function makes of some things. An array's own `map` may become a call, which holds lanes in memory and knows
/// nothing of their instructions: code for lanes takes this, which is inlined.
pub trait Each<T> {
    type Of<R>;

    fn each<R>(self, f: impl FnMut(T) -> R) -> Self::Of<R>;
}

macro_rules! each {
    ($count:literal: $($value:ident)+) => {
        impl<T> Each<T> for [T; $count] {
            type Of<R> = [R; $count];

            #[inline(always)]
            fn each<R>(self, mut f: impl FnMut(T) -> R) -> [R; $count] {
                let [$($value),+] = self;
                [$(f($value)),+]
            }
        }
    };
}

each!(2: a b);
each!(3: a b c);
each!(4: a b c d);
each!(6: a b c d e f);

macro_rules! vector {
    ($vector:ident, $($i:ident),+) => {
        impl<L: Lane> $vector<L> {
            #[inline(always)]
            pub fn new($($i: L),+) -> Self {
                Self { $($i),+ }
            }

            #[inline(always)]
            pub fn splat(value: L) -> Self {
                Self { $($i: value),+ }
            }

            #[inline(always)]
            pub fn map(self, f: impl Fn(L) -> L) -> Self {
                Self { $($i: f(self.$i)),+ }
            }

            /// Both vectors' coordinates, pair by pair.
            #[inline(always)]
            pub fn zip(self, other: Self, f: impl Fn(L, L) -> L) -> Self {
                Self { $($i: f(self.$i, other.$i)),+ }
            }

            #[inline(always)]
            pub fn length(self) -> L {
                self.dot(self).sqrt()
            }
        }

        impl<L: Lane> Add for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                self.zip(other, L::add)
            }
        }

        impl<L: Lane> Sub for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                self.zip(other, L::sub)
            }
        }

        impl<L: Lane> Mul<L> for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, factor: L) -> Self {
                self.map(|x| x * factor)
            }
        }

        impl<L: Lane> Div<L> for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn div(self, divisor: L) -> Self {
                self.map(|x| x / divisor)
            }
        }

        impl<L: Lane> Neg for $vector<L> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                self.map(L::neg)
            }
        }
    };
}

vector!(V2, x, y);
vector!(V3, x, y, z);

impl<L: Lane> V2<L> {
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y
    }

    #[inline(always)]
    pub fn extend(self, z: L) -> V3<L> {
        V3::new(self.x, self.y, z)
    }
}

impl<L: Lane> V3<L> {
    #[inline(always)]
    pub fn dot(self, other: Self) -> L {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    #[inline(always)]
    pub fn xy(self) -> V2<L> {
        V2::new(self.x, self.y)
    }
}

/// Axes across a direction (Duff et al., "Building an orthonormal basis, revisited", JCGT 2017).
#[inline(always)]
pub fn axes_across<L: Lane>(z: V3<L>) -> [V3<L>; 2] {
    let (zero, one) = (z.x.constant(0.0), z.x.constant(1.0));
    let side = L::select(zero.at_most(z.z), one, -one);
    let k = -one / (side + z.z);
    let m = z.x * z.y * k;
    [
        V3::new(one + side * z.x * z.x * k, side * m, -side * z.x),
        V3::new(m, side + z.y * z.y * k, -z.y),
    ]
}

impl From<DVec2> for V2<f64> {
    fn from(v: DVec2) -> Self {
        Self::new(v.x, v.y)
    }
}

impl From<V2<f64>> for DVec2 {
    fn from(v: V2<f64>) -> Self {
        Self::new(v.x, v.y)
    }
}

impl From<DVec3> for V3<f64> {
    fn from(v: DVec3) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}

impl From<V3<f64>> for DVec3 {
    fn from(v: V3<f64>) -> Self {
        Self::new(v.x, v.y, v.z)
    }
}
