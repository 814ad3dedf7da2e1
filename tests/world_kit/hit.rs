//! The closest hit, by tree and by scan.

use flatray::accel::{Accel, AccelKind};
use flatray::world::{Hit, Ray, World};

/// The closest hit of one ray, by the BVH and by the full scan, which must agree.
pub fn closest_hit(world: &World, ray: Ray) -> Hit {
    let [bvh, linear] = [AccelKind::Bvh, AccelKind::Linear].map(|kind| {
        let mut hits = [Hit::MISS];
        Accel::build(world, kind).closest_hit(world, &[ray], &mut hits);
        hits[0]
    });
    assert_eq!(bvh, linear, "{ray:?}");
    bvh
}
