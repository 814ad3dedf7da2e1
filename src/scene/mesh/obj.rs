//! Wavefront OBJ: positions, faces, and if asked for normals and materials. (Wavefront, "Advanced Visualizer" manual,
//! appendix B1.)
//!
//! Read are `v` (extra values, a weight or a colour, are ignored) and `f` with indices from 1, or negative from the end
//! of what stands above. A face may name vertices that only follow later. Where asked for, `vn` and the normals of
//! corners are read, and `mtllib` and `usemtl`. Everything else is ignored: textures and groups silently, lines, points
//! and unknown statements with a warning. Bytes need not be UTF-8.
//!
//! The text is cut into pieces of whole statements. All threads count the vertices of all pieces first: then each piece
//! knows what its indices mean and where its vertices go, and all threads read. Where pieces begin does not depend on
//! the number of threads, and what is found in them is put together in the order of the file.

mod cursor;
pub(super) mod library;
mod mtl;
mod piece;
mod split;

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use super::faces::Faces;
use super::finding::{At, Finding, Outcome, counted, quoted};
use super::number::token;
use super::{Attributes, MAX_VERTICES};
use cursor::{Cursor, piece_bounds};
use piece::{Contents, Counts, Piece};

/// Bytes of a piece: enough that a thread is not woken for nothing, few enough that all threads have work.
const PIECE_BYTES: usize = 256 << 10;

/// Pieces that are read before they are put together, so that little is held twice.
const PIECES_TOGETHER: usize = 64;

/// The fewest bytes of a vertex or a normal: `v 0 0 0` and the end of its line. A file with more of them than its size
/// allows has a broken one, and gets no table that it could not fill.
const LEAST_VERTEX_BYTES: usize = 8;

/// A file that was read.
#[derive(Debug)]
pub(super) struct Obj {
    pub positions: Vec<Vec3>,
    pub faces: Faces,
    /// Where asked for, and when a face has any: one per position, as it stands in the file; zero where there is none.
    pub normals: Option<Vec<Vec3>>,
    /// Rows at the end of `positions` that repeat an earlier one with another normal: which.
    pub split_from: Vec<u32>,
    pub materials: MaterialStatements,
    /// Things mended or ignored.
    pub findings: Vec<Finding>,
}

/// What a file says about materials; names stand as they are in the file.
#[derive(Debug, Default)]
pub(super) struct MaterialStatements {
    /// `mtllib`: offset, and what follows.
    pub libraries: Vec<(usize, Vec<u8>)>,
    /// Names of `usemtl`, each once, and the offset of the first.
    pub names: Vec<(usize, Vec<u8>)>,
    /// `usemtl` in the order of the file as rows of `names`, one for each mark of the faces.
    pub uses: Vec<u32>,
}

/// Reads a whole file.
///
/// # Errors
/// At the first line where a coordinate is no number, an index is no whole number or names no vertex; and when the text
/// is no OBJ at all.
pub(super) fn parse(bytes: &[u8], wanted: Attributes) -> Outcome<Obj> {
    parse_in_pieces(bytes, wanted, PIECE_BYTES)
}

fn parse_in_pieces(bytes: &[u8], wanted: Attributes, piece_bytes: usize) -> Outcome<Obj> {
    let bounds = piece_bounds(bytes, piece_bytes);

    // What stands before each piece.
    let counts: Vec<Counts> = bounds.par_windows(2).map(|piece| piece::count(&bytes[..piece[1]], piece[0])).collect();
    let total = counts.iter().fold(Counts::default(), |sum, &counts| sum.plus(counts));
    if total.vertices.max(total.normals) > MAX_VERTICES {
        return Err(Finding::file("too many vertices").expected(format!("at most {MAX_VERTICES}")).into());
    }

    // Read, each piece into its own rows.
    let n_rows_at_most = bytes.len() / LEAST_VERTEX_BYTES + 1;
    let mut positions = vec![Vec3::ZERO; total.vertices.min(n_rows_at_most)];
    let n_normals = if wanted.normals { total.normals.min(n_rows_at_most) } else { 0 };
    let mut normals = vec![Vec3::ZERO; n_normals];
    let mut whole = Contents::default();
    let (mut free_positions, mut free_normals) = (positions.as_mut_slice(), normals.as_mut_slice());
    let mut before = Counts::default();
    let pieces: Vec<(&[usize], &Counts)> = bounds.windows(2).zip(&counts).collect();
    for pieces in pieces.chunks(PIECES_TOGETHER) {
        let mut work = Vec::with_capacity(pieces.len());
        for &(bound, &counts) in pieces {
            let positions = take_rows(&mut free_positions, counts.vertices);
            let normals = take_rows(&mut free_normals, counts.normals);
            work.push(Piece { bytes: &bytes[..bound[1]], start: bound[0], before, total, positions, normals });
            before = before.plus(counts);
        }
        let read: Vec<Outcome<Contents>> = work.into_par_iter().map(|piece| piece::read(piece, wanted)).collect();
        for contents in read {
            whole.append(contents?);
        }
    }
    finish(bytes, positions, normals, whole)
}

