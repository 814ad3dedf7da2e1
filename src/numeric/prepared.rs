//! A ray as the kernels want it: checked once, with what every test needs.

use glam::DVec3;

use super::double::is_tame3;

/// A ray as the triangle test wants it; made once per ray.
#[derive(Clone, Copy, Debug)]
pub struct Shear {
    /// Axes in cyclic order, the last the one along which the direction is longest.
    pub axes: [usize; 3],
    /// Direction components along the first two axes over that along the last.
    pub slope: [f64; 2],
}

/// A finite ray of non-zero direction.
#[derive(Clone, Copy, Debug)]
pub struct PreparedRay {
    /// Origin.
    pub origin: DVec3,
    /// Direction; any length.
    pub direction: DVec3,
    /// Open lower end of the interval.
    pub t_min: f64,
    /// Open upper end of the interval.
    pub t_max: f64,
    /// The shear of the direction.
    pub shear: Shear,
    /// Whether origin and direction are tame in the sense of [`is_tame`](super::double::is_tame).
    pub tame: bool,
}

impl PreparedRay {
    /// Prepares a ray. `None` for one that hits nothing: a component is NaN or infinite, the direction is zero, or the
    /// interval is empty, begins below 0 or has a NaN end.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3, t_min: f64, t_max: f64) -> Option<PreparedRay> {
        let sound =
            origin.is_finite() && direction.is_finite() && direction != DVec3::ZERO && t_min >= 0.0 && t_min < t_max;
        sound.then(|| PreparedRay {
            origin,
            direction,
            t_min,
            t_max,
            shear: Shear::new(direction),
            tame: is_tame3(origin) && is_tame3(direction),
        })
    }
}

impl Shear {
    /// The shear that turns a direction into its longest axis. Equal lengths take the first.
    #[inline(always)]
    pub fn new(direction: DVec3) -> Shear {
        let size = direction.abs();
        let z = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let (x, y) = ((z + 1) % 3, (z + 2) % 3);
        Shear { axes: [x, y, z], slope: [direction[x] / direction[z], direction[y] / direction[z]] }
    }
}
