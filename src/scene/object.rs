//! Objects and their materials, from a description into the tables of a world.

use std::collections::HashMap;
use std::ops::Range;

use super::compile::Base;
use super::desc::{HittableDesc, MaterialDesc, MaterialRef, NamedMaterialDesc, ShapeDesc, Spanned};
use super::nearest::nearest;
use super::placement::Prototypes;
use super::report::Report;
use super::{Names, geometry};
use crate::error::{Place, Problem};
use crate::world::{Material, MaterialId, ObjectId, World};

/// The objects of a scene on their way into its tables.
pub struct Objects<'a> {
    base: &'a Base,
    report: &'a Report,
    named: &'a [NamedMaterialDesc],
    material_ids: HashMap<&'a str, MaterialId>,
    prototypes: Prototypes<'a>,
    world: &'a mut World,
    /// Names of what has been added.
    pub names: Names,
}

impl<'a> Objects<'a> {
    /// Adds the named materials; they come first, so that their ids are those of the file's list.
    pub fn new(
        named: &'a [NamedMaterialDesc],
        base: &'a Base,
        world: &'a mut World,
        report: &'a Report,
    ) -> Objects<'a> {
        let prototypes = Prototypes::new(base);
        let material_ids = HashMap::with_capacity(named.len());
        let mut objects = Objects { base, report, named, material_ids, prototypes, world, names: Names::default() };
        for NamedMaterialDesc { name, material, key } in named {
            let id = objects.add_material(material, name.value.clone());
            let finite = check_material(material, &name.span, key, report);
            if finite && objects.material_ids.insert(&name.value, id).is_some() {
                let problem = Problem::new(Place::default(), "a material of this name exists already");
                report.mistake(&name.span, &format!("{key}.name"), problem.found(format!("\"{}\"", name.value)));
            }
        }
        objects
    }

    /// Adds an object that is seen only where it is placed.
    pub fn add_prototype(&mut self, prototype: &'a HittableDesc) {
        let first_triangle = self.world.triangles.len();
        self.add_shape(prototype);
        self.prototypes.add(prototype, first_triangle, self.world, self.report);
    }

    /// Adds an object, or the placements of one.
    pub fn add(&mut self, hittable: &HittableDesc) {
        let Some(ShapeDesc::Instance(instance)) = &hittable.shape else { return self.add_shape(hittable) };
        let object = self.add_object(hittable);
        // An instance that says nothing keeps what its prototype has.
        let material = (!hittable.material.is_unstated()).then(|| self.material_of(hittable));
        self.prototypes.place(instance, hittable, material, object, self.world, self.report);
    }

    fn add_shape(&mut self, hittable: &HittableDesc) {
        let object = self.add_object(hittable);
        let material = self.material_of(hittable);
        if let Some(shape) = &hittable.shape {
            let (base, report) = (self.base, self.report);
            let brought = geometry::add_shape(shape, hittable, material, object, base, self.world, report);
            self.names.materials.extend(brought);
        }
    }

    fn add_object(&mut self, hittable: &HittableDesc) -> ObjectId {
        let id = ObjectId(self.names.objects.len() as u32);
        let kind = hittable.shape.as_ref().map_or("object", geometry::kind_name);
        self.names.objects.push(hittable.name.clone().unwrap_or_else(|| format!("{kind} {}", hittable.index)));
        id
    }

    fn material_of(&mut self, hittable: &HittableDesc) -> MaterialId {
        match &hittable.material {
            MaterialRef::Inline(material) => {
                check_material(material, &hittable.span, &hittable.key, self.report);
                let object = self.names.objects.last().cloned().unwrap_or_default();
                self.add_material(material, format!("material of {object}"))
            }
            MaterialRef::Named(name) => match self.material_ids.get(name.value.as_str()) {
                Some(&id) => id,
                None => {
                    self.tell_unknown_material(name, &hittable.key);
                    MaterialId::default()
                }
            },
        }
    }

    fn tell_unknown_material(&self, name: &Spanned<String>, key: &str) {
        let known = self.named.iter().map(|named| named.name.value.as_str());
        // A material that is there but wrong has been told of already.
        if known.clone().any(|known| known == name.value) {
            return;
        }
        let help = match nearest(&name.value, known) {
            Some(near) => format!("did you mean \"{near}\"?"),
            None if self.named.is_empty() => "the scene has no [[material]]".to_owned(),
            None => "no [[material]] has this name".to_owned(),
        };
        let problem = Problem::new(Place::default(), "unknown material").found(format!("\"{}\"", name.value));
        self.report.mistake(&name.span, &format!("{key}.material"), problem.help(help));
    }

    fn add_material(&mut self, desc: &MaterialDesc, name: String) -> MaterialId {
        self.names.materials.push(name);
        self.world.materials.add(&material_from(desc))
    }
}

/// The material with its defaults: [`Material::default`].
fn material_from(desc: &MaterialDesc) -> Material {
    let MaterialDesc { ambient, diffuse, specular, k_a, k_d, k_s, shininess, k_t, ior } = *desc;
    let default = Material::default();
    Material {
        ambient: ambient.unwrap_or(default.ambient),
        diffuse: diffuse.unwrap_or(default.diffuse),
        specular: specular.unwrap_or(default.specular),
        k_a: k_a.unwrap_or(default.k_a),
        k_d: k_d.unwrap_or(default.k_d),
        k_s: k_s.unwrap_or(default.k_s),
        reflectance: None,
        shininess: shininess.unwrap_or(default.shininess),
        k_t: k_t.unwrap_or(default.k_t),
        ior: ior.unwrap_or(default.ior),
    }
}

/// Refuses colours whose product with their weight leaves the range that images are stored in.
fn check_material(desc: &MaterialDesc, span: &Range<usize>, key: &str, report: &Report) -> bool {
    let Material { ambient, diffuse, specular, k_a, k_d, k_s, reflectance: _, shininess: _, k_t: _, ior: _ } =
        material_from(desc);
    let products = [k_a * ambient, k_d * diffuse, k_s * specular];
    let in_range = products.iter().all(|product| product.max_element() <= f64::from(f32::MAX));
    if !in_range {
        let problem = Problem::new(Place::default(), "a colour times its weight is beyond the range of 32-bit floats");
        report.mistake(span, key, problem);
    }
    in_range
}
