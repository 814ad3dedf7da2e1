//! Reinhard's global operator.
//!
//! Source: Reinhard, Stark, Shirley and Ferwerda, *Photographic Tone Reproduction for Digital Images*, ACM Transactions on
//! Graphics 21 (3), 2002, section 3.1: equation 3, L/(1 + L), and equation 4, L·(1 + L/L_white²)/(1 + L). The key of the
//! scene, equation 2, is left to the exposure.
//!
//! Departure: the paper maps luminance and scales the colour with it; here each channel is mapped, as most renderers do.
//! Greys are the same. A saturated colour would else leave the display's range: blue of radiance 2 comes to 1.75.

/// The operator for one channel.
#[derive(Clone, Copy, Debug)]
pub struct Reinhard {
    /// 1/L_white²; 0 without a white point.
    inverse_square_white: f64,
}

impl Reinhard {
    /// The operator of a white point, a radiance above 0.
    pub fn new(white: Option<f64>) -> Reinhard {
        Reinhard { inverse_square_white: white.map_or(0.0, |white| 1.0 / (white * white)) }
    }

    /// The display value of a radiance.
    #[inline]
    pub fn map(&self, radiance: f64) -> f64 {
        (radiance * (1.0 + radiance * self.inverse_square_white) / (1.0 + radiance)).min(1.0)
    }
}
