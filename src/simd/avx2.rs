//! Lanes of AVX2 with FMA.
//!
//! Every intrinsic here needs a feature that [`Avx2::detect`] has found. An [`Avx2`] comes from there alone, and lanes
//! from an [`Avx2`] or from other lanes: each SAFETY argument below rests on that.

use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

use super::{Batch, CYCLIC, F32Lanes, F64Lanes, MaskLanes, Simd, WIDTH, WIDTH64};

/// Bytes of a cache line.
const CACHE_LINE: usize = 64;

/// The proof that this processor has AVX2, FMA, BMI and what comes with them.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

/// Eight f32.
#[derive(Clone, Copy, Debug)]
pub struct F32x8(__m256);

/// Results of comparing eight f32.
#[derive(Clone, Copy, Debug)]
pub struct Mask32(__m256);

/// Four f64.
#[derive(Clone, Copy, Debug)]
pub struct F64x4(__m256d);

/// Results of comparing four f64.
#[derive(Clone, Copy, Debug)]
pub struct Mask64(__m256d);

impl Avx2 {
    /// The proof, if the processor has the features; the answer is cached by the standard library.
    #[inline]
    pub fn detect() -> Option<Avx2> {
        let has = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("fma")
            && is_x86_feature_detected!("bmi1")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("lzcnt")
            && is_x86_feature_detected!("popcnt");
        has.then_some(Avx2(()))
    }

    /// Runs a batch compiled for these features.
    pub fn run<B: Batch>(self, batch: B) {
        // SAFETY: `self` proves that the processor has every feature that `run_avx2` is compiled for.
        unsafe { run_avx2(self, batch) }
    }
}

/// # Safety
/// The processor must have the features named here.
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx2<B: Batch>(avx2: Avx2, batch: B) {
    batch.run(avx2);
}

/// # Safety
/// The processor must have the features named here.
#[cold]
#[inline(never)]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_apart<B: Batch>(avx2: Avx2, batch: B) {
    batch.run(avx2);
}

/// An intrinsic on lanes that exist.
macro_rules! intrinsic {
    ($call:expr) => {
        // SAFETY: lanes and proofs exist only where the processor has AVX2 and FMA (see the head of this file), and this
        // intrinsic takes values only.
        unsafe { $call }
    };
}

impl Simd for Avx2 {
    type F32 = F32x8;
    type F64 = F64x4;

    #[inline(always)]
    fn splat(self, x: f32) -> F32x8 {
        F32x8(intrinsic!(_mm256_set1_ps(x)))
    }

    #[inline(always)]
    fn load(self, from: &[f32; WIDTH]) -> F32x8 {
        // SAFETY: AVX2 is there, and the array holds the eight f32 that are read; no alignment is needed.
        F32x8(unsafe { _mm256_loadu_ps(from.as_ptr()) })
    }

    #[inline(always)]
    fn load_pair(self, from: &[[f32; WIDTH]; 2], swap: usize) -> [F32x8; 2] {
        const BYTES: usize = size_of::<[f32; WIDTH]>();
        // Bytes rather than an index: the compiler would shift twice.
        let offset = (swap & 1) * BYTES;
        let bytes = from.as_ptr().cast::<u8>();
        // SAFETY: AVX2 is there, and each offset is 0 or that of the second of two arrays of eight f32, which are read.
        unsafe {
            let first = _mm256_loadu_ps(bytes.add(offset).cast());
            [F32x8(first), F32x8(_mm256_loadu_ps(bytes.add(offset ^ BYTES).cast()))]
        }
    }

    #[inline(always)]
    fn load_corners(self, from: &[f32], base: usize, stride: usize, last: usize) -> [[F32x8; 3]; 3] {
        // The first two keep the sum from overflowing.
        let inside = base <= from.len() && stride <= WIDTH && base + 8 * stride + WIDTH <= from.len();
        assert!(inside, "a column ends beyond the slice");
        let [x, y, z] = CYCLIC[last & 3];
        let offsets = [x * stride, y * stride, z * stride];
        let mut loaded = [[self.splat(0.0); 3]; 3];
        for (corner, loaded) in loaded.iter_mut().enumerate() {
            for (loaded, offset) in loaded.iter_mut().zip(offsets) {
                // SAFETY: AVX2 is there. The ninth column, of which both factors are the largest, was just found to end inside.
                *loaded = F32x8(unsafe { _mm256_loadu_ps(from.as_ptr().add(base + 3 * corner * stride + offset)) });
            }
        }
        loaded
    }

