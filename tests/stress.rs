//! Every suite of `flatray stress` at a small count with a fixed seed. `FLATRAY_TEST_SCALE` multiplies the counts.

use flatray::measure::stress::case::Replay;
use flatray::measure::stress::replay::replay;
use flatray::measure::stress::{SUITES, Suite, worst_case};

const SEED: u64 = 20_261_122;

fn multiplier() -> u64 {
    std::env::var("FLATRAY_TEST_SCALE").ok().and_then(|text| text.parse().ok()).unwrap_or(1)
}

fn nothing_is_wrong_in(name: &str) {
    let suite = Suite::named(name).unwrap();
    let n_cases = 3000 * multiplier();
    let tally = suite.run(SEED, n_cases, &mut |_| true);
    assert_eq!(tally.cases, n_cases);
    assert_eq!((tally.wrong, tally.inaccurate), (0, 0), "seed {SEED}: {:#?}", tally.failures);
    assert!(tally.max_ulp_t <= 1.0 && tally.max_ulp_t_f32 <= 1.0, "{tally:?}");
    assert!(tally.judged > 0, "nothing was judged");
}

macro_rules! suites {
    ($($name:ident)*) => {
        $(#[test]
        fn $name() {
            nothing_is_wrong_in(stringify!($name));
        })*

        #[test]
        fn every_suite_is_tested() {
            assert_eq!(SUITES.map(|suite| suite.name), [$(stringify!($name)),*]);
        }
    };
}

suites! {
    watertight scale offset grazing sphere quadric clipped boxes duplicate degenerate reintersect mirrors terminator consistency
}

#[test]
fn textbooks_are_caught_by_the_same_oracle() {
    let sphere = Suite::named("sphere").unwrap().run(SEED, 2000, &mut |_| true);
    assert!(sphere.naive_f32.wrong * 10 > sphere.naive_f32.cases, "{sphere:?}");
    let grazing = Suite::named("grazing").unwrap().run(SEED, 2000, &mut |_| true);
    assert!(grazing.moller_trumbore_f32.wrong * 10 > grazing.moller_trumbore_f32.cases, "{grazing:?}");
}

#[test]
fn a_case_can_be_replayed_by_its_number_and_by_its_numbers() {
    let by_number = Replay::parse("boxes#300 seed=1").unwrap();
    assert!(replay(&by_number).unwrap().right);
    let by_numbers = Replay::parse("sphere#1 seed=1 o=-0x1p+1,0x1p+0,0x0p+0 d=1,0,0 prim=sphere(0,0,0,1)").unwrap();
    let replayed = replay(&by_numbers).unwrap();
    assert!(replayed.right && replayed.report.contains("hit at t = 2e0"), "{}", replayed.report);
    assert!(replay(&Replay::parse("nothing#1").unwrap()).is_err());
}

#[test]
fn hill_climbing_finds_no_error_above_its_bound() {
    for found in worst_case::search(SEED, 20, 300 * multiplier()) {
        eprintln!("{}: {:.4}", found.bound, found.ratio);
        assert!(found.ratio < 1.0, "{found:?}");
        assert!(found.ratio > 0.01, "the search finds nothing near the bound: {found:?}");
    }
}
