//! Phong materials, the factors of the shading formula already multiplied out.

use glam::DVec3;

use super::MaterialId;

/// One material as a scene file states it; colours are scene-linear RGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// O_a.
    pub ambient: DVec3,
    /// O_d.
    pub diffuse: DVec3,
    /// O_s.
    pub specular: DVec3,
    /// Weight of the ambient term.
    pub k_a: f64,
    /// Weight of the diffuse term.
    pub k_d: f64,
    /// Weight of the specular term, and of the mirrored radiance unless `reflectance` is given.
    pub k_s: f64,
    /// Weight of the mirrored radiance where it is not k_s.
    pub reflectance: Option<f64>,
    /// Phong exponent.
    pub shininess: f64,
    /// Weight of the refracted radiance.
    pub k_t: f64,
    /// Index of refraction of the inside over that of the outside; above 0.
    pub ior: f64,
}

/// Materials as columns.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// k_a·O_a.
    pub ambient: Vec<DVec3>,
    /// k_d·O_d.
    pub diffuse: Vec<DVec3>,
    /// k_s·O_s.
    pub specular: Vec<DVec3>,
    /// Weight of the mirrored radiance, the same for the three channels: k_s unless stated otherwise.
    pub reflectance: Vec<f64>,
    /// Phong exponent.
    pub shininess: Vec<f64>,
    /// Weight of the refracted radiance, the same for the three channels: k_t.
    pub transmittance: Vec<f64>,
    /// Index of refraction of the inside over that of the outside.
    pub ior: Vec<f64>,
}

impl Materials {
    /// Appends a material.
    pub fn add(&mut self, material: &Material) -> MaterialId {
        let Material { ambient, diffuse, specular, k_a, k_d, k_s, reflectance, shininess, k_t, ior } = *material;
        let id = MaterialId(self.len() as u32);
        self.ambient.push(k_a * ambient);
        self.diffuse.push(k_d * diffuse);
        self.specular.push(k_s * specular);
        self.reflectance.push(reflectance.unwrap_or(k_s));
        self.shininess.push(shininess);
        self.transmittance.push(k_t);
        self.ior.push(ior);
        id
    }

    /// Number of materials.
    pub fn len(&self) -> usize {
        self.ambient.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.ambient.is_empty()
    }

    /// Whether light changes this material: without a diffuse and a specular part no shadow ray is needed.
    #[inline]
    pub fn is_lit(&self, id: MaterialId) -> bool {
        self.diffuse[id.idx()] != DVec3::ZERO || self.specular[id.idx()] != DVec3::ZERO
    }

    /// Whether light changes any material.
    pub fn any_lit(&self) -> bool {
        (0..self.len() as u32).any(|row| self.is_lit(MaterialId(row)))
    }

    /// Bytes held.
    pub fn memory_bytes(&self) -> usize {
        self.len() * (3 * size_of::<DVec3>() + 4 * size_of::<f64>())
    }
}

impl Default for Material {
    /// A neutral, light grey, matte surface with a faint highlight.
    fn default() -> Material {
        Material {
            ambient: DVec3::ONE,
            diffuse: DVec3::ONE,
            specular: DVec3::ONE,
            k_a: 0.1,
            k_d: 0.8,
            k_s: 0.0,
            reflectance: None,
            shininess: 1.0,
            k_t: 0.0,
            ior: 1.5,
        }
    }
}
