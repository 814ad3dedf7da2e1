//! Which slot of a node each child takes.

use glam::DVec3;

use super::slab::WIDTH;
use crate::world::Bounds;

/// Slots for up to eight children: bit k of a slot is set where the child lies more to the positive side of axis k.
///
/// Ylitie, Karras and Laine (2017) maximise the sum of (center of child − center of node) · (signs of slot) by auction;
/// taking the best pair of child and slot again and again comes close and costs less.
pub fn assign(children: &[Bounds]) -> [usize; WIDTH] {
    let mut slots = [0; WIDTH];
    let Some(whole) = children.iter().copied().reduce(Bounds::union) else { return slots };
    let center = whole.center();
    let mut gains = [[TAKEN; WIDTH]; WIDTH];
    for (gains, child) in gains.iter_mut().zip(children) {
        let offset = child.center() - center;
        *gains = std::array::from_fn(|slot| {
            let sign = |axis: usize| if slot >> axis & 1 == 1 { 1.0 } else { -1.0 };
            offset.dot(DVec3::new(sign(0), sign(1), sign(2)))
        });
    }
    // The best free slot of each child; only those whose slot is taken look again.
    let mut best: [usize; WIDTH] = std::array::from_fn(|child| best_slot(&gains[child]));
    for _ in children {
        let mut next = 0;
        for child in 1..children.len() {
            if gains[child][best[child]] > gains[next][best[next]] {
                next = child;
            }
        }
        let slot = best[next];
        slots[next] = slot;
        gains[next] = [TAKEN; WIDTH];
        for child in 0..children.len() {
            gains[child][slot] = TAKEN;
            if best[child] == slot {
                best[child] = best_slot(&gains[child]);
            }
        }
    }
    slots
}

/// Less than any gain: boxes are finite.
const TAKEN: f64 = f64::NEG_INFINITY;

fn best_slot(gains: &[f64; WIDTH]) -> usize {
    (1..WIDTH).fold(0, |best, slot| if gains[slot] > gains[best] { slot } else { best })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn cube(at: Vec3) -> Bounds {
        Bounds { lo: at - 0.4, hi: at + 0.4 }
    }

    #[test]
    fn eight_octants_take_their_own_slots_whatever_their_order() {
        for stride in [1, 3, 5, 7] {
            let octants: Vec<usize> = (0..8).map(|i| i * stride % 8).collect();
            let corner = |i: usize| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32);
            let boxes: Vec<Bounds> = octants.iter().map(|&octant| cube(corner(octant))).collect();
            assert_eq!(assign(&boxes).to_vec(), octants);
        }
    }

    #[test]
    fn slots_differ_even_where_children_do_not() {
        for n in 1..=8 {
            let mut slots = assign(&vec![cube(Vec3::ONE); n])[..n].to_vec();
            slots.sort_unstable();
            slots.dedup();
            assert_eq!(slots.len(), n);
        }
    }

    #[test]
    fn of_two_children_along_an_axis_the_upper_has_its_bit_set() {
        for axis in 0..3 {
            let mut at = Vec3::ZERO;
            at[axis] = 1.0;
            let slots = assign(&[cube(at), cube(-at)]);
            assert_eq!((slots[0] >> axis & 1, slots[1] >> axis & 1), (1, 0));
        }
    }
}
