//! Instruction sets: which the processor has, running a batch with one of them, and lanes of numbers.
//!
//! A batch is dispatched once and is handed a proof of the set it was dispatched with. Kernels are generic over that
//! proof, and only through it can lanes be made, so that lanes of a set exist only where the processor has it.
//!
//! Lanes of f64 do the same operations in the same order on every set, so bits are the same: fused multiply-adds are
//! correctly rounded with and without hardware, and nothing is contracted. Lanes of f32 only decide what their error
//! bounds make certain; [`F32Lanes::mul_add`] may round twice where the processor has no fused one.

#![allow(unsafe_code)]

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod bits;
mod pages;
mod portable;
pub mod rounding;

use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

pub use bits::{bytes_of_bits, set_bits};
pub use pages::{move_to_large_pages, prefer_large_pages};
pub use portable::Portable;

/// Lanes of f32.
pub const WIDTH: usize = 8;

/// Lanes of f64.
pub const WIDTH64: usize = 4;

/// Axes in cyclic order, by the last; as many as need no check of an index.
pub const CYCLIC: [[usize; 3]; 4] = [[1, 2, 0], [2, 0, 1], [0, 1, 2], [0, 1, 2]];

/// An instruction set that batches are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// What every processor of the architecture has.
    Baseline,
    /// x86-64 with AVX2, FMA and BMI.
    Avx2,
    /// The same lanes with AVX-512's encodings (F, VL, DQ, BW): twice the registers, operands broadcast from memory,
    /// comparisons into mask registers.
    Avx512,
}

/// The proof that the processor has an instruction set, and the way to its lanes.
pub trait Simd: Copy {
    /// Eight f32.
    type F32: F32Lanes;
    /// Four f64.
    type F64: F64Lanes;

    /// The same number in all lanes.
    fn splat(self, x: f32) -> Self::F32;

    /// Eight numbers.
    fn load(self, from: &[f32; WIDTH]) -> Self::F32;

    /// A pair of eight numbers, swapped where the lowest bit of `swap` is set.
    fn load_pair(self, from: &[[f32; WIDTH]; 2], swap: usize) -> [Self::F32; 2];

    /// Corners of eight triangles: x, y, z of the first, of the second and of the third, each in the cyclic order of axes that
    /// ends with `last` (0 to 2). They are nine columns of eight numbers, `stride` apart, from `base` on.
    ///
    /// # Panics
    /// When a column ends beyond the slice, or the stride is above [`WIDTH`].
    fn load_corners(self, from: &[f32], base: usize, stride: usize, last: usize) -> [[Self::F32; 3]; 3];

    /// The same number in all lanes.
    fn splat64(self, x: f64) -> Self::F64;

    /// Four numbers.
    fn load64(self, from: &[f64; WIDTH64]) -> Self::F64;

    /// The columns of four rows.
    fn columns64(self, rows: [&[f64; WIDTH64]; WIDTH64]) -> [Self::F64; WIDTH64];

    /// The rows of four columns.
    fn rows32(self, columns: [[f32; WIDTH64]; WIDTH64]) -> [[f32; WIDTH64]; WIDTH64];

    /// Four f32 as f64.
    fn widen(self, from: [f32; WIDTH64]) -> Self::F64;

    /// Runs something rare out of line, compiled for this set: inlined, it would cost the common case registers.
    fn apart<B: Batch>(self, batch: B);

    /// Asks for 256 bytes of a table ahead of time: of the second if `is_second`, else of the first.
    fn prefetch_either<T, U>(self, first: &[T], second: &[U], is_second: bool, row: usize);

    /// Writes the keys, with their last eight bits replaced by `tag`, and the values of the lanes that `order` names, in its
    /// order. What stands behind the named ones is unspecified.
    fn pack(
        self,
        key: Self::F32,
        tag: &[u8; WIDTH],
        value: &[u32; WIDTH],
        order: &[u8; WIDTH],
        to: (&mut [u32; WIDTH], &mut [u32; WIDTH]),
    );
}

/// Lanes that a comparison was true in.
pub trait MaskLanes: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Bit i for lane i.
    fn bits(self) -> u32;
}

/// Eight f32. Comparisons with NaN are false.
pub trait F32Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Results of comparisons.
    type Mask: MaskLanes;

    /// `self * factor + summand`, rounded once or twice.
    fn mul_add(self, factor: Self, summand: Self) -> Self;
    /// The smaller one; `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger one; `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    /// The magnitude.
    fn abs(self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// Not `self < other`: true where either is NaN.
    fn not_lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// This where the mask is set, `other` elsewhere.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// The lanes.
    fn to_array(self) -> [f32; WIDTH];
}

