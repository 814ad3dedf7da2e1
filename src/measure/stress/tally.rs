//! What a suite has found so far.

use crate::numeric::tally::take_exact_tests;

/// Failing cases that are kept as text; the others are only counted.
const KEPT_FAILURES: usize = 10;

/// Decisions of one of the textbook formulas.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Textbook {
    /// Cases that it was asked.
    pub cases: u64,
    /// Cases that it decided wrongly.
    pub wrong: u64,
}

/// Figures of a run of cases; merging is exact, so that the sum does not depend on how the cases were cut.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tally {
    /// Cases: rays with a question that has one right answer.
    pub cases: u64,
    /// Cases answered wrongly.
    pub wrong: u64,
    /// Hits whose position or normal is farther off than promised.
    pub inaccurate: u64,
    /// Rays judged by exact arithmetic; the others have an answer known in advance, or that of the full scan.
    pub judged: u64,
    /// Primitive tests that needed the exact tier.
    pub exact_tests: u64,
    /// Largest error of t, in f64 ulps.
    pub max_ulp_t: f64,
    /// Largest error of t as f32, in f32 ulps.
    pub max_ulp_t_f32: f64,
    /// Largest error of a component of the position, in ulps of the largest coordinate involved.
    pub max_ulp_p: f64,
    /// Largest error of a component of the unit normal, where the surface determines it.
    pub max_err_n: f64,
    /// The naive formulas in f32.
    pub naive_f32: Textbook,
    /// Möller and Trumbore in f32, of triangles.
    pub moller_trumbore_f32: Textbook,
    /// The first failing cases.
    pub failures: Vec<String>,
}

impl Tally {
    /// Counts a case.
    pub fn count(&mut self, right: bool, describe: impl FnOnce() -> String) {
        self.cases += 1;
        if !right {
            self.fail(describe());
        }
    }

    /// Counts a failure of a case that is already counted.
    pub fn fail(&mut self, text: String) {
        self.wrong += 1;
        self.keep(text);
    }

    /// Keeps the text of a failure.
    pub fn keep(&mut self, text: String) {
        if self.failures.len() < KEPT_FAILURES {
            self.failures.push(text);
        }
    }

    /// Runs a piece of the program under test on this thread and counts what needed exact arithmetic.
    pub fn watch<T>(&mut self, kernel: impl FnOnce() -> T) -> T {
        take_exact_tests();
        let answer = kernel();
        self.exact_tests += take_exact_tests();
        answer
    }

    /// Adds the figures of cases that come after those of `self`.
    pub fn merge(&mut self, other: Tally) {
        let Tally { cases, wrong, inaccurate, judged, exact_tests, .. } = other;
        self.cases += cases;
        self.wrong += wrong;
        self.inaccurate += inaccurate;
        self.judged += judged;
        self.exact_tests += exact_tests;
        self.max_ulp_t = self.max_ulp_t.max(other.max_ulp_t);
        self.max_ulp_t_f32 = self.max_ulp_t_f32.max(other.max_ulp_t_f32);
        self.max_ulp_p = self.max_ulp_p.max(other.max_ulp_p);
        self.max_err_n = self.max_err_n.max(other.max_err_n);
        self.naive_f32.merge(other.naive_f32);
        self.moller_trumbore_f32.merge(other.moller_trumbore_f32);
        self.failures.extend(other.failures);
        self.failures.truncate(KEPT_FAILURES);
    }
}

impl Textbook {
    /// Counts a decision.
    pub fn count(&mut self, right: bool) {
        self.cases += 1;
        self.wrong += u64::from(!right);
    }

    fn merge(&mut self, other: Textbook) {
        self.cases += other.cases;
        self.wrong += other.wrong;
    }
}
