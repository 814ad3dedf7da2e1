//! A ray against a primitive, the kernel against exact arithmetic. What bytes mean: `flatray::measure::stress::fuzz`.

#![no_main]

use flatray::measure::stress::fuzz::check;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Err(case) = check(bytes) {
        panic!("wrong: {case}");
    }
});
