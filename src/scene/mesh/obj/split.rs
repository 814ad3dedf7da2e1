//! Vertices whose corners have different normals, split.

use std::collections::HashMap;

use glam::Vec3;

use super::super::MAX_VERTICES;
use super::super::faces::Faces;
use super::super::finding::{Finding, Outcome};
use super::super::weld::Seed;
use super::piece::NO_NORMAL;

/// Normals by row of the positions, if any, and which row each new one repeats.
type Split = (Option<Vec<Vec3>>, Vec<u32>);

/// Gives each pair of a position and a normal a row of its own. A vertex keeps its row for the normal that the first of
/// its corners has; others follow behind all vertices, in the order in which faces first name them. Normals are told
/// apart by their bits, not by their rows, since many programs write one for each corner. Corners without a normal are
/// a pair too, with the normal zero.
pub(super) fn by_normal(
    positions: &mut Vec<Vec3>,
    faces: &mut Faces,
    corner_normals: &[u32],
    normals: &[Vec3],
) -> Outcome<Split> {
    let mut normal_of = vec![Vec3::ZERO; positions.len()];
    let mut is_named = vec![false; positions.len()];
    let mut more: HashMap<(u32, [u32; 3]), u32, Seed> = HashMap::with_hasher(Seed::random());
    let mut split_from = Vec::new();
    let mut normals_behind = Vec::new();
    let mut corner_normals = corner_normals.iter();
    let n_rows_free = MAX_VERTICES - positions.len();
    faces.for_each_corner(|vertex| {
        let row = corner_normals.next().copied().unwrap_or(NO_NORMAL);
        let normal = normals.get(row as usize).copied().unwrap_or(Vec3::ZERO);
        let bits = normal.to_array().map(f32::to_bits);
        let first = &mut normal_of[*vertex as usize];
        if !std::mem::replace(&mut is_named[*vertex as usize], true) {
            *first = normal;
        }
        if first.to_array().map(f32::to_bits) != bits && split_from.len() < n_rows_free {
            let next = (positions.len() + split_from.len()) as u32;
            *vertex = *more.entry((*vertex, bits)).or_insert_with_key(|&(vertex, _)| {
                split_from.push(vertex);
                normals_behind.push(normal);
                next
            });
        }
    });
    if split_from.len() >= n_rows_free {
        return Err(Finding::file("too many vertices with different normals").into());
    }
    normal_of.append(&mut normals_behind);
    positions.reserve_exact(split_from.len());
    for &vertex in &split_from {
        positions.push(positions[vertex as usize]);
    }
    Ok((Some(normal_of), split_from))
}
