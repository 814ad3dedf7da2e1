//! The name of a case, and its text: enough to run it again.

use super::hexadecimal::{Reader, hex, hex_list};
use super::primitive::Primitive;
use crate::world::Ray;

/// Which case of which run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// Suite.
    pub suite: &'static str,
    /// Seed of the run.
    pub seed: u64,
    /// Number in the suite.
    pub number: u64,
}

/// A case to run again.
#[derive(Clone, Debug, PartialEq)]
pub enum Replay {
    /// A ray against a primitive, given in full.
    Single {
        /// Ray.
        ray: Ray,
        /// Primitive.
        primitive: Box<Primitive>,
    },
    /// A case of a suite by its number: its scene is made again.
    Numbered {
        /// Name of the suite.
        suite: String,
        /// Seed.
        seed: u64,
        /// Number in the suite.
        number: u64,
    },
}

impl Case {
    /// The text of the case: `sphere#17 seed=1 o=0x1p+0,… d=… t=0x0p+0,inf prim=sphere(…)`. Without a primitive the
    /// ray only informs: a replay makes the scene again from seed and number.
    pub fn text(&self, ray: &Ray, primitive: Option<&Primitive>) -> String {
        let Case { suite, seed, number } = self;
        let (o, d) = (hex_list(ray.origin.to_array()), hex_list(ray.direction.to_array()));
        let interval = format!("{},{}", hex(ray.t_min), hex(ray.t_max));
        let prim = primitive.map(|primitive| format!(" prim={}", primitive.text())).unwrap_or_default();
        format!("{suite}#{number} seed={seed} o={o} d={d} t={interval}{prim}")
    }
}

impl Replay {
    /// Reads the text of a case.
    ///
    /// # Errors
    /// With what was expected.
    pub fn parse(text: &str) -> Result<Replay, String> {
        let mut words = text.split_whitespace();
        let name = words.next().ok_or("expected a case such as 'sphere#17 seed=1'")?;
        let (suite, number) = name.split_once('#').ok_or("expected SUITE#NUMBER first")?;
        let number = number.parse().map_err(|_| "expected a number after '#'".to_owned())?;
        let mut seed = 1;
        let (mut origin, mut direction, mut interval, mut primitive) = (None, None, None, None);
        for word in words {
            // What follows in brackets is a remark.
            let Some((key, value)) = word.split_once('=') else { break };
            match key {
                "seed" => seed = value.parse().map_err(|_| format!("expected a whole number, found '{value}'"))?,
                "o" => origin = Some(read(value, 3)?),
                "d" => direction = Some(read(value, 3)?),
                "t" => interval = Some(read(value, 2)?),
                "prim" => primitive = Some(Primitive::parse(value)?),
                _ => return Err(format!("unknown key '{key}': expected seed, o, d, t or prim")),
            }
        }
        match (origin, direction, primitive) {
            (Some(origin), Some(direction), Some(primitive)) => {
                let ray = Ray::new(origin.vector(0), direction.vector(0));
                let ray = interval.map_or(ray, |t| Ray { t_min: t.number(0), t_max: t.number(1), ..ray });
                Ok(Replay::Single { ray, primitive: Box::new(primitive) })
            }
            (_, _, Some(_)) => Err("a primitive needs a ray: o=x,y,z d=x,y,z".to_owned()),
            _ => Ok(Replay::Numbered { suite: suite.to_owned(), seed, number }),
        }
    }
}

fn read(text: &str, n: usize) -> Result<Reader, String> {
    let numbers = Reader::new(text)?;
    numbers.exactly(n).map(|()| numbers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::numeric::clip::Clip;
    use crate::numeric::quadric::Quadric;
    use glam::{DMat4, DVec3, Vec3, dvec3};

    #[test]
    fn a_case_is_read_back_bit_for_bit() {
        let case = Case { suite: "sphere", seed: 7, number: 12 };
        let ray = Ray::new(dvec3(0.1, -0.0, 1e300), dvec3(5e-324, 2.0, -3.0)).until(7.7);
        let primitives = [
            Primitive::Sphere { center: dvec3(0.1, 0.2, 0.3), radius: 1e-3 },
            Primitive::Triangle([Vec3::splat(0.1), Vec3::X, Vec3::NEG_Y]),
            Primitive::Clipped(
                Quadric::from_matrix(DMat4::IDENTITY),
                Clip::world_box(dvec3(0.1, f64::NEG_INFINITY, 0.0), DVec3::INFINITY),
            ),
        ];
        for primitive in primitives {
            let text = case.text(&ray, Some(&primitive));
            assert_eq!(Replay::parse(&text), Ok(Replay::Single { ray, primitive: Box::new(primitive) }));
        }
        let numbered = Replay::Numbered { suite: "sphere".to_owned(), seed: 7, number: 12 };
        assert_eq!(Replay::parse(&case.text(&ray, None)), Ok(numbered));
    }

    #[test]
    fn nonsense_is_refused_in_words() {
        for wrong in ["", "sphere", "sphere#x", "sphere#1 o=1,2", "sphere#1 what=3", "sphere#1 prim=cube(1)"] {
            assert!(Replay::parse(wrong).unwrap_err().contains(|c: char| c.is_alphabetic()), "{wrong}");
        }
        assert!(Replay::parse("sphere#1 prim=sphere(0,0,0,1)").unwrap_err().contains("needs a ray"));
    }
}