    #[inline(always)]
    fn splat64(self, x: f64) -> F64x4 {
        F64x4(intrinsic!(_mm256_set1_pd(x)))
    }

    #[inline(always)]
    fn load64(self, from: &[f64; WIDTH64]) -> F64x4 {
        // SAFETY: AVX2 is there, and the array holds the four f64 that are read; no alignment is needed.
        F64x4(unsafe { _mm256_loadu_pd(from.as_ptr()) })
    }

    #[inline(always)]
    fn columns64(self, rows: [&[f64; WIDTH64]; WIDTH64]) -> [F64x4; WIDTH64] {
        let [F64x4(a), F64x4(b), F64x4(c), F64x4(d)] =
            [self.load64(rows[0]), self.load64(rows[1]), self.load64(rows[2]), self.load64(rows[3])];
        // SAFETY: AVX2 is there, and the intrinsics take values only.
        unsafe {
            let (ab_even, ab_odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (cd_even, cd_odd) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            [
                F64x4(_mm256_permute2f128_pd::<0x20>(ab_even, cd_even)),
                F64x4(_mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd)),
                F64x4(_mm256_permute2f128_pd::<0x31>(ab_even, cd_even)),
                F64x4(_mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd)),
            ]
        }
    }

    #[inline(always)]
    fn rows32(self, columns: [[f32; WIDTH64]; WIDTH64]) -> [[f32; WIDTH64]; WIDTH64] {
        let [a, b, c, d] = [load_f32(&columns[0]), load_f32(&columns[1]), load_f32(&columns[2]), load_f32(&columns[3])];
        // SAFETY: AVX2 is there, and the intrinsics take values only.
        unsafe {
            let (ab_low, ab_high) = (_mm_unpacklo_ps(a, b), _mm_unpackhi_ps(a, b));
            let (cd_low, cd_high) = (_mm_unpacklo_ps(c, d), _mm_unpackhi_ps(c, d));
            [
                store_f32(_mm_movelh_ps(ab_low, cd_low)),
                store_f32(_mm_movehl_ps(cd_low, ab_low)),
                store_f32(_mm_movelh_ps(ab_high, cd_high)),
                store_f32(_mm_movehl_ps(cd_high, ab_high)),
            ]
        }
    }

    #[inline(always)]
    fn widen(self, from: [f32; WIDTH64]) -> F64x4 {
        F64x4(intrinsic!(_mm256_cvtps_pd(load_f32(&from))))
    }

    #[inline(always)]
    fn apart<B: Batch>(self, batch: B) {
        // SAFETY: `self` proves that the processor has every feature that `run_apart` is compiled for.
        unsafe { run_apart(self, batch) }
    }

    #[inline(always)]
    fn prefetch_either<T, U>(self, first: &[T], second: &[U], is_second: bool, row: usize) {
        let table = if is_second { second.as_ptr().cast::<i8>() } else { first.as_ptr().cast::<i8>() };
        let bytes = row.wrapping_mul(if is_second { size_of::<U>() } else { size_of::<T>() });
        for line in 0..4 {
            // SAFETY: a prefetch is a hint; it may be given any address and accesses nothing.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(table.wrapping_add(bytes + line * CACHE_LINE)) };
        }
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
        // SAFETY: AVX2 is there; each load reads exactly the array it is given (8 bytes, 8 bytes, 32 bytes), and the
        // stores fill the 32 bytes of each array of `to`.
        unsafe {
            let tags = _mm256_cvtepu8_epi32(_mm_loadl_epi64(tag.as_ptr().cast()));
            let order = _mm256_cvtepu8_epi32(_mm_loadl_epi64(order.as_ptr().cast()));
            let values = _mm256_loadu_si256(value.as_ptr().cast());
            let keys = _mm256_or_si256(_mm256_and_si256(_mm256_castps_si256(key.0), _mm256_set1_epi32(!0xff)), tags);
            _mm256_storeu_si256(to.0.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(keys, order));
            _mm256_storeu_si256(to.1.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(values, order));
        }
    }
}

