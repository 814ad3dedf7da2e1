//! Bytes as a case, for a fuzzer: one ray against one primitive, the kernel against the oracle.
//!
//! The first byte says what kind of primitive the rest is and how numbers are written: as the bits of floats, which
//! reach everything that there is; as small integers, which meet exactly; or as integers times powers of two. Then come
//! origin, direction, the primitive's numbers, and the ends of the interval. Bytes that are missing are zero, and an
//! interval without bytes is all of the ray.

use glam::{DVec3, Vec3};

use super::case::Case;
use super::primitive::Primitive;
use super::probe;
use crate::measure::oracle::judge::judge;
use crate::numeric::double::{is_tame, is_tame3};
use crate::numeric::quadric::Quadric;
use crate::world::Ray;

/// How numbers are written.
#[derive(Clone, Copy)]
enum Form {
    /// f64 of 8 bytes, little-endian; f32 of 4.
    Bits,
    /// One byte, a signed integer.
    Integer,
    /// A signed integer of two bytes, times 2 to the power of a signed byte.
    Scaled,
}

struct Reader<'a> {
    bytes: &'a [u8],
    form: Form,
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let mut taken = [0; N];
        let n = N.min(self.bytes.len());
        let (head, rest) = self.bytes.split_at(n);
        taken[..n].copy_from_slice(head);
        self.bytes = rest;
        taken
    }

    fn number(&mut self) -> f64 {
        match self.form {
            Form::Bits => f64::from_le_bytes(self.take()),
            Form::Integer => f64::from(i8::from_le_bytes(self.take())),
            Form::Scaled => {
                let integer = f64::from(i16::from_le_bytes(self.take()));
                libm::ldexp(integer, i32::from(i8::from_le_bytes(self.take())))
            }
        }
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.number(), self.number(), self.number())
    }

    fn corner(&mut self) -> Vec3 {
        let mut single = || match self.form {
            Form::Bits => f32::from_le_bytes(self.take()),
            Form::Integer | Form::Scaled => self.number() as f32,
        };
        Vec3::new(single(), single(), single())
    }
}

/// The case that bytes stand for; `None` for a primitive that no table holds.
pub fn decode(bytes: &[u8]) -> Option<(Ray, Primitive)> {
    let (&first, bytes) = bytes.split_first()?;
    let form = match first / 3 % 3 {
        0 => Form::Bits,
        1 => Form::Integer,
        _ => Form::Scaled,
    };
    let mut reader = Reader { bytes, form };
    let mut ray = Ray::new(reader.vector(), reader.vector());
    let primitive = match first % 3 {
        0 => {
            let corners = [reader.corner(), reader.corner(), reader.corner()];
            corners.iter().all(|corner| corner.is_finite()).then_some(Primitive::Triangle(corners))?
        }
        1 => {
            let (center, radius) = (reader.vector(), reader.number().abs());
            let sound = center.is_finite() && radius.is_finite() && radius > 0.0;
            sound.then_some(Primitive::Sphere { center, radius })?
        }
        _ => {
            let rows = [reader.vector(), reader.vector(), reader.vector(), reader.vector()];
            let constant = reader.number();
            let finite = rows.iter().all(|row| row.is_finite()) && constant.is_finite();
            let [center, diagonal, off_diagonal, linear] = rows;
            let tame = rows.into_iter().all(is_tame3) && is_tame(constant);
            let row = Quadric { center, diagonal, off_diagonal, linear, constant, tame };
            finite.then_some(Primitive::Quadric(row))?
        }
    };
    if !reader.bytes.is_empty() {
        // The oracle knows intervals that begin at 0 or later.
        ray.t_min = reader.number().abs();
    }
    if !reader.bytes.is_empty() {
        ray.t_max = reader.number();
    }
    Some((ray, primitive))
}

/// Asks the kernel and lets the oracle judge the decision and t.
///
/// # Errors
/// With the text of the case, for `flatray stress --replay`, when the kernel is wrong.
pub fn check(bytes: &[u8]) -> Result<(), String> {
    let Some((ray, primitive)) = decode(bytes) else { return Ok(()) };
    let (world, prim) = primitive.world();
    let hit = ray.prepare().and_then(|ray| prim.intersect(&world, &ray));
    let truth = probe::truth(&ray, &primitive);
    if judge(truth.as_ref(), hit.map(|hit| hit.t), ray.t_min, ray.t_max).right {
        return Ok(());
    }
    Err(Case { suite: "fuzz", seed: 0, number: 0 }.text(&ray, Some(&primitive)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::dvec3;

    #[test]
    fn bytes_are_read_as_documented() {
        let integers = [4, 0, 0, 254, 0, 0, 1, 1, 2, 3, 251];
        let sphere = Primitive::Sphere { center: dvec3(1.0, 2.0, 3.0), radius: 5.0 };
        assert_eq!(decode(&integers), Some((Ray::new(dvec3(0.0, 0.0, -2.0), DVec3::Z), sphere)));
        let (ray, _) = decode(&[&integers[..], &[7, 9]].concat()).unwrap();
        assert_eq!((ray.t_min, ray.t_max), (7.0, 9.0));
        let scaled: Vec<u8> = [vec![7], [3, 0, 255].repeat(10)].concat();
        let sphere = Primitive::Sphere { center: DVec3::splat(1.5), radius: 1.5 };
        assert_eq!(decode(&scaled), Some((Ray::new(DVec3::splat(1.5), DVec3::splat(1.5)), sphere)));
        let bits: Vec<u8> = std::iter::once(0)
            .chain(1.5f64.to_le_bytes().repeat(6))
            .chain((0..9).flat_map(|i| (i as f32).to_le_bytes()))
            .collect();
        let (ray, primitive) = decode(&bits).unwrap();
        let corner = |i: usize| Vec3::new(i as f32, i as f32 + 1.0, i as f32 + 2.0);
        assert_eq!((ray.direction, primitive), (DVec3::splat(1.5), Primitive::Triangle([0, 3, 6].map(corner))));
        assert_eq!((decode(&[]), decode(&[1])), (None, None), "no bytes, and a sphere without a radius");
    }
}