/// The next rows of a table, as many as are left.
fn take_rows<'a>(free: &mut &'a mut [Vec3], n_rows: usize) -> &'a mut [Vec3] {
    let n_rows = n_rows.min(free.len());
    let (rows, rest) = std::mem::take(free).split_at_mut(n_rows);
    *free = rest;
    rows
}

impl Contents {
    /// Puts what follows in the file behind this.
    fn append(&mut self, next: Contents) {
        let Contents {
            faces,
            corner_normals,
            materials,
            libraries,
            n_known_statements,
            lines_and_points,
            unknown,
            lost_normals,
        } = next;
        self.faces.append(faces);
        self.corner_normals.extend(corner_normals);
        self.materials.extend(materials);
        self.libraries.extend(libraries);
        self.n_known_statements += n_known_statements;
        self.lines_and_points.append(lines_and_points);
        self.unknown.append(unknown);
        self.lost_normals.append(lost_normals);
    }
}

fn finish(bytes: &[u8], mut positions: Vec<Vec3>, normals: Vec<Vec3>, contents: Contents) -> Outcome<Obj> {
    let findings = findings(bytes, &contents)?;
    let Contents { mut faces, corner_normals, materials, libraries, .. } = contents;
    let has_normals = corner_normals.iter().any(|&row| row != piece::NO_NORMAL);
    let (normals, split_from) = match has_normals {
        true => split::by_normal(&mut positions, &mut faces, &corner_normals, &normals)?,
        false => (None, Vec::new()),
    };
    let materials = material_statements(bytes, &materials, &libraries);
    Ok(Obj { positions, faces, normals, split_from, materials, findings })
}

fn findings(bytes: &[u8], contents: &Contents) -> Outcome<Vec<Finding>> {
    let mut findings: Vec<Finding> = Vec::new();
    let Contents { n_known_statements, lines_and_points, unknown, lost_normals, .. } = contents;
    if let Some(unknown) =
        unknown.finding(|count| format!("{} ignored", counted(count, "unknown statement is", "unknown statements are")))
    {
        let At::Line(start) = unknown.at else { return Err(unknown.into()) };
        let found = quoted(token(bytes, start));
        if *n_known_statements == 0 {
            return Err(Finding::line(start, "this is not an OBJ file")
                .found(found)
                .expected("statements like `v X Y Z` and `f I J K`")
                .into());
        }
        findings.push(unknown.found(found));
    }
    findings.extend(lines_and_points.finding(|count| {
        format!("{} ignored", counted(count, "line or point element is", "line and point elements are"))
    }));
    findings.extend(lost_normals.finding(|count| {
        let corners = counted(count, "corner names", "corners name");
        format!("{corners} a normal that does not exist, and will be shaded by the faces around")
    }));
    Ok(findings)
}

fn material_statements(bytes: &[u8], uses: &[usize], libraries: &[usize]) -> MaterialStatements {
    let argument = |start: usize| {
        let keyword = token(bytes, start);
        Cursor { bytes, at: start + keyword.len() }.rest_of_statement()
    };
    let mut names = Vec::new();
    let mut rows: HashMap<Vec<u8>, u32> = HashMap::new();
    let uses = uses.iter().map(|&start| {
        let name = argument(start);
        *rows.entry(name).or_insert_with_key(|name| {
            names.push((start, name.clone()));
            names.len() as u32 - 1
        })
    });
    let uses = uses.collect();
    MaterialStatements { libraries: libraries.iter().map(|&start| (start, argument(start))).collect(), names, uses }
}

#[cfg(test)]
mod tests;
