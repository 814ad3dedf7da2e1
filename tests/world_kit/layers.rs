//! Layers beside the beauty.

use flatray::film::cryptomatte::id_of;
use flatray::render::{Aov, Aovs};
use flatray::scene::Compiled;

/// All layers that there are, of a scene.
pub fn all_layers(scene: &Compiled) -> Aovs {
    layers(scene, &Aov::ALL)
}

/// Some layers of a scene.
pub fn layers(scene: &Compiled, wanted: &[Aov]) -> Aovs {
    let ids = |names: &[String]| names.iter().map(|name| id_of(name)).collect();
    Aovs {
        light_groups: scene.names.light_groups.clone(),
        object_mattes: ids(&scene.names.objects),
        material_mattes: ids(&scene.names.materials),
        ..Aovs::of(wanted)
    }
}
