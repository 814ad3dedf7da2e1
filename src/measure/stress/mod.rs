//! `flatray stress`: the kernels against exact arithmetic, on input that renderers are known to get wrong.
//!
//! A suite is a stream of numbered cases; case k of a suite and a seed is the same whatever ran before it, on any
//! number of threads. Cases run in blocks; a block may share a scene. Results of blocks are merged in order and memory
//! does not grow with the count.

pub mod boxes;
pub mod case;
pub mod clipped;
pub mod consistency;
pub mod degenerate;
pub mod duplicate;
pub mod fuzz;
pub mod grazing;
pub mod hexadecimal;
pub mod mesh;
pub mod mirrors;
pub mod offset;
pub mod primitive;
pub mod probe;
pub mod quadric;
pub mod random;
pub mod reintersect;
pub mod replay;
pub mod scale;
pub mod scene;
pub mod shapes;
pub mod sphere;
pub mod tally;
pub mod terminator;
pub mod textbook;
pub mod watertight;
pub mod worst_case;

use std::ops::Range;

use rayon::prelude::*;

pub use case::Case;
use random::Random;
pub use tally::Tally;

/// One of the suites.
#[derive(Clone, Copy, Debug)]
pub struct Suite {
    /// Name on the command line.
    pub name: &'static str,
    /// What is sampled, in a few words.
    pub about: &'static str,
    /// Its part of the cases of a run over all suites.
    pub share: u32,
    /// Cases that share a scene.
    block_size: u64,
    run: fn(&Block, &mut Tally),
}

/// All suites, in the order in which they are reported.
pub const SUITES: [Suite; 14] = [
    suite("watertight", "closed meshes from inside: vertices, edges, axes", 10, 256, watertight::run),
    suite("scale", "everything times powers of two", 8, 64, scale::run),
    suite("offset", "everything moved by 0 to 1e7 sizes", 8, 64, offset::run),
    suite("grazing", "needles, shallow angles, far origins", 10, 64, grazing::run),
    suite("sphere", "distant, near-tangent and giant spheres", 10, 64, sphere::run),
    suite("quadric", "ten classes, near-degenerate, tangent, asymptotic", 10, 64, quadric::run),
    suite("clipped", "clip ends through hits, along rays, of no thickness", 8, 64, clipped::run),
    suite("boxes", "flat grids, rays in their planes, tiny components", 8, 256, boxes::run),
    suite("duplicate", "the same mesh twice, coplanar overlaps", 6, 256, duplicate::run),
    suite("degenerate", "bad triangles among good ones, bad rays", 6, 256, degenerate::run),
    suite("reintersect", "rays leaving hits, half of them near-tangent", 8, 1000, reintersect::run),
    suite("mirrors", "a thousand bounces in closed boxes and spheres", 10, 1000, mirrors::run),
    suite("terminator", "coarse smooth spheres; naive: uncorrected", 6, 256, terminator::run),
    suite("consistency", "symmetries that must not change an answer", 6, 64, consistency::run),
];

const fn suite(
    name: &'static str,
    about: &'static str,
    share: u32,
    block_size: u64,
    run: fn(&Block, &mut Tally),
) -> Suite {
    Suite { name, about, share, block_size, run }
}

/// Cases of a suite that run one after another on one thread.
#[derive(Clone, Debug)]
pub struct Block {
    suite: &'static str,
    seed: u64,
    /// Number of the block in the suite.
    number: u64,
    /// Numbers of the cases.
    cases: Range<u64>,
}

impl Block {
    /// Random numbers for what all cases of the block share.
    pub fn shared(&self) -> Random {
        Random::new(!self.seed, self.suite, self.number)
    }

    /// The cases, each with random numbers of its own.
    pub fn each(&self) -> impl Iterator<Item = (Case, Random)> + use<> {
        let Block { suite, seed, .. } = *self;
        self.cases.clone().map(move |number| (Case { suite, seed, number }, Random::new(seed, suite, number)))
    }
}

/// Blocks between two reports of progress; their results are all that is held at a time.
const BLOCKS_PER_ROUND: u64 = 64;

impl Suite {
    /// The suite of a name.
    pub fn named(name: &str) -> Option<Suite> {
        SUITES.into_iter().find(|suite| suite.name == name)
    }

    /// Runs so many cases on the current rayon pool. `progress` hears how many are done and may return `false` to
    /// stop: the result is then that of the cases that ran.
    pub fn run(&self, seed: u64, n_cases: u64, progress: &mut dyn FnMut(u64) -> bool) -> Tally {
        let n_blocks = n_cases.div_ceil(self.block_size);
        let mut total = Tally::default();
        let mut first = 0;
        while first < n_blocks {
            let end = n_blocks.min(first + BLOCKS_PER_ROUND);
            let run = |number| self.run_block(seed, number, n_cases);
            let round: Vec<Tally> = (first..end).into_par_iter().map(run).collect();
            round.into_iter().for_each(|tally| total.merge(tally));
            first = end;
            if !progress(total.cases.min(n_cases)) {
                break;
            }
        }
        total
    }

    /// Runs the cases of a block that lie below `end`.
    fn run_block(&self, seed: u64, number: u64, end: u64) -> Tally {
        let first = number * self.block_size;
        let cases = first..end.min(first.saturating_add(self.block_size));
        let mut tally = Tally::default();
        (self.run)(&Block { suite: self.name, seed, number, cases }, &mut tally);
        tally
    }
}

/// Shares out a number of cases among suites, at least one block to each.
pub fn share_out(suites: &[Suite], count: u64) -> Vec<u64> {
    let total: u64 = suites.iter().map(|suite| u64::from(suite.share)).sum();
    let part = |suite: &Suite| (u128::from(count) * u128::from(suite.share) / u128::from(total.max(1))) as u64;
    suites.iter().map(|suite| part(suite).max(1)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_result_does_not_depend_on_the_number_of_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| Suite::named("sphere").unwrap().run(5, 1000, &mut |_| true))
        };
        assert_eq!(run(1), run(3));
    }

    #[test]
    fn a_run_can_be_stopped() {
        let tally = Suite::named("grazing").unwrap().run(5, u64::MAX / 2, &mut |done| done < 5000);
        assert!((5000..20_000).contains(&tally.cases), "{}", tally.cases);
    }

    #[test]
    fn every_suite_gets_its_share() {
        let counts = share_out(&SUITES, 1_000_000);
        assert!(counts.iter().all(|&n| n > 10_000));
        assert!((990_000..=1_000_000).contains(&counts.iter().sum::<u64>()));
        assert!(share_out(&SUITES, 1).iter().all(|&n| n == 1));
    }
}
