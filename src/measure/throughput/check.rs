//! Whether answers are right: flatray's to the bit, a peer's as far as f32 goes.

use super::pass::{self, Answers};
use crate::accel::{Accel, AccelKind};
use crate::error::{Error, Place, Problem};
use crate::measure::embree::packet::answer;
use crate::measure::generate::hash_unit;
use crate::measure::rays::RayKind;
use crate::world::{Ray, World};

/// A peer's t is off when it differs from the exact one by more than this share of it.
const T_TOLERANCE: f64 = 1e-3;
/// Rays of a set that are judged however many primitives there are.
const LEAST_JUDGED: usize = 16;
/// Rays that a thread takes at a time: each is tested against every primitive.
const JUDGE_BATCH: usize = 4;

/// What a peer got wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Mistakes {
    /// Hits where there is none, and misses where there is one.
    pub wrong: u64,
    /// Hits whose t differs by more than a thousandth.
    pub t_off: u64,
}

/// Compares answers with those of the full scan: to all rays where `tests` primitive tests suffice for it, else to
/// some, spread evenly. Returns how many were judged.
///
/// # Errors
/// When any differs.
pub fn judge(
    world: &World,
    kind: RayKind,
    rays: &[Ray],
    answers: &Answers,
    tests: u64,
    threads: usize,
) -> Result<usize, Error> {
    // A scan tests the triangles of a prototype as often as it is placed.
    let tests_per_ray = (world.spheres.len() + world.quadrics.len()) as u64 + world.n_placed_triangles();
    let affordable = usize::try_from(tests / tests_per_ray.max(1)).unwrap_or(usize::MAX);
    let n_judged = affordable.max(LEAST_JUDGED).min(rays.len());
    // One ray from each of `n_judged` equal parts.
    let stride = rays.len() as f64 / n_judged.max(1) as f64;
    let pick = |part: usize| (((part as f64 + hash_unit(part as u64)) * stride) as usize).min(rays.len() - 1);
    let picked: Vec<usize> = (0..n_judged).map(|part| if n_judged == rays.len() { part } else { pick(part) }).collect();
    let asked: Vec<Ray> = picked.iter().map(|&ray| rays[ray]).collect();
    let mut expected = Answers::room(kind, n_judged);
    let oracle = Accel::build(world, AccelKind::Linear);
    pass::trace_batches(&oracle, world, &asked, &mut expected, threads, JUDGE_BATCH);
    let given = match answers {
        Answers::Hits(hits) => Answers::Hits(picked.iter().map(|&ray| hits[ray]).collect()),
        Answers::Occluded(occluded) => Answers::Occluded(picked.iter().map(|&ray| occluded[ray]).collect()),
    };
    same(&asked, &expected, &given, "the full scan", "the tree").map(|()| n_judged)
}

/// Compares answers bit by bit.
///
/// # Errors
/// How many differ, and the first of them.
pub fn same(rays: &[Ray], expected: &Answers, given: &Answers, expected_by: &str, given_by: &str) -> Result<(), Error> {
    let differing: Vec<usize> = match (expected, given) {
        (Answers::Hits(a), Answers::Hits(b)) => (0..rays.len()).filter(|&i| !a[i].same_bits(&b[i])).collect(),
        (Answers::Occluded(a), Answers::Occluded(b)) => (0..rays.len()).filter(|&i| a[i] != b[i]).collect(),
        _ => (0..rays.len()).collect(),
    };
    let Some(&first) = differing.first() else { return Ok(()) };
    let shown = |answers: &Answers| match answers {
        Answers::Hits(hits) => format!("{:?}", hits[first]),
        Answers::Occluded(occluded) => format!("occluded: {}", occluded[first]),
    };
    let what = format!(
        "{} of {} rays are answered differently by {expected_by} and by {given_by}; no time is reported. The first: {:?}",
        differing.len(),
        rays.len(),
        rays[first]
    );
    Err(Problem::new(Place::default(), what).found(shown(given)).expected(shown(expected)).into())
}

