//! NFF texts with bytes changed, cut and doubled: each loads, or is refused with a message that names file and line.

use std::path::Path;

use flatray::measure::stress::random::Random;
use flatray::scene::{Overrides, nff};

/// Every statement, and of each what makes it odd.
const SEED: &str = "# all statements\nb 0.078 0.361 0.753\nv\nfrom -1.6 1.6 1.7\nat 0 0 0\nup 0 0 1\nangle 45\nhither 0.01\n\
    resolution 32 24\nl -100 -100 100\nl 3 4 5 1 0.5 0.25\nf 1 1 1 0.1 0.1 101.148 0.9 1.5\ns -0.8 0.8 1.20821 0.17\n\
    c 0 0 0 0.15 0 0 1 0.1005\nc 1 0 0 -0.5 1 0 2 -0.5\nf 0.5 0.45 0.35 1 0 100000 0 0\np 3\n-1 -1 0\n-0.96875 -1 -0.0160409\n\
    -0.96875 -0.96875 -0.00732202\np 5\n0 0 0\n2 0 0\n2 2 0\n1 1 0\n0 2 0\npp 3\n0 0 1 0 0 1\n1 0 1 0.1 0 1\n0 1 1 0 0.1 1\n";

/// Changes bytes, puts in pieces that readers stumble on, cuts and doubles.
fn mutate(bytes: &mut Vec<u8>, random: &mut Random) {
    let mut below = |n: usize| random.below(n.max(1) as u64) as usize;
    const PIECES: [&str; 16] = [
        "nan",
        "-inf",
        "1e39",
        "1e-320",
        "0",
        "-1",
        "99999999999999999999",
        "4294967295",
        "p 2000000000\n",
        "pp",
        "#",
        "\r",
        "\0",
        "f 0 0 0 0 0 0 1 0\n",
        "v from",
        "c 0 0 0 1 0 0 0 1\n",
    ];
    for _ in 0..1 + below(2) {
        let at = below(bytes.len());
        match below(5) {
            0 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte = below(256) as u8),
            1 => bytes.truncate(at),
            2 => drop(bytes.splice(at..at, PIECES[below(PIECES.len())].bytes())),
            3 => drop(bytes.drain(at..bytes.len().min(at + below(12)))),
            _ => {
                let piece = bytes[at..bytes.len().min(at + below(40))].to_vec();
                let to = below(bytes.len());
                drop(bytes.splice(to..to, piece));
            }
        }
    }
}

#[test]
fn mutated_texts_load_or_are_refused_with_file_and_line() {
    let load = |bytes: Vec<u8>| nff::from_bytes(Path::new("mutated.nff"), bytes, &Overrides::default());
    let seed = load(SEED.as_bytes().to_vec()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((seed.world.spheres.len(), seed.world.quadrics.len(), seed.world.triangles.len()), (1, 2, 1 + 3 + 1));
    let (mut n_loaded, mut n_refused) = (0, 0);
    for case in 0..20_000 {
        let mut bytes = SEED.as_bytes().to_vec();
        mutate(&mut bytes, &mut Random::new(5, "nff", case));
        let shown = String::from_utf8_lossy(&bytes).into_owned();
        match load(bytes) {
            Ok(scene) => {
                n_loaded += 1;
                let world = &scene.world;
                assert!(world.spheres.radii.iter().all(|radius| *radius > 0.0), "{shown}");
                assert!(world.triangles.positions.iter().all(|position| position.is_finite()), "{shown}");
                assert!(scene.camera.world_from_camera.is_finite() && scene.camera.fov_y_radians > 0.0, "{shown}");
            }
            Err(error) => {
                n_refused += 1;
                let message = error.to_string();
                assert!(message.starts_with("mutated.nff:") && message.len() < 400, "{message}\n{shown}");
            }
        }
    }
    assert!(n_loaded > 1500 && n_refused > 1500, "{n_loaded} {n_refused}");
}
