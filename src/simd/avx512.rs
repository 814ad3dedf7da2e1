//! The lanes of AVX2, compiled with AVX-512's encodings.
//!
//! Lanes stay eight wide: on processors that split 512 bits in two, wider ones gain nothing, and leaves and nodes hold
//! eight. What is gained is in the instructions around the arithmetic.

use super::avx2::{Avx2, F32x8, F64x4};
use super::{Batch, Simd, WIDTH, WIDTH64};

/// The proof that this processor has AVX-512 F, VL, DQ and BW, and AVX2.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(Avx2);

impl Avx512 {
    /// The proof, if the processor has the features; the answer is cached by the standard library.
    #[inline]
    pub fn detect() -> Option<Avx512> {
        let has = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512bw");
        Avx2::detect().filter(|_| has).map(Avx512)
    }

    /// Runs a batch compiled for these features.
    pub fn run<B: Batch>(self, batch: B) {
        // SAFETY: `self` proves that the processor has every feature that `run_avx512` is compiled for.
        unsafe { run_avx512(self, batch) }
    }
}

/// # Safety
/// The processor must have the features named here.
#[target_feature(enable = "avx512f,avx512vl,avx512dq,avx512bw,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx512<B: Batch>(avx512: Avx512, batch: B) {
    batch.run(avx512);
}

impl Simd for Avx512 {
    type F32 = F32x8;
    type F64 = F64x4;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        self.0.splat(x)
    }
    #[inline(always)]
    fn load(self, from: &[f32; WIDTH]) -> F32x8 {
        self.0.load(from)
    }
    #[inline(always)]
    fn load_pair(self, from: &[[f32; WIDTH]; 2], swap: usize) -> [F32x8; 2] {
        self.0.load_pair(from, swap)
    }
    #[inline(always)]
    fn load_corners(self, from: &[f32], base: usize, stride: usize, last: usize) -> [[F32x8; 3]; 3] {
        self.0.load_corners(from, base, stride, last)
    }
    #[inline(always)]
    fn splat64(self, x: f64) -> F64x4 {
        self.0.splat64(x)
    }
    #[inline(always)]
    fn load64(self, from: &[f64; WIDTH64]) -> F64x4 {
        self.0.load64(from)
    }
    #[inline(always)]
    fn columns64(self, rows: [&[f64; WIDTH64]; WIDTH64]) -> [F64x4; WIDTH64] {
        self.0.columns64(rows)
    }
    #[inline(always)]
    fn rows32(self, columns: [[f32; WIDTH64]; WIDTH64]) -> [[f32; WIDTH64]; WIDTH64] {
        self.0.rows32(columns)
    }
    #[inline(always)]
    fn widen(self, from: [f32; WIDTH64]) -> F64x4 {
        self.0.widen(from)
    }
    #[inline(always)]
    fn apart<B: Batch>(self, batch: B) {
        self.0.apart(batch);
    }
    #[inline(always)]
    fn prefetch_either<T, U>(self, first: &[T], second: &[U], is_second: bool, row: usize) {
        self.0.prefetch_either(first, second, is_second, row);
    }
    #[inline(always)]
    fn pack(
        self,
        key: F32x8,
        tag: &[u8; WIDTH],
        value: &[u32; WIDTH],
        order: &[u8; WIDTH],
        to: (&mut [u32; WIDTH], &mut [u32; WIDTH]),
    ) {
        self.0.pack(key, tag, value, order, to);
    }
}
