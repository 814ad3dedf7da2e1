//! Ear clipping of one ring (Meisters 1975, "Polygons have ears"), exact on the projected corners.
//!
//! Only corners that do not turn left can lie in an ear (O'Rourke 1998, *Computational Geometry in C*, 1.5); they are
//! kept sorted by x, and an ear is tested against those in its own x-range. Every sign is exact (Shewchuk 1997,
//! "Adaptive precision floating-point arithmetic", by the crate `robust`). Departures: rings that touch or repeat
//! themselves, or carry corners on straight edges, are cut rightly; rings that cross themselves are cut somehow, in
//! bounded time.

use std::collections::VecDeque;

use robust::{Coord, orient2d};

/// How many tests the polygons of one file may cause, so that no file can be made to hang the reader.
#[derive(Debug)]
pub(super) struct Budget {
    tests_left: u64,
}

impl Budget {
    /// Below a second for any file …
    const BASE_TESTS: u64 = 1 << 28;

    /// … and more for more corners. Polygons as modellers write them take fewer than 20 a corner.
    const TESTS_PER_CORNER: u64 = 256;

    pub fn for_corners(n_corners: usize) -> Budget {
        Budget { tests_left: Self::BASE_TESTS + Self::TESTS_PER_CORNER * n_corners as u64 }
    }

    #[inline]
    fn spend(&mut self, n_tests: usize) -> Option<()> {
        self.tests_left = self.tests_left.checked_sub(n_tests as u64)?;
        Some(())
    }
}

/// What is left of a ring, counter-clockwise, as a doubly linked list over its points.
#[derive(Debug)]
pub(super) struct EarClipper<'a> {
    points: &'a [Coord<f64>],
    next: Vec<u32>,
    previous: Vec<u32>,
    n_left: usize,
    alive: Vec<bool>,
    /// Corners that may lie in an ear, sorted by x; some may have ceased to be such.
    blockers: Vec<u32>,
    is_blocker: Vec<bool>,
    n_stale_blockers: usize,
    /// Work of keeping the list sorted that the budget has not been charged for, in tests.
    n_uncharged: usize,
    /// Corners that may be tips of an ear, in the order in which they are tried.
    queue: VecDeque<u32>,
    is_queued: Vec<bool>,
}

