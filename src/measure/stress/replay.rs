//! A case again, with everything there is to say about it.

use super::case::Replay;
use super::hexadecimal::hex;
use super::primitive::Primitive;
use super::{Suite, Tally, probe, textbook};
use crate::measure::oracle::judge::judge;
use crate::world::Ray;

/// What a replay found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Replayed {
    /// Whether the case is answered rightly now.
    pub right: bool,
    /// Lines for people.
    pub report: String,
}

/// Runs a case again.
///
/// # Errors
/// When the suite is not known.
pub fn replay(case: &Replay) -> Result<Replayed, String> {
    match case {
        Replay::Single { ray, primitive } => Ok(single(ray, primitive)),
        Replay::Numbered { suite, seed, number } => {
            let suite = Suite::named(suite).ok_or_else(|| format!("unknown suite '{suite}'"))?;
            let block = number / suite.block_size;
            let tally = suite.run_block(*seed, block, number + 1);
            let name = format!("{}#{number} ", suite.name);
            let own: Vec<&String> = tally.failures.iter().filter(|text| text.starts_with(&name)).collect();
            let mut report =
                format!("cases {} to {number} of {} were run again\n", block * suite.block_size, suite.name);
            tally.failures.iter().for_each(|text| report.push_str(&format!("failed     {text}\n")));
            let kept_all = tally.wrong + tally.inaccurate == tally.failures.len() as u64;
            let right = if kept_all { own.is_empty() } else { tally.wrong + tally.inaccurate == 0 };
            report.push_str(if right { "verdict    right\n" } else { "verdict    WRONG\n" });
            Ok(Replayed { right, report })
        }
    }
}

fn single(ray: &Ray, primitive: &Primitive) -> Replayed {
    let (world, prim) = primitive.world();
    let mut tally = Tally::default();
    let hit = tally.watch(|| ray.prepare().and_then(|ray| prim.intersect(&world, &ray)));
    let truth = probe::truth(ray, primitive);
    let judged = judge(truth.as_ref(), hit.map(|hit| hit.t), ray.t_min, ray.t_max);
    let roots = match &truth {
        None => "none: the line does not meet the primitive, or lies in it".to_owned(),
        Some(roots) if roots.n_roots() == 1 => format!("{:e}", roots.approximate_root(false)),
        Some(roots) => format!("{:e} and {:e}", roots.approximate_root(false), roots.approximate_root(true)),
    };
    let answer = match hit {
        None => "miss".to_owned(),
        Some(hit) => format!("hit at t = {:e} = {}, u = {:e}, v = {:e}", hit.t, hex(hit.t), hit.u, hit.v),
    };
    let yes_no = |hits: bool| if hits { "hit" } else { "miss" };
    let mut report = format!(
        "origin     {:?}\ndirection  {:?}\ninterval   ({:e}, {:e})\nprimitive  {primitive:?}\nexact      {roots}\n\
         kernel     {answer}\nexact tier {}\nerror of t {:e} ulp\nnaive f32  {}\n",
        ray.origin,
        ray.direction,
        ray.t_min,
        ray.t_max,
        if tally.exact_tests > 0 { "needed" } else { "not needed" },
        judged.ulps,
        yes_no(textbook::naive(ray, primitive)),
    );
    if let Some(hits) = textbook::moller_trumbore_hits(ray, primitive) {
        report.push_str(&format!("MT f32     {}\n", yes_no(hits)));
    }
    let case = super::Case { suite: "replay", seed: 0, number: 0 };
    probe::judge_hit(&mut tally, &case, ray, (&world, prim), truth.as_ref(), hit);
    report.push_str(&format!("error of p {:e} ulp\nerror of n {:e}\n", tally.max_ulp_p, tally.max_err_n));
    let right = judged.right && tally.inaccurate == 0;
    report.push_str(if right { "verdict    right\n" } else { "verdict    WRONG\n" });
    Replayed { right, report }
}
