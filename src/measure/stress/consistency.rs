//! Symmetries that must not change an answer, on input that they map exactly.

use glam::{DMat4, DVec3, Vec3, dvec3};

use super::primitive::Primitive;
use super::random::Random;
use super::{Block, Tally, probe};
use crate::numeric::clip::Clip;
use crate::numeric::quadric::Quadric;
use crate::world::Ray;

/// A suite.
pub fn run(block: &Block, tally: &mut Tally) {
    for (case, mut random) in block.each() {
        let (ray, primitive) = exact_case(&mut random);
        let hit = probe::check(tally, &case, &ray, &primitive).map(|hit| hit.t);
        let mut expect = |same: bool, what: &str| {
            if !same {
                tally.fail(format!("{} ({what})", case.text(&ray, Some(&primitive))));
            }
        };
        expect(splits(&mut random, &ray, &primitive, hit), "changes when the ray is cut");
        expect(turns(&mut random, &ray, &primitive, hit), "changes when axes are exchanged");
        match &primitive {
            Primitive::Sphere { center, radius } => {
                let as_quadric = Primitive::Quadric(Quadric::from_matrix(sphere_matrix(*center, *radius)));
                expect(ask(&ray, &as_quadric).is_some() == hit.is_some(), "differs from its quadric");
            }
            Primitive::Quadric(row) => {
                let factor = random.sign() * random.power_of_two(-60, 60);
                let times = Quadric {
                    diagonal: row.diagonal * factor,
                    off_diagonal: row.off_diagonal * factor,
                    linear: row.linear * factor,
                    constant: row.constant * factor,
                    ..*row
                };
                expect(ask(&ray, &Primitive::Quadric(times)) == hit, "changes with a factor");
            }
            // They have a suite of their own.
            Primitive::Clipped(..) => {}
            Primitive::Triangle([a, b, c]) => {
                let same = |corners| ask(&ray, &Primitive::Triangle(corners)).is_some() == hit.is_some();
                expect(same([*b, *c, *a]) && same([*a, *c, *b]), "changes with the order of corners");
            }
        }
    }
}

fn ask(ray: &Ray, primitive: &Primitive) -> Option<f64> {
    let (world, prim) = primitive.world();
    ray.prepare().and_then(|ray| prim.intersect(&world, &ray)).map(|hit| hit.t)
}

/// Numbers of few bits, in which ties are frequent.
fn exact_case(random: &mut Random) -> (Ray, Primitive) {
    let unit = random.power_of_two(-10, 10);
    let point = |random: &mut Random| unit * random.grid(8);
    let primitive = match random.below(3) {
        0 => Primitive::Triangle([0; 3].map(|_| point(random).as_vec3())),
        1 => Primitive::Sphere { center: point(random), radius: unit * random.integer(1, 8) as f64 },
        _ => {
            let (diagonal, off_diagonal) =
                (random.grid(4), if random.chance(0.5) { DVec3::ZERO } else { random.grid(3) });
            let (linear, constant) = (unit * random.grid(4), unit * unit * random.integer(-16, 16) as f64);
            let center = point(random);
            Primitive::Quadric(Quadric { center, diagonal, off_diagonal, linear, constant, tame: true })
        }
    };
    let origin = point(random);
    let mut direction = random.grid(8);
    if direction == DVec3::ZERO {
        direction = DVec3::Z;
    }
    (Ray::new(origin, direction), primitive)
}

/// Cut at s, the two parts know what the whole knows; the ends are open.
fn splits(random: &mut Random, ray: &Ray, primitive: &Primitive, hit: Option<f64>) -> bool {
    let s = match hit {
        Some(t) if random.chance(0.5) => [t, t.next_up(), t.next_down()][random.below(3) as usize],
        _ => random.log_uniform(0.01, 100.0),
    };
    let before = ask(&ray.until(s), primitive);
    let after = ask(&Ray { t_min: s, ..*ray }, primitive);
    match hit {
        Some(t) if t < s => before == hit,
        Some(t) if t > s => before.is_none() && after == hit,
        Some(_) => before.is_none(),
        None => before.is_none() && after.is_none(),
    }
}

/// Exchanges and reflects the axes of ray and primitive.
fn turns(random: &mut Random, ray: &Ray, primitive: &Primitive, hit: Option<f64>) -> bool {
    let first = random.below(3) as usize;
    let mirrored = random.chance(0.5);
    let axes =
        if mirrored { [first, (first + 2) % 3, (first + 1) % 3] } else { [first, (first + 1) % 3, (first + 2) % 3] };
    let signs = dvec3(random.sign(), random.sign(), random.sign());
    let pick = |v: DVec3| dvec3(v[axes[0]], v[axes[1]], v[axes[2]]);
    let turn = |v: DVec3| pick(v) * signs;
    // An off-diagonal entry is named by the axis it leaves out, and changes sign with the product of the others.
    let turn_pairs = |v: DVec3| pick(v) * dvec3(signs.y * signs.z, signs.x * signs.z, signs.x * signs.y);
    let turn_row = |row: &Quadric| Quadric {
        center: turn(row.center),
        diagonal: pick(row.diagonal),
        off_diagonal: turn_pairs(row.off_diagonal),
        linear: turn(row.linear),
        ..*row
    };
    let turned = match primitive {
        Primitive::Triangle(corners) => {
            Primitive::Triangle(corners.map(|corner: Vec3| turn(corner.as_dvec3()).as_vec3()))
        }
        Primitive::Sphere { center, radius } => Primitive::Sphere { center: turn(*center), radius: *radius },
        Primitive::Quadric(row) => Primitive::Quadric(turn_row(row)),
        Primitive::Clipped(row, clip) => {
            Primitive::Clipped(turn_row(row), Clip { center: turn(clip.center), rows: clip.rows.map(turn), ..*clip })
        }
    };
    let ray = Ray { origin: turn(ray.origin), direction: turn(ray.direction), ..*ray };
    ask(&ray, &turned).is_some() == hit.is_some()
}

fn sphere_matrix(center: DVec3, radius: f64) -> DMat4 {
    let constant = center.length_squared() - radius * radius;
    DMat4::from_cols(
        DVec3::X.extend(-center.x),
        DVec3::Y.extend(-center.y),
        DVec3::Z.extend(-center.z),
        (-center).extend(constant),
    )
}
