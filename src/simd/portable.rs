//! Lanes as arrays, for processors of which nothing is known: the compiler makes of them what it can.

use std::array::from_fn;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::rounding::{f32_at_least, f32_at_most};
use super::{Batch, CYCLIC, F32Lanes, F64Lanes, MaskLanes, Simd, WIDTH, WIDTH64};

/// No instruction set beyond the baseline.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

/// N numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(32))]
pub struct Array<T, const N: usize>(pub [T; N]);

impl Simd for Portable {
    type F32 = Array<f32, WIDTH>;
    type F64 = Array<f64, WIDTH64>;

    #[inline(always)]
    fn splat(self, x: f32) -> Self::F32 {
        Array([x; WIDTH])
    }

    #[inline(always)]
    fn load(self, from: &[f32; WIDTH]) -> Self::F32 {
        Array(*from)
    }

    #[inline(always)]
    fn load_pair(self, from: &[[f32; WIDTH]; 2], swap: usize) -> [Self::F32; 2] {
        [Array(from[swap & 1]), Array(from[swap & 1 ^ 1])]
    }

    #[inline(always)]
    fn load_corners(self, from: &[f32], base: usize, stride: usize, last: usize) -> [[Self::F32; 3]; 3] {
        let axes = CYCLIC[last & 3];
        from_fn(|corner| {
            axes.map(|axis| {
                let first = base + (3 * corner + axis) * stride;
                let lanes = &from[first..first + WIDTH];
                Array(from_fn(|i| lanes[i]))
            })
        })
    }

    #[inline(always)]
    fn splat64(self, x: f64) -> Self::F64 {
        Array([x; WIDTH64])
    }

    #[inline(always)]
    fn load64(self, from: &[f64; WIDTH64]) -> Self::F64 {
        Array(*from)
    }

    #[inline(always)]
    fn columns64(self, rows: [&[f64; WIDTH64]; WIDTH64]) -> [Self::F64; WIDTH64] {
        from_fn(|column| Array(from_fn(|row| rows[row][column])))
    }

    #[inline(always)]
    fn rows32(self, columns: [[f32; WIDTH64]; WIDTH64]) -> [[f32; WIDTH64]; WIDTH64] {
        from_fn(|row| from_fn(|column| columns[column][row]))
    }

    #[inline(always)]
    fn widen(self, from: [f32; WIDTH64]) -> Self::F64 {
        Array(from.map(f64::from))
    }

    #[cold]
    #[inline(never)]
    fn apart<B: Batch>(self, batch: B) {
        batch.run(self);
    }

    #[inline(always)]
    fn prefetch_either<T, U>(self, _first: &[T], _second: &[U], _is_second: bool, _row: usize) {}

    #[inline(always)]
    fn pack(
        self,
        key: Self::F32,
        tag: &[u8; WIDTH],
        value: &[u32; WIDTH],
        order: &[u8; WIDTH],
        to: (&mut [u32; WIDTH], &mut [u32; WIDTH]),
    ) {
        for (place, &lane) in order.iter().enumerate() {
            let lane = lane as usize % WIDTH;
            to.0[place] = key.0[lane].to_bits() & !0xff | u32::from(tag[lane]);
            to.1[place] = value[lane];
        }
    }
}

macro_rules! lanes {
    ($t:ty, $n:expr) => {
        impl Add for Array<$t, $n> {
            type Output = Self;
            #[inline(always)]
            fn add(self, other: Self) -> Self {
                Array(from_fn(|i| self.0[i] + other.0[i]))
            }
        }
        impl Sub for Array<$t, $n> {
            type Output = Self;
            #[inline(always)]
            fn sub(self, other: Self) -> Self {
                Array(from_fn(|i| self.0[i] - other.0[i]))
            }
        }
        impl Mul for Array<$t, $n> {
            type Output = Self;
            #[inline(always)]
            fn mul(self, other: Self) -> Self {
                Array(from_fn(|i| self.0[i] * other.0[i]))
            }
        }
        impl Div for Array<$t, $n> {
            type Output = Self;
            #[inline(always)]
            fn div(self, other: Self) -> Self {
                Array(from_fn(|i| self.0[i] / other.0[i]))
            }
        }
        impl Neg for Array<$t, $n> {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Array(self.0.map(|x| -x))
            }
        }
    };
}

lanes!(f32, WIDTH);
lanes!(f64, WIDTH64);

impl F32Lanes for Array<f32, WIDTH> {
    type Mask = Array<bool, WIDTH>;

    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        self * factor + summand
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Array(from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Array(from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Array(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        Array(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn not_lt(self, other: Self) -> Self::Mask {
        !self.lt(other)
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        Array(from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline(always)]
    fn select(self, mask: Self::Mask, other: Self) -> Self {
        Array(from_fn(|i| if mask.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; WIDTH] {
        self.0
    }
}

impl F64Lanes for Array<f64, WIDTH64> {
    type Mask = Array<bool, WIDTH64>;

    #[inline(always)]
    fn same(self, x: f64) -> Self {
        Array([x; WIDTH64])
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, summand: Self) -> Self {
        Array(from_fn(|i| self.0[i].mul_add(factor.0[i], summand.0[i])))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Array(from_fn(|i| if self.0[i] < other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Array(from_fn(|i| if self.0[i] > other.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Array(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn select(self, mask: Self::Mask, other: Self) -> Self {
        Array(from_fn(|i| if mask.0[i] { self.0[i] } else { other.0[i] }))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Array(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        Array(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        Array(from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline(always)]
    fn equals(self, other: Self) -> Self::Mask {
        Array(from_fn(|i| self.0[i] == other.0[i]))
    }
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH64] {
        self.0
    }
    #[inline(always)]
    fn to_f32(self) -> [f32; WIDTH64] {
        self.0.map(|x| x as f32)
    }
    #[inline(always)]
    fn outwards(self) -> [[f32; WIDTH64]; 2] {
        [self.0.map(f32_at_most), self.0.map(f32_at_least)]
    }
}

impl<const N: usize> BitAnd for Array<bool, N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Array(from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl<const N: usize> BitOr for Array<bool, N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Array(from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl<const N: usize> Not for Array<bool, N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Array(self.0.map(|x| !x))
    }
}

impl<const N: usize> MaskLanes for Array<bool, N> {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.iter().enumerate().fold(0, |bits, (i, &set)| bits | u32::from(set) << i)
    }
}