/// Compares a peer's answers with the exact ones; `t` may be longer than there are rays.
pub fn mistakes(exact: &Answers, t: &[f32]) -> Mistakes {
    let mut mistakes = Mistakes::default();
    match exact {
        Answers::Occluded(occluded) => {
            let differs = |(&exact, &t): (&bool, &f32)| exact != (t == answer::OCCLUDED);
            mistakes.wrong = occluded.iter().zip(t).filter(|&pair| differs(pair)).count() as u64;
        }
        Answers::Hits(hits) => {
            for (hit, &t) in hits.iter().zip(t) {
                if hit.is_some() != (t != answer::MISS) {
                    mistakes.wrong += 1;
                } else if hit.is_some() && (f64::from(t) - hit.t).abs() > T_TOLERANCE * hit.t {
                    mistakes.t_off += 1;
                }
            }
        }
    }
    mistakes
}

#[cfg(test)]
mod tests {
    use glam::{DVec3, Vec3};

    use super::*;
    use crate::world::Hit;

    fn scene() -> (World, Vec<Ray>, Answers) {
        let world = World::from_triangles(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        let rays =
            (0..100).map(|i| Ray::new(DVec3::new(0.011 * f64::from(i), 0.2, 1.0), -DVec3::Z)).collect::<Vec<_>>();
        let mut answers = Answers::room(RayKind::Primary, rays.len());
        pass::trace(&Accel::build(&world, AccelKind::Bvh), &world, &rays, &mut answers, 1);
        (world, rays, answers)
    }

    #[test]
    fn right_answers_pass_and_one_wrong_bit_in_one_of_them_does_not() {
        let (world, rays, answers) = scene();
        assert_eq!(judge(&world, RayKind::Primary, &rays, &answers, 1000, 2).unwrap(), 100);
        assert_eq!(judge(&world, RayKind::Primary, &rays, &answers, 1, 1).unwrap(), LEAST_JUDGED);

        let mut tampered = answers.clone();
        let Answers::Hits(hits) = &mut tampered else { panic!() };
        hits[40].u = hits[40].u.next_up();
        let message = judge(&world, RayKind::Primary, &rays, &tampered, 1000, 1).unwrap_err().to_string();
        assert!(message.contains("1 of 100 rays"), "{message}");
        assert!(same(&rays, &answers, &tampered, "a", "b").is_err());
        assert!(same(&rays, &answers, &answers, "a", "b").is_ok());
    }

    #[test]
    fn occlusion_is_judged_too() {
        let (world, rays, answers) = scene();
        let Answers::Hits(hits) = &answers else { panic!() };
        let mut occluded: Vec<bool> = hits.iter().map(Hit::is_some).collect();
        let right = Answers::Occluded(occluded.clone());
        assert!(judge(&world, RayKind::Shadow, &rays, &right, 1000, 1).is_ok());
        occluded[7] = !occluded[7];
        assert!(judge(&world, RayKind::Shadow, &rays, &Answers::Occluded(occluded), 1000, 1).is_err());
    }

    #[test]
    fn a_peers_mistakes_are_counted_by_kind() {
        let (_, _, answers) = scene();
        let Answers::Hits(hits) = &answers else { panic!() };
        let mut t: Vec<f32> = hits.iter().map(|hit| hit.t as f32).collect();
        t.push(0.5);
        assert_eq!(mistakes(&answers, &t), Mistakes::default());
        t[3] = answer::MISS;
        t[4] *= 1.01;
        t[99] = 1.0;
        assert_eq!(mistakes(&answers, &t), Mistakes { wrong: 2, t_off: 1 });
        let shadow = Answers::Occluded(vec![true, false, true]);
        let answered = [answer::OCCLUDED, answer::OCCLUDED, 1.0];
        assert_eq!(mistakes(&shadow, &answered), Mistakes { wrong: 2, t_off: 0 });
    }
}
