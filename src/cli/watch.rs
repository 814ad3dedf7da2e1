//! Long work on this thread, while another one looks after interrupts and shows how far it is.

use std::sync::atomic::Ordering;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

use super::interrupt::Interrupt;
use super::progress::Progress;
use crate::render::Control;

/// How often an interrupt is noticed.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Does the work, passes an interrupt on to `control`, and shows the tiles that it counts.
pub fn watched<T>(interrupt: &Interrupt, control: &Control, mut progress: Progress, work: impl FnOnce() -> T) -> T {
    std::thread::scope(|scope| {
        // The watcher goes when the sender does, also if the work panics.
        let (sender, receiver) = channel::<()>();
        scope.spawn(move || {
            while receiver.recv_timeout(POLL_INTERVAL) == Err(RecvTimeoutError::Timeout) {
                if interrupt.is_requested() {
                    control.request_stop();
                }
                let count = |counter: &std::sync::atomic::AtomicU64| counter.load(Ordering::Relaxed);
                progress.update(count(&control.tiles_done), count(&control.rays_traced));
            }
            progress.finish();
        });
        let _sender = sender;
        work()
    })
}