impl<'a> EarClipper<'a> {
    /// Takes a ring of at least three points, fewer than 2³².
    pub fn new(points: &'a [Coord<f64>]) -> EarClipper<'a> {
        let n = points.len();
        let mut clipper = EarClipper {
            points,
            next: (0..n).map(|row| ((row + 1) % n) as u32).collect(),
            previous: (0..n).map(|row| ((row + n - 1) % n) as u32).collect(),
            n_left: n,
            alive: vec![true; n],
            blockers: Vec::new(),
            is_blocker: vec![false; n],
            n_stale_blockers: 0,
            n_uncharged: 0,
            queue: (0..n as u32).collect(),
            is_queued: vec![true; n],
        };
        for corner in 0..n as u32 {
            if clipper.turn(corner) <= 0.0 {
                clipper.blockers.push(corner);
                clipper.is_blocker[corner as usize] = true;
            }
        }
        clipper.blockers.sort_by(|&a, &b| points[a as usize].x.total_cmp(&points[b as usize].x));
        clipper
    }

    /// Hands over the triangles as rows of the points. `None` when the budget is used up.
    pub fn run(mut self, budget: &mut Budget, mut emit: impl FnMut([u32; 3])) -> Option<()> {
        for corner in 0..self.alive.len() as u32 {
            self.remove_spikes(corner);
        }
        while self.n_left > 3 {
            let Some(tip) = self.next_ear(budget)? else { break };
            emit([self.previous[tip as usize], tip, self.next[tip as usize]]);
            self.remove(tip);
        }
        if let Some(a) = self.find(|clipper, corner| clipper.turn(corner) != 0.0) {
            let b = self.next[a as usize];
            emit([a, b, self.next[b as usize]]);
        }
        Some(())
    }

    /// The next corner to clip. When no corner is an ear the ring touches or crosses itself: corners without a turn go
    /// without a triangle, then any left turn is clipped, then any corner. `Some(None)` when nothing is left to clip.
    fn next_ear(&mut self, budget: &mut Budget) -> Option<Option<u32>> {
        if let Some(tip) = self.ear_in_queue(budget)? {
            return Some(Some(tip));
        }
        // What clipping did to corners further away is not tracked where a ring touches itself: look at all again.
        budget.spend(self.alive.len())?;
        self.requeue_all();
        if let Some(tip) = self.ear_in_queue(budget)? {
            return Some(Some(tip));
        }
        while self.n_left > 3 {
            budget.spend(self.alive.len())?;
            let Some(straight) = self.find(|clipper, corner| clipper.turn(corner) == 0.0) else { break };
            self.remove(straight);
            if let Some(tip) = self.ear_in_queue(budget)? {
                return Some(Some(tip));
            }
        }
        if self.n_left <= 3 {
            return Some(None);
        }
        budget.spend(2 * self.alive.len())?;
        Some(self.find(|clipper, corner| clipper.turn(corner) > 0.0).or_else(|| self.find(|_, _| true)))
    }

    fn find(&self, holds: impl Fn(&Self, u32) -> bool) -> Option<u32> {
        (0..self.alive.len() as u32).find(|&corner| self.alive[corner as usize] && holds(self, corner))
    }

    fn requeue_all(&mut self) {
        for corner in 0..self.alive.len() as u32 {
            if self.alive[corner as usize] {
                self.enqueue(corner);
            }
        }
    }

    fn ear_in_queue(&mut self, budget: &mut Budget) -> Option<Option<u32>> {
        budget.spend(std::mem::take(&mut self.n_uncharged))?;
        while let Some(corner) = self.queue.pop_front() {
            self.is_queued[corner as usize] = false;
            if self.alive[corner as usize] && self.is_ear(corner, budget)? {
                return Some(Some(corner));
            }
        }
        Some(None)
    }

    #[inline]
    fn turn(&self, corner: u32) -> f64 {
        let point = |row: u32| self.points[row as usize];
        orient2d(point(self.previous[corner as usize]), point(corner), point(self.next[corner as usize]))
    }

    /// Whether the triangle of a corner and its neighbours has area and can be cut off.
    fn is_ear(&self, tip: u32, budget: &mut Budget) -> Option<bool> {
        budget.spend(1)?;
        if self.turn(tip) <= 0.0 {
            return Some(false);
        }
        let ear = [self.previous[tip as usize], tip, self.next[tip as usize]];
        let [a, b, c] = ear.map(|row| self.points[row as usize]);
        let (x_min, x_max) = (a.x.min(b.x).min(c.x), a.x.max(b.x).max(c.x));
        let (y_min, y_max) = (a.y.min(b.y).min(c.y), a.y.max(b.y).max(c.y));
        let first = self.blockers.partition_point(|&row| self.points[row as usize].x < x_min);
        let mut n_tests = 0;
        let mut is_free = true;
        for &row in &self.blockers[first..] {
            let p = self.points[row as usize];
            if p.x > x_max {
                break;
            }
            n_tests += 1;
            let is_near = p.y >= y_min && p.y <= y_max && self.is_blocker[row as usize] && !ear.contains(&row);
            if is_near {
                // One orientation, which is what most take, costs as much as three comparisons of y.
                n_tests += 3;
                if self.blocks(row, ear) {
                    is_free = false;
                    break;
                }
            }
        }
        budget.spend(n_tests)?;
        Some(is_free)
    }

    /// Whether a corner, not one of the ear's, lies in the ear or on its rim. One that lies on a corner of the ear
    /// blocks only when the ring runs from there into the ear.
    fn blocks(&self, row: u32, ear: [u32; 3]) -> bool {
        let [a, b, c] = ear.map(|corner| self.points[corner as usize]);
        let p = self.points[row as usize];
        for [corner, to, from] in [[a, b, c], [b, c, a], [c, a, b]] {
            if p == corner {
                let enters = |q: Coord<f64>| orient2d(corner, to, q) > 0.0 && orient2d(corner, q, from) > 0.0;
                let neighbour = |row: u32| self.points[row as usize];
                return enters(neighbour(self.previous[row as usize])) || enters(neighbour(self.next[row as usize]));
            }
        }
        // The side that is no edge of the ring comes first: most corners are beyond it.
        orient2d(c, a, p) >= 0.0 && orient2d(a, b, p) >= 0.0 && orient2d(b, c, p) >= 0.0
    }

    /// Takes a corner out of the ring, and the spikes that it leaves.
    fn remove(&mut self, corner: u32) {
        let (before, after) = (self.previous[corner as usize], self.next[corner as usize]);
        self.unlink(corner);
        self.remove_spikes(before);
        self.remove_spikes(after);
    }

    /// Takes a corner out of the ring and looks at its neighbours anew.
    fn unlink(&mut self, corner: u32) {
        let (before, after) = (self.previous[corner as usize], self.next[corner as usize]);
        self.next[before as usize] = after;
        self.previous[after as usize] = before;
        self.alive[corner as usize] = false;
        self.n_left -= 1;
        self.set_blocker(corner, false);
        for neighbour in [before, after] {
            self.set_blocker(neighbour, self.turn(neighbour) <= 0.0);
        }
        // The corner behind goes last, so that ears are taken all around the ring and not as one fan of slivers.
        if self.queue.front() == Some(&after) {
            self.queue.rotate_left(1);
        }
        self.enqueue(before);
        self.enqueue(after);
    }

    /// Takes out a corner at which the ring turns back on itself or stands still, and those that this makes so. Where
    /// a ring touches itself, clipping leaves such spikes; they have no area, but their tips would pass for ears.
    fn remove_spikes(&mut self, corner: u32) {
        if !self.is_spike(corner) {
            return;
        }
        let mut suspects = vec![corner];
        while let Some(corner) = suspects.pop() {
            if self.n_left > 3 && self.alive[corner as usize] && self.is_spike(corner) {
                suspects.extend([self.previous[corner as usize], self.next[corner as usize]]);
                self.unlink(corner);
            }
        }
    }

    fn is_spike(&self, corner: u32) -> bool {
        let place = |row: u32| (self.points[row as usize].x, self.points[row as usize].y);
        let (from, at, to) = (place(self.previous[corner as usize]), place(corner), place(self.next[corner as usize]));
        self.turn(corner) == 0.0 && (from == at || to == at || (from < at) == (to < at))
    }

    fn enqueue(&mut self, corner: u32) {
        if !std::mem::replace(&mut self.is_queued[corner as usize], true) {
            self.queue.push_back(corner);
        }
    }

    /// Keeps the sorted list: entries go stale and are swept out together; the rare new one is inserted in its place.
    fn set_blocker(&mut self, corner: u32, is_blocker: bool) {
        let was_blocker = std::mem::replace(&mut self.is_blocker[corner as usize], is_blocker);
        match (was_blocker, is_blocker) {
            (true, false) => {
                self.n_stale_blockers += 1;
                if 2 * self.n_stale_blockers > self.blockers.len() {
                    self.blockers.retain(|&row| self.is_blocker[row as usize]);
                    self.n_stale_blockers = 0;
                }
            }
            (false, true) => {
                let x = self.points[corner as usize].x;
                let place = self.blockers.partition_point(|&row| self.points[row as usize].x < x);
                // Moving 16 entries takes about as long as a test.
                self.n_uncharged += (self.blockers.len() - place) / 16;
                self.blockers.insert(place, corner);
            }
            _ => {}
        }
    }
}
