//! Rays in Embree's layout: columns of 1, 4, 8 or 16 rays.

use crate::world::Ray;

/// `W` rays, one column per number, in the order of Embree's RTCRay, RTCRay4, RTCRay8 and RTCRay16.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct RayPacket<const W: usize> {
    /// Origin and t_min, direction and time, t_max, mask, id, flags; floats as their bits.
    pub columns: [[u32; W]; N_COLUMNS],
    /// −1 for each ray that is there, 0 for the empty places of the last packet.
    pub valid: [i32; W],
}

/// Numbers of a ray.
pub const N_COLUMNS: usize = 12;
const T_MIN: usize = 3;
const T_MAX: usize = 8;
const MASK: usize = 9;

impl<const W: usize> RayPacket<W> {
    /// Packs neighbouring rays together. Their numbers are rounded to f32.
    pub fn pack(rays: &[Ray]) -> Vec<RayPacket<W>> {
        rays.chunks(W).map(RayPacket::of).collect()
    }

    fn of(rays: &[Ray]) -> RayPacket<W> {
        let mut packet = RayPacket { columns: [[0; W]; N_COLUMNS], valid: [0; W] };
        for (lane, ray) in rays.iter().enumerate() {
            let mut set = |column: usize, value: f64| packet.columns[column][lane] = (value as f32).to_bits();
            for axis in 0..3 {
                set(axis, ray.origin[axis]);
                set(4 + axis, ray.direction[axis]);
            }
            set(T_MIN, ray.t_min);
            set(T_MAX, ray.t_max);
            packet.columns[MASK][lane] = u32::MAX;
            packet.valid[lane] = -1;
        }
        packet
    }
}

/// What Embree answers to a ray, and how it is read.
pub mod answer {
    /// Stands for no hit among closest hits.
    pub const MISS: f32 = f32::INFINITY;
    /// What Embree writes into t_max of a ray that is occluded.
    pub const OCCLUDED: f32 = f32::NEG_INFINITY;
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    #[test]
    fn rays_are_packed_in_order_and_empty_places_are_not_valid() {
        let ray = |x: f64| Ray::new(DVec3::new(x, 2.0, 3.0), DVec3::NEG_Z).until(7.0);
        let packets = RayPacket::<4>::pack(&[ray(0.0), ray(1.0), ray(2.0), ray(3.0), ray(4.0)]);
        assert_eq!(packets.len(), 2);
        assert_eq!(packets[0].columns[0].map(f32::from_bits), [0.0, 1.0, 2.0, 3.0]);
        assert_eq!(packets[0].columns[6].map(f32::from_bits), [-1.0; 4]);
        assert_eq!((packets[0].valid, packets[1].valid), ([-1; 4], [-1, 0, 0, 0]));
        assert_eq!(f32::from_bits(packets[1].columns[T_MAX][0]), 7.0);
    }
}
