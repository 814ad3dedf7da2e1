//! Materials, lights and the camera in POV-Ray's words.

use std::fmt::Write;

use glam::DVec3;

use super::export::Inexpressible;
use crate::world::{Camera, Lights, MaterialId, Materials, World};

/// A vector as POV-Ray reads it. The shortest decimal that is read back as the same f64.
pub(super) fn vector(v: DVec3) -> String {
    format!("<{:?},{:?},{:?}>", v.x, v.y, v.z)
}

/// The camera by literal vectors: neither `angle` nor `look_at` may turn them.
pub(super) fn camera(camera: &Camera) -> String {
    let frame = camera.world_from_camera;
    let height = 2.0 * libm::tan(0.5 * camera.fov_y_radians);
    let width = height * f64::from(camera.width_px) / f64::from(camera.height_px);
    let [right, up, back, eye] = [frame.x_axis, frame.y_axis, frame.z_axis, frame.w_axis].map(|axis| axis.truncate());
    format!(
        "camera {{ perspective location {} direction {} right {} up {} }}\n",
        vector(eye),
        vector(-back),
        vector(width * right),
        vector(height * up)
    )
}

/// Share of the diffuse colour that stands in for none, where ambient light must not vanish with it.
const ALMOST_NONE: f64 = 1e-9;

/// How far directional lights are put away, in radii of the scene.
const FAR_RADII: f64 = 1000.0;

/// The texture of a material; radiance is divided by `white`.
///
/// POV-Ray multiplies ambient and diffuse light by one pigment P: with P = k_d·O_d, ambient is k_a·O_a / P.
pub(super) fn texture(materials: &Materials, id: MaterialId, white: f64) -> String {
    let row = id.idx();
    let (ambient, diffuse) = (materials.ambient[row] / white, materials.diffuse[row]);
    let largest = diffuse.max_element();
    let (pigment, weight) = match largest > 0.0 {
        true => (diffuse.max(DVec3::splat(largest * ALMOST_NONE)), 1.0),
        false => (DVec3::ONE, 0.0),
    };
    format!(
        "texture {{ pigment {{ rgb {} }} finish {{ ambient rgb {} diffuse {weight:?} brilliance 1 phong {:?} phong_size {:?} \
         specular 0 reflection {{ rgb {:?} }} }} }}",
        vector(pigment),
        vector(ambient / pigment),
        materials.specular[row].x,
        materials.shininess[row],
        materials.reflectance[row],
    )
}

/// What materials have that POV-Ray's do not.
pub(super) fn check_materials(materials: &Materials, refused: &mut Vec<Inexpressible>) {
    let any = |holds: &dyn Fn(usize) -> bool| (0..materials.len()).any(holds);
    if any(&|row| materials.specular[row] != DVec3::splat(materials.specular[row].x)) {
        refused.push(Inexpressible("a coloured highlight: POV-Ray's has the colour of the light"));
    }
    if any(&|row| materials.transmittance[row] > 0.0) {
        refused
            .push(Inexpressible("refraction: light passes POV-Ray's transparent objects, and shadows of glass differ"));
    }
    if any(&|row| materials.specular[row].x > 0.0 && materials.shininess[row] == 0.0) {
        refused.push(Inexpressible("a highlight with the exponent 0"));
    }
}

/// The lights. Directional ones stand far away, and their rays are parallel.
pub(super) fn lights(world: &World, white: f64, text: &mut String) {
    let Lights { positions, intensities, directions, directional_intensities, .. } = &world.lights;
    for (position, intensity) in positions.iter().zip(intensities) {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "light_source {{ {} rgb {} }}", vector(*position), vector(*intensity / white));
    }
    let (middle, radius) = world.bounds().map_or((DVec3::ZERO, 1.0), |bounds| {
        let (lo, hi) = (bounds.lo.as_dvec3(), bounds.hi.as_dvec3());
        (0.5 * (lo + hi), 0.5 * (hi - lo).length())
    });
    for (direction, intensity) in directions.iter().zip(directional_intensities) {
        let from = middle - *direction * FAR_RADII * radius.max(1.0);
        let _ = writeln!(
            text,
            "light_source {{ {} rgb {} parallel point_at {} }}",
            vector(from),
            vector(*intensity / white),
            vector(middle)
        );
    }
}