macro_rules! operators {
    ($lanes:ident, $add:ident, $sub:ident, $mul:ident, $div:ident, $xor:ident, $splat:ident) => {
        impl Add for $lanes {
            type Output = $lanes;
            #[inline(always)]
            fn add(self, other: $lanes) -> $lanes {
                $lanes(intrinsic!($add(self.0, other.0)))
            }
        }
        impl Sub for $lanes {
            type Output = $lanes;
            #[inline(always)]
            fn sub(self, other: $lanes) -> $lanes {
                $lanes(intrinsic!($sub(self.0, other.0)))
            }
        }
        impl Mul for $lanes {
            type Output = $lanes;
            #[inline(always)]
            fn mul(self, other: $lanes) -> $lanes {
                $lanes(intrinsic!($mul(self.0, other.0)))
            }
        }
        impl Div for $lanes {
            type Output = $lanes;
            #[inline(always)]
            fn div(self, other: $lanes) -> $lanes {
                $lanes(intrinsic!($div(self.0, other.0)))
            }
        }
        impl Neg for $lanes {
            type Output = $lanes;
            #[inline(always)]
            fn neg(self) -> $lanes {
                $lanes(intrinsic!($xor(self.0, $splat(-0.0))))
            }
        }
    };
}

operators!(F32x8, _mm256_add_ps, _mm256_sub_ps, _mm256_mul_ps, _mm256_div_ps, _mm256_xor_ps, _mm256_set1_ps);
operators!(F64x4, _mm256_add_pd, _mm256_sub_pd, _mm256_mul_pd, _mm256_div_pd, _mm256_xor_pd, _mm256_set1_pd);

macro_rules! masks {
    ($mask:ident, $and:ident, $or:ident, $xor:ident, $compare:ident, $zero:ident, $bits:ident) => {
        impl BitAnd for $mask {
            type Output = $mask;
            #[inline(always)]
            fn bitand(self, other: $mask) -> $mask {
                $mask(intrinsic!($and(self.0, other.0)))
            }
        }
        impl BitOr for $mask {
            type Output = $mask;
            #[inline(always)]
            fn bitor(self, other: $mask) -> $mask {
                $mask(intrinsic!($or(self.0, other.0)))
            }
        }
        impl Not for $mask {
            type Output = $mask;
            #[inline(always)]
            fn not(self) -> $mask {
                $mask(intrinsic!($xor(self.0, $compare::<_CMP_TRUE_UQ>($zero(), $zero()))))
            }
        }
        impl MaskLanes for $mask {
            #[inline(always)]
            fn bits(self) -> u32 {
                intrinsic!($bits(self.0)) as u32
            }
        }
    };
}

masks!(Mask32, _mm256_and_ps, _mm256_or_ps, _mm256_xor_ps, _mm256_cmp_ps, _mm256_setzero_ps, _mm256_movemask_ps);
masks!(Mask64, _mm256_and_pd, _mm256_or_pd, _mm256_xor_pd, _mm256_cmp_pd, _mm256_setzero_pd, _mm256_movemask_pd);

impl F32Lanes for F32x8 {
    type Mask = Mask32;

