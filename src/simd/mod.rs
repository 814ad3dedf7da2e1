//! Instruction sets: which the processor has, and running a batch with one of them.
//!
//! A batch is dispatched once. Everything below is ordinary code that the compiler compiles again for each set, so the
//! arithmetic is the same operations in the same order, and the bits are the same: fused multiply-adds are correctly
//! rounded with and without hardware, and nothing is contracted.

#![allow(unsafe_code)]

/// An instruction set that batches are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Isa {
    /// What every processor of the architecture has.
    Baseline,
    /// x86-64 with AVX2, FMA and BMI.
    Avx2,
}

/// Work on a batch. Implementations mark `run`, and what it calls in its inner loops, `#[inline(always)]`: only what
/// is inlined is compiled for the instruction set.
pub trait Batch {
    /// Does the work.
    fn run(self);
}

impl Isa {
    /// The best set that this processor has; found once per process.
    pub fn detect() -> Isa {
        #[cfg(target_arch = "x86_64")]
        if has_avx2() {
            return Isa::Avx2;
        }
        Isa::Baseline
    }

    /// Whether this processor has the set.
    pub fn is_available(self) -> bool {
        self == Isa::Baseline || self == Isa::detect()
    }

    /// Runs a batch with this set, or with the baseline where the processor lacks it.
    pub fn dispatch<B: Batch>(self, batch: B) {
        #[cfg(target_arch = "x86_64")]
        if self == Isa::Avx2 && has_avx2() {
            // SAFETY: the processor was just found to have every feature that `run_avx2` is compiled for.
            return unsafe { run_avx2(batch) };
        }
        batch.run();
    }
}

#[cfg(target_arch = "x86_64")]
fn has_avx2() -> bool {
    is_x86_feature_detected!("avx2")
        && is_x86_feature_detected!("fma")
        && is_x86_feature_detected!("bmi1")
        && is_x86_feature_detected!("bmi2")
        && is_x86_feature_detected!("lzcnt")
        && is_x86_feature_detected!("popcnt")
}

/// # Safety
/// The processor must have the features named here.
#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
unsafe fn run_avx2<B: Batch>(batch: B) {
    batch.run();
}
