//! John Hable's filmic curve of the game *Uncharted 2*.
//!
//! Source: J. Hable, *Uncharted 2: HDR Lighting*, Game Developers Conference 2010, and *Filmic Tonemapping Operators*,
//! filmicworlds.com 2010: f(x) = (x(Ax + CB) + DE)/(x(Ax + B) + DF) − E/F with A = 0.15, B = 0.50, C = 0.10, D = 0.20,
//! E = 0.02, F = 0.30, of radiance times an exposure bias of 2, divided by f(W) for W = 11.2. Channel by channel; what is
//! brighter than white is cut.
//!
//! The white point here is in radiance, as Reinhard's is: W is twice that, so that 5.6 gives the published curve.

const A: f64 = 0.15;
const B: f64 = 0.50;
const C: f64 = 0.10;
const D: f64 = 0.20;
const E: f64 = 0.02;
const F: f64 = 0.30;
const EXPOSURE_BIAS: f64 = 2.0;

/// The radiance that the published curve maps to white: 11.2 behind the bias.
pub const DEFAULT_WHITE: f64 = 11.2 / EXPOSURE_BIAS;

/// The operator for one channel.
#[derive(Clone, Copy, Debug)]
pub struct Hable {
    /// 1/f(W).
    scale: f64,
}

impl Hable {
    /// The operator of a white point, a radiance above 0.
    pub fn new(white: f64) -> Hable {
        Hable { scale: 1.0 / curve(EXPOSURE_BIAS * white) }
    }

    /// The display value of a radiance.
    #[inline]
    pub fn map(&self, radiance: f64) -> f64 {
        (curve(EXPOSURE_BIAS * radiance) * self.scale).min(1.0)
    }
}

/// f with its two fractions brought together, which cancel near black.
#[inline]
fn curve(x: f64) -> f64 {
    x * (A * (F - E) * x + B * (C * F - E)) / (F * (x * (A * x + B) + D * F))
}
