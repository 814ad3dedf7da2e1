//! Point lights and directional lights, without attenuation.

use glam::DVec3;

/// Lights as columns.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// World positions of the point lights.
    pub positions: Vec<DVec3>,
    /// Intensity times colour of the point lights, scene-linear RGB.
    pub intensities: Vec<DVec3>,
    /// The way that the light of the directional lights travels; of unit length.
    pub directions: Vec<DVec3>,
    /// Intensity times colour of the directional lights.
    pub directional_intensities: Vec<DVec3>,
}

impl Lights {
    /// Appends a point light.
    pub fn add(&mut self, position: DVec3, intensity: DVec3) {
        self.positions.push(position);
        self.intensities.push(intensity);
    }

    /// Appends a light so far away that it comes from one direction. `direction` is the way it travels, of any length but
    /// zero.
    pub fn add_directional(&mut self, direction: DVec3, intensity: DVec3) {
        self.directions.push(direction.normalize());
        self.directional_intensities.push(intensity);
    }

    /// Number of lights of both kinds.
    pub fn len(&self) -> usize {
        self.positions.len() + self.directions.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.len() * 2 * size_of::<DVec3>()
    }
}
