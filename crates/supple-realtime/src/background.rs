//! Work that may wait for a disk, a terminal or a reader, done by a thread of its own.
//!
//! Whoever hands work over never waits: where the queue is full, the work is dropped and counted.

use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::Builder;
use std::time::Instant;

/// Stack of the thread \[bytes\]: under locked memory all of it is resident.
const STACK_BYTES: usize = 256 * 1024;
/// How often [`BackgroundWriter::flush`] looks for room in a full queue.
const LOOK_EVERY: Duration = Duration::from_millis(1);

type Job = Box<dyn FnOnce() + Send>;

/// A thread that does what it is handed, in order, with a queue of fixed length before it.
///
/// Dropping it ends the thread once the queue is empty, and waits for nothing.
#[derive(Debug)]
pub struct BackgroundWriter {
    sender: SyncSender<Job>,
    dropped: Arc<AtomicU64>,
}

impl BackgroundWriter {
    /// Starts the thread; `capacity` jobs may wait. The thread takes over the scheduling of the caller, so it is to be
    /// started before the caller asks for a realtime priority.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(name: &str, capacity: usize) -> io::Result<BackgroundWriter> {
        let (sender, jobs) = sync_channel::<Job>(capacity);
        Builder::new()
            .name(name.to_owned())
            .stack_size(STACK_BYTES)
            .spawn(move || {
                for job in jobs {
                    job();
                }
            })?;
        Ok(BackgroundWriter {
            sender,
            dropped: Arc::default(),
        })
    }

    /// Hands a job over; false where it was dropped, because the queue is full or the thread is gone.
    pub fn submit(&self, job: impl FnOnce() + Send + 'static) -> bool {
        let accepted = self.sender.try_send(Box::new(job)).is_ok();
        if !accepted {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        accepted
    }

    /// Jobs that were dropped.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Waits until everything handed over before is done, at most for `timeout`; false where it is not.
    pub fn flush(&self, timeout: Duration) -> bool {
        let start = Instant::now();
        let (sender, done) = sync_channel(1);
        let mut job: Job = Box::new(move || {
            // Whoever waited may have given up.
            let _ = sender.try_send(());
        });
        loop {
            match self.sender.try_send(job) {
                Ok(()) => break,
                Err(TrySendError::Disconnected(_)) => return false,
                Err(TrySendError::Full(back)) if start.elapsed() < timeout => job = back,
                Err(TrySendError::Full(_)) => return false,
            }
            std::thread::park_timeout(LOOK_EVERY);
        }
        let left = timeout.saturating_sub(start.elapsed());
        done.recv_timeout(left).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_that_blocks_holds_nobody_up_and_what_finds_no_room_is_counted() {
        let writer = BackgroundWriter::start("test", 2).expect("a thread");
        let (open, gate) = sync_channel::<()>(0);
        let (begun, has_begun) = sync_channel(1);
        assert!(writer.submit(move || {
            begun.send(()).expect("the test waits");
            gate.recv().expect("the test opens");
        }));
        has_begun.recv().expect("it begins");
        let done = Arc::new(AtomicU64::new(0));
        let accepted = (0..10)
            .filter(|_| {
                let done = done.clone();
                writer.submit(move || {
                    done.fetch_add(1, Ordering::Relaxed);
                })
            })
            .count();
        assert_eq!((accepted, writer.dropped()), (2, 8));
        assert!(!writer.flush(Duration::from_millis(2)), "it is blocked");
        open.send(()).expect("the job waits");
        assert!(writer.flush(Duration::from_secs(60)));
        assert_eq!(done.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn a_thread_that_died_is_seen() {
        let writer = BackgroundWriter::start("test", 1).expect("a thread");
        // Its panic drops the other jobs' queue.
        writer.submit(|| std::panic::resume_unwind(Box::new(())));
        while writer.submit(|| {}) {
            std::thread::yield_now();
        }
        // Full for a moment, or gone: in the end gone.
        assert!(!writer.flush(Duration::from_secs(60)));
    }
}
