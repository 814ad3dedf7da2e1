//! Point lights and directional lights, without attenuation.

use glam::DVec3;

use super::LightGroupId;

/// Lights as columns.
#[derive(Clone, Debug, Default)]
pub struct Lights {
    /// World positions of the point lights.
    pub positions: Vec<DVec3>,
    /// Intensity times colour of the point lights, scene-linear RGB.
    pub intensities: Vec<DVec3>,
    /// Groups of the point lights.
    pub groups: Vec<LightGroupId>,
    /// The way that the light of the directional lights travels; of unit length.
    pub directions: Vec<DVec3>,
    /// Intensity times colour of the directional lights.
    pub directional_intensities: Vec<DVec3>,
    /// Groups of the directional lights.
    pub directional_groups: Vec<LightGroupId>,
}

impl Lights {
    /// Appends a point light, in the first group.
    pub fn add(&mut self, position: DVec3, intensity: DVec3) {
        self.add_to(LightGroupId::default(), position, intensity);
    }

    /// Appends a point light.
    pub fn add_to(&mut self, group: LightGroupId, position: DVec3, intensity: DVec3) {
        self.positions.push(position);
        self.intensities.push(intensity);
        self.groups.push(group);
    }

    /// Appends a light so far away that it comes from one direction, in the first group. `direction` is the way it travels,
    /// of any length but zero.
    pub fn add_directional(&mut self, direction: DVec3, intensity: DVec3) {
        self.add_directional_to(LightGroupId::default(), direction, intensity);
    }

    /// The same in a group.
    pub fn add_directional_to(&mut self, group: LightGroupId, direction: DVec3, intensity: DVec3) {
        self.directions.push(direction.normalize());
        self.directional_intensities.push(intensity);
        self.directional_groups.push(group);
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
        self.len() * (2 * size_of::<DVec3>() + size_of::<LightGroupId>())
    }
}
