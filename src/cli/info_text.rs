//! The text of `flatray info`.

use std::fmt::Display;

use super::info::{BvhInfo, Info, MaterialInfo};
use super::quantity;

/// Rows of materials and lights that are listed; JSON has them all.
const MAX_LISTED: usize = 12;

/// Describes a scene, one fact a line under headings.
pub fn describe(info: &Info) -> String {
    let mut page = Page::default();
    page.heading(&info.input);
    primitives(info, &mut page);
    page.heading("materials");
    page.list(&info.materials, material);
    page.heading("lights");
    page.list(&info.lights, |light| {
        let place = match (&light.position, &light.direction) {
            (Some(position), _) => format!("at {}", row(position)),
            (None, direction) => format!("along {}", direction.map(|direction| row(&direction)).unwrap_or_default()),
        };
        format!("{place}, intensity {}", row(&light.intensity))
    });
    page.heading("camera");
    let camera = &info.camera;
    page.fact("position", row(&camera.position));
    page.fact("image", format!("{}x{} pixels, {:.4} degrees high", camera.width, camera.height, camera.fov_y_degrees));
    page.fact("background", row(&info.background));
    page.heading("features");
    page.fact("found", names(&info.features.found));
    page.fact("skipped", names(&info.features.skipped));
    page.heading("memory");
    let is_total = |table: &str| table == "total";
    let (total, tables): (Vec<_>, Vec<_>) = info.memory_bytes.iter().partition(|(table, _)| is_total(table));
    for (table, bytes) in tables.into_iter().chain(total) {
        page.fact(table, quantity::bytes(bytes.as_u64().unwrap_or(0)));
    }
    bvh(&info.bvh, &mut page);
    page.text
}

fn primitives(info: &Info, page: &mut Page) {
    let kinds = &info.primitives;
    let count = |n: usize| quantity::count(n as u64);
    page.fact("spheres", count(kinds.spheres));
    page.fact("quadrics", format!("{} ({} unbounded)", count(kinds.quadrics), count(kinds.unbounded_quadrics)));
    let (meshes, vertices) = (count(kinds.meshes), count(kinds.vertices));
    page.fact("triangles", format!("{} in {meshes} meshes of {vertices} vertices", count(kinds.triangles)));
    if kinds.instances > 0 {
        let seen = quantity::count(kinds.placed_triangles);
        page.fact("instances", format!("{}, {seen} triangles with them", count(kinds.instances)));
    }
    match &info.bounds {
        Some(bounds) => page.fact("bounds", format!("{} to {}", row(&bounds.lo), row(&bounds.hi))),
        None => page.fact("bounds", "none: nothing is bounded"),
    }
    page.fact("loaded in", quantity::seconds(info.load_seconds));
}

fn bvh(bvh: &BvhInfo, page: &mut Page) {
    let BvhInfo { preset, nodes, leaves, depth, sah_cost, build_seconds, memory_bytes } = *bvh;
    page.heading("bvh");
    page.fact("preset", preset);
    page.fact("nodes", quantity::count(nodes as u64));
    page.fact("leaves", quantity::count(leaves as u64));
    page.fact("depth", depth);
    page.fact("SAH cost", format!("{sah_cost:.2}"));
    page.fact("built in", quantity::seconds(build_seconds));
    page.fact("memory", quantity::bytes(memory_bytes as u64));
}

fn material(material: &MaterialInfo) -> String {
    let MaterialInfo { name, ambient, diffuse, specular, reflectance, shininess, transmittance, ior } = material;
    let name: String = name.chars().map(|c| if c.is_control() { '\u{fffd}' } else { c }).collect();
    let (ambient, diffuse, specular) = (row(ambient), row(diffuse), row(specular));
    let glass =
        if *transmittance > 0.0 { format!(", transmittance {transmittance}, ior {ior}") } else { String::new() };
    format!(
        "{name}: ambient {ambient}, diffuse {diffuse}, specular {specular}, \
             reflectance {reflectance}, shininess {shininess}{glass}"
    )
}

fn row<T: Display>(values: &[T]) -> String {
    format!("({})", values.iter().map(|value| format!("{value:.6}")).map(trimmed).collect::<Vec<_>>().join(", "))
}

/// A number without the zeros that six decimals leave.
fn trimmed(number: String) -> String {
    if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.').to_owned() } else { number }
}

fn names(names: &[&str]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Headings and facts in two columns.
#[derive(Default)]
struct Page {
    text: String,
}

impl Page {
    fn heading(&mut self, heading: &str) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text.push_str(heading);
        self.text.push('\n');
    }

    fn fact(&mut self, name: &str, value: impl Display) {
        self.text.push_str(&format!("  {name:<12}{value}\n"));
    }

    fn list<T>(&mut self, rows: &[T], describe: impl Fn(&T) -> String) {
        if rows.is_empty() {
            self.text.push_str("  none\n");
        }
        for row in rows.iter().take(MAX_LISTED) {
            self.text.push_str(&format!("  {}\n", describe(row)));
        }
        if rows.len() > MAX_LISTED {
            self.text.push_str(&format!("  … and {} more\n", rows.len() - MAX_LISTED));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_without_idle_zeros() {
        assert_eq!(row(&[1.0, -0.25, 1e-7]), "(1, -0.25, 0)");
        assert_eq!(row(&[100.0f32, 1.5]), "(100, 1.5)");
    }

    #[test]
    fn long_lists_end_with_how_much_was_left_out() {
        let mut page = Page::default();
        page.list(&[0; 15], |n| n.to_string());
        assert!(page.text.ends_with("… and 3 more\n"));
    }
}