    #[inline(always)]
    fn mul_add(self, factor: F32x8, summand: F32x8) -> F32x8 {
        F32x8(intrinsic!(_mm256_fmadd_ps(self.0, factor.0, summand.0)))
    }
    #[inline(always)]
    fn min(self, other: F32x8) -> F32x8 {
        F32x8(intrinsic!(_mm256_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: F32x8) -> F32x8 {
        F32x8(intrinsic!(_mm256_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn abs(self) -> F32x8 {
        F32x8(intrinsic!(_mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn lt(self, other: F32x8) -> Mask32 {
        Mask32(intrinsic!(_mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn not_lt(self, other: F32x8) -> Mask32 {
        Mask32(intrinsic!(_mm256_cmp_ps::<_CMP_NLT_UQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: F32x8) -> Mask32 {
        Mask32(intrinsic!(_mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn select(self, mask: Mask32, other: F32x8) -> F32x8 {
        F32x8(intrinsic!(_mm256_blendv_ps(other.0, self.0, mask.0)))
    }
    #[inline(always)]
    fn to_array(self) -> [f32; WIDTH] {
        let mut array = [0.0; WIDTH];
        // SAFETY: AVX2 is there, and the array takes the eight f32 that are written.
        unsafe { _mm256_storeu_ps(array.as_mut_ptr(), self.0) };
        array
    }
}

impl F64Lanes for F64x4 {
    type Mask = Mask64;

    #[inline(always)]
    fn same(self, x: f64) -> F64x4 {
        F64x4(intrinsic!(_mm256_set1_pd(x)))
    }
    #[inline(always)]
    fn mul_add(self, factor: F64x4, summand: F64x4) -> F64x4 {
        F64x4(intrinsic!(_mm256_fmadd_pd(self.0, factor.0, summand.0)))
    }
    #[inline(always)]
    fn min(self, other: F64x4) -> F64x4 {
        F64x4(intrinsic!(_mm256_min_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: F64x4) -> F64x4 {
        F64x4(intrinsic!(_mm256_max_pd(self.0, other.0)))
    }
    #[inline(always)]
    fn abs(self) -> F64x4 {
        F64x4(intrinsic!(_mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0)))
    }
    #[inline(always)]
    fn select(self, mask: Mask64, other: F64x4) -> F64x4 {
        F64x4(intrinsic!(_mm256_blendv_pd(other.0, self.0, mask.0)))
    }
    #[inline(always)]
    fn sqrt(self) -> F64x4 {
        F64x4(intrinsic!(_mm256_sqrt_pd(self.0)))
    }
    #[inline(always)]
    fn lt(self, other: F64x4) -> Mask64 {
        Mask64(intrinsic!(_mm256_cmp_pd::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: F64x4) -> Mask64 {
        Mask64(intrinsic!(_mm256_cmp_pd::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn equals(self, other: F64x4) -> Mask64 {
        Mask64(intrinsic!(_mm256_cmp_pd::<_CMP_EQ_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn to_array(self) -> [f64; WIDTH64] {
        let mut array = [0.0; WIDTH64];
        // SAFETY: AVX2 is there, and the array takes the four f64 that are written.
        unsafe { _mm256_storeu_pd(array.as_mut_ptr(), self.0) };
        array
    }
    #[inline(always)]
    fn to_f32(self) -> [f32; WIDTH64] {
        store_f32(intrinsic!(_mm256_cvtpd_ps(self.0)))
    }
    #[inline(always)]
    fn outwards(self) -> [[f32; WIDTH64]; 2] {
        // SAFETY: AVX2 is there, and the intrinsics take values only.
        let (down, up) = unsafe {
            // Zero without a sign, so that the sign tells which way the bits grow.
            let nearest = _mm_add_ps(_mm256_cvtpd_ps(self.0), _mm_setzero_ps());
            let back = _mm256_cvtps_pd(nearest);
            let bits = _mm_castps_si128(nearest);
            // 1 for positive numbers and zero, −1 for negative ones: the step to the next larger f32.
            let step = _mm_or_si128(_mm_srai_epi32::<31>(bits), _mm_set1_epi32(1));
            let above = narrow(_mm256_cmp_pd::<_CMP_GT_OQ>(back, self.0));
            let below = narrow(_mm256_cmp_pd::<_CMP_LT_OQ>(back, self.0));
            // The next below zero is no step of its bits, but the smallest negative number.
            let is_zero = _mm_cmpeq_epi32(bits, _mm_setzero_si128());
            let stepped = _mm_sub_epi32(bits, step);
            let under = _mm_blendv_epi8(stepped, _mm_set1_epi32(i32::MIN + 1), is_zero);
            (_mm_blendv_epi8(bits, under, above), _mm_add_epi32(bits, _mm_and_si128(below, step)))
        };
        // SAFETY: AVX2 is there, and the casts change no bit.
        let (down, up) = unsafe { (_mm_castsi128_ps(down), _mm_castsi128_ps(up)) };
        [store_f32(down), store_f32(up)]
    }
}

#[inline(always)]
fn load_f32(from: &[f32; WIDTH64]) -> __m128 {
    // SAFETY: what calls it holds lanes, so AVX2 is there, and the array holds the four f32 that are read.
    unsafe { _mm_loadu_ps(from.as_ptr()) }
}

#[inline(always)]
fn store_f32(x: __m128) -> [f32; WIDTH64] {
    let mut array = [0.0; WIDTH64];
    // SAFETY: what lanes come from has AVX2, and the array takes the four f32 that are written.
    unsafe { _mm_storeu_ps(array.as_mut_ptr(), x) };
    array
}

/// Four masks of 64 bits to four of 32.
#[inline(always)]
fn narrow(mask: __m256d) -> __m128i {
    // SAFETY: what lanes come from has AVX2, and the intrinsics take values only.
    unsafe {
        let mask = _mm256_castpd_ps(mask);
        let (lower, upper) = (_mm256_castps256_ps128(mask), _mm256_extractf128_ps::<1>(mask));
        _mm_castps_si128(_mm_shuffle_ps::<0b10_00_10_00>(lower, upper))
    }
}
