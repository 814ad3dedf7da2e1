//! One pass over a set of rays, on any number of threads.

use std::sync::{Mutex, PoisonError};

use crate::accel::Accel;
use crate::measure::embree::library::Scene;
use crate::measure::embree::packet::RayPacket;
use crate::measure::rays::RayKind;
use crate::world::{Hit, Ray, World};

/// Rays that a thread takes at a time, as many as the renderer has in a batch.
const BATCH: usize = 2048;

/// One answer per ray.
#[derive(Clone, Debug)]
pub enum Answers {
    /// Closest hits.
    Hits(Vec<Hit>),
    /// Whether anything lies in the interval.
    Occluded(Vec<bool>),
}

impl Answers {
    /// Room for the answers to rays of a kind.
    pub fn room(kind: RayKind, n_rays: usize) -> Answers {
        match kind.is_occlusion() {
            true => Answers::Occluded(vec![false; n_rays]),
            false => Answers::Hits(vec![Hit::MISS; n_rays]),
        }
    }

    /// How many rays hit something.
    pub fn n_hits(&self) -> usize {
        match self {
            Answers::Hits(hits) => hits.iter().filter(|hit| hit.is_some()).count(),
            Answers::Occluded(occluded) => occluded.iter().filter(|occluded| **occluded).count(),
        }
    }
}

/// Answers all rays with flatray.
pub fn trace(accel: &Accel, world: &World, rays: &[Ray], answers: &mut Answers, threads: usize) {
    trace_batches(accel, world, rays, answers, threads, BATCH);
}

/// As [`trace`], with batches of another size.
pub fn trace_batches(accel: &Accel, world: &World, rays: &[Ray], answers: &mut Answers, threads: usize, batch: usize) {
    match answers {
        Answers::Hits(hits) => {
            for_each_batch(threads, batch, rays, hits, |rays, hits| accel.closest_hit(world, rays, hits));
        }
        Answers::Occluded(occluded) => {
            for_each_batch(threads, batch, rays, occluded, |rays, occluded| accel.occluded(world, rays, occluded));
        }
    }
}

/// Rays as packets of `W`, and what Embree answers.
#[derive(Clone, Debug)]
pub struct Packets<const W: usize> {
    packets: Vec<RayPacket<W>>,
    t: Vec<[f32; W]>,
}

impl<const W: usize> Packets<W> {
    /// Packs rays.
    pub fn of(rays: &[Ray]) -> Packets<W> {
        let packets = RayPacket::pack(rays);
        Packets { t: vec![[0.0; W]; packets.len()], packets }
    }

    /// Answers all rays with Embree.
    pub fn trace(&mut self, scene: &Scene, kind: RayKind, threads: usize) {
        let coherent = kind.is_coherent();
        for_each_batch(threads, BATCH / W, &self.packets, &mut self.t, |packets, t| match kind.is_occlusion() {
            true => scene.occluded(coherent, packets, t),
            false => scene.closest_hit(coherent, packets, t),
        });
    }

    /// The answers; behind the last ray there may be some without meaning.
    pub fn answers(&self) -> &[f32] {
        self.t.as_flattened()
    }
}

/// Works through batches of inputs and outputs on threads; who is free takes the next.
fn for_each_batch<A: Sync, B: Send>(
    threads: usize,
    batch: usize,
    inputs: &[A],
    outputs: &mut [B],
    work: impl Fn(&[A], &mut [B]) + Sync,
) {
    let batches = inputs.chunks(batch).zip(outputs.chunks_mut(batch));
    if threads == 1 {
        return batches.for_each(|(inputs, outputs)| work(inputs, outputs));
    }
    let batches = Mutex::new(batches);
    let next = || batches.lock().unwrap_or_else(PoisonError::into_inner).next();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some((inputs, outputs)) = next() {
                    work(inputs, outputs);
                }
            });
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_batch_is_worked_on_once_on_any_number_of_threads() {
        let inputs: Vec<u32> = (0..1000).collect();
        for threads in [1, 2, 5] {
            let mut outputs = vec![0; 1000];
            for_each_batch(threads, 7, &inputs, &mut outputs, |inputs, outputs| {
                outputs.iter_mut().zip(inputs).for_each(|(output, input)| *output += input + 1);
            });
            assert!(outputs.iter().zip(1..).all(|(output, expected)| *output == expected));
        }
    }
}
