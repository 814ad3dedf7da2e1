//! How often the exact tier was needed, per thread.
//!
//! The count stands beside the arithmetic and not in its signatures, since only the cold path ever touches it.

use std::cell::Cell;

thread_local! {
    static EXACT_TESTS: Cell<u64> = const { Cell::new(0) };
}

/// Notes one primitive test that needed exact arithmetic; the clip of a quadric is a test of its own.
#[cold]
pub(crate) fn count_exact_test() {
    EXACT_TESTS.with(|count| count.set(count.get() + 1));
}

/// Primitive tests of this thread that needed exact arithmetic since the last call; resets the count.
pub fn take_exact_tests() -> u64 {
    EXACT_TESTS.with(|count| count.replace(0))
}
