//! Leaves of triangles against a packet.

use super::super::coherence::{N_LANES, Packet};
use super::super::walk::Pending;
use super::super::wide::{N_COORDINATES, Tag, WideTree};
use super::{Found, Meeting, PacketQuery};
use crate::numeric::lane::LaneEdges;
use crate::simd::{F32Lanes, MaskLanes, Simd, set_bits};

/// Tests a leaf of triangles; whether any ray may have met one.
#[inline(always)]
pub fn test_leaf<S: Simd, Q: PacketQuery>(
    simd: S,
    tree: &WideTree,
    packet: &Packet,
    found: &mut Found<Q::Answer>,
    first: u32,
    tag: Tag,
) -> bool {
    let n_prims = tag.n_prims();
    let seen = packet.shear.edges(simd, &tree.corners, N_COORDINATES * first as usize, n_prims);
    let all = (1 << n_prims) - 1;
    let open = [packet.spans[0].open(simd, &seen) & all, packet.spans[1].open(simd, &seen) & all];
    if open == [0; N_LANES] {
        return false;
    }
    let mut any = false;
    let columns = seen.columns();
    for (lanes, triangles) in open.into_iter().enumerate() {
        let (dx, dy) = (simd.load(&packet.dx[lanes]), simd.load(&packet.dy[lanes]));
        for lane in set_bits(triangles) {
            let edges: LaneEdges<S::F32> = columns.edges(simd, lane, dx, dy);
            let open = edges.open();
            if open.bits() == 0 {
                continue;
            }
            let (t_low, t_high) = edges.t_ranges(simd, simd.load(&packet.reciprocal[lanes]), simd.splat(packet.slack));
            let [min_above, min_below] = &packet.t_min;
            let outside = simd.load(&found.t_max[lanes]).lt(t_low) | t_high.lt(simd.load(&min_below[lanes]));
            let open = open & !outside;
            if open.bits() == 0 {
                continue;
            }
            let within = simd.load(&min_above[lanes]).lt(t_low) & t_high.lt(simd.load(&packet.t_max[1][lanes]));
            let certain = open & edges.certain() & within;
            let t_high = t_high.select(certain, simd.splat(f32::INFINITY));
            let candidate = Pending::new(first, tag, lane);
            let (open, certain) = (open.bits(), certain.bits());
            Q::meet(simd, tree, found, &Meeting { lanes, candidate, open, certain, t_low, t_high });
            any = true;
        }
    }
    any
}