/// One or more f64; a plain f64 is the case of one. All operations are rounded as IEEE 754 says, fused
/// multiply-adds once.
pub trait F64Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    /// Results of comparisons.
    type Mask: MaskLanes;

    /// The same number in all lanes of the same kind as `self`.
    fn same(self, x: f64) -> Self;
    /// `self * factor + summand`, rounded once.
    fn mul_add(self, factor: Self, summand: Self) -> Self;
    /// The smaller one; `other` where either is NaN.
    fn min(self, other: Self) -> Self;
    /// The larger one; `other` where either is NaN.
    fn max(self, other: Self) -> Self;
    /// The magnitude.
    fn abs(self) -> Self;
    /// This where the mask is set, `other` elsewhere.
    fn select(self, mask: Self::Mask, other: Self) -> Self;
    /// The square root; NaN of negative numbers.
    fn sqrt(self) -> Self;
    /// `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`.
    fn equals(self, other: Self) -> Self::Mask;
    /// The lanes; one number stands in all of them.
    fn to_array(self) -> [f64; WIDTH64];
    /// The lanes rounded to the nearest f32.
    fn to_f32(self) -> [f32; WIDTH64];
    /// The lanes rounded to f32, down and up; lanes must not be NaN.
    fn outwards(self) -> [[f32; WIDTH64]; 2];
}

/// Work on a batch. Implementations mark `run`, and what it calls in its inner loops, `#[inline(always)]`: only what
/// is inlined is compiled for the instruction set.
pub trait Batch {
    /// Does the work.
    fn run<S: Simd>(self, simd: S);
}

impl Isa {
    /// All of them.
    pub const ALL: [Isa; 3] = [Isa::Baseline, Isa::Avx2, Isa::Avx512];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Isa::Baseline => "baseline",
            Isa::Avx2 => "avx2",
            Isa::Avx512 => "avx512",
        }
    }

    /// The set that is fastest on this processor. AVX-512 was measured to gain less than 5 % over AVX2
    /// (`docs/BENCHMARKS.md`) and is only used when it is asked for.
    pub fn detect() -> Isa {
        if Isa::Avx2.is_available() { Isa::Avx2 } else { Isa::Baseline }
    }

    /// Whether this processor has the set; the answer is found once per process.
    pub fn is_available(self) -> bool {
        match self {
            Isa::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => avx2::Avx2::detect().is_some(),
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => avx512::Avx512::detect().is_some(),
            #[cfg(not(target_arch = "x86_64"))]
            Isa::Avx2 | Isa::Avx512 => false,
        }
    }

    /// Runs a batch with this set, or with the baseline where the processor lacks it.
    pub fn dispatch<B: Batch>(self, batch: B) {
        #[cfg(target_arch = "x86_64")]
        if self == Isa::Avx512
            && let Some(avx512) = avx512::Avx512::detect()
        {
            return avx512.run(batch);
        }
        #[cfg(target_arch = "x86_64")]
        if self == Isa::Avx2
            && let Some(avx2) = avx2::Avx2::detect()
        {
            return avx2.run(batch);
        }
        batch.run(Portable);
    }
}

impl F64Lanes for f64 {
    type Mask = bool;

    #[inline(always)]
    fn same(self, x: f64) -> f64 {
        x
    }
    #[inline(always)]
    fn mul_add(self, factor: f64, summand: f64) -> f64 {
        f64::mul_add(self, factor, summand)
    }
    #[inline(always)]
    fn min(self, other: f64) -> f64 {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: f64) -> f64 {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> f64 {
        f64::abs(self)
    }
    #[inline(always)]
    fn select(self, mask: bool, other: f64) -> f64 {
        if mask { self } else { other }
    }
    #[inline(always)]
    fn sqrt(self) -> f64 {
        f64::sqrt(self)
    }
    #[inline(always)]
    fn lt(self, other: f64) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: f64) -> bool {
        self <= other
    }
    #[inline(always)]
    fn equals(self, other: f64) -> bool {
        self == other
    }
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH64] {
        [self; WIDTH64]
    }
    #[inline(always)]
    fn to_f32(self) -> [f32; WIDTH64] {
        [self as f32; WIDTH64]
    }
    #[inline(always)]
    fn outwards(self) -> [[f32; WIDTH64]; 2] {
        [[rounding::f32_at_most(self); WIDTH64], [rounding::f32_at_least(self); WIDTH64]]
    }
}

impl MaskLanes for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}
