//! Point lights without attenuation.

use glam::DVec3;

/// Lights as columns.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// World positions.
    pub positions: Vec<DVec3>,
    /// Intensity times colour, scene-linear RGB.
    pub intensities: Vec<DVec3>,
}

impl Lights {
    /// Appends a light.
    pub fn add(&mut self, position: DVec3, intensity: DVec3) {
        self.positions.push(position);
        self.intensities.push(intensity);
    }

    /// Number of lights.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.len() * 2 * size_of::<DVec3>()
    }
}
