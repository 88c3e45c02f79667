//! A background thread for work that may block on a disk, a terminal or a reader.
//!
//! Submitting work never blocks: if the queue is full, the work is dropped and counted.

use core::time::Duration;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::Builder;
use std::time::Instant;

/// Stack size of the thread \[bytes\]; with locked memory the whole stack is resident.
const STACK_BYTES: usize = 256 * 1024;
/// Interval at which [`BackgroundWriter::flush`] retries if the queue is full.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

type Job = Box<dyn FnOnce() + Send>;

/// A thread that runs submitted jobs in order from a queue of fixed length.
///
/// Dropping it ends the thread once the queue is empty, without waiting for it.
#[derive(Debug)]
pub struct BackgroundWriter {
    sender: SyncSender<Job>,
    dropped: Arc<AtomicU64>,
}

impl BackgroundWriter {
    /// Starts the thread with a queue of `capacity` jobs. The thread inherits the scheduling of the caller, so start it
    /// before the caller gets a realtime priority.
    ///
    /// # Errors
    /// If the thread cannot be started.
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

    /// Queues a job; returns false if the job was dropped because the queue is full or the thread has ended.
    pub fn submit(&self, job: impl FnOnce() + Send + 'static) -> bool {
        let accepted = self.sender.try_send(Box::new(job)).is_ok();
        if !accepted {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
        accepted
    }

    /// Number of dropped jobs.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }

    /// Waits for at most `timeout` until all jobs queued so far are done; returns whether they are done.
    pub fn flush(&self, timeout: Duration) -> bool {
        let start = Instant::now();
        let (sender, done) = sync_channel(1);
        let mut job: Job = Box::new(move || {
            // The caller of flush may have timed out.
            let _ = sender.try_send(());
        });
        loop {
            match self.sender.try_send(job) {
                Ok(()) => break,
                Err(TrySendError::Disconnected(_)) => return false,
                Err(TrySendError::Full(back)) if start.elapsed() < timeout => job = back,
                Err(TrySendError::Full(_)) => return false,
            }
            std::thread::park_timeout(POLL_INTERVAL);
        }
        let left = timeout.saturating_sub(start.elapsed());
        done.recv_timeout(left).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn submit_does_not_block_and_counts_dropped_jobs() {
        let writer = BackgroundWriter::start("test", 2).expect("a thread");
        let (open, gate) = sync_channel::<()>(0);
        let (begun, has_begun) = sync_channel(1);
        assert!(writer.submit(move || {
            begun.send(()).expect("the test receives");
            gate.recv().expect("the test sends");
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
        assert!(
            !writer.flush(Duration::from_millis(2)),
            "the job is blocked"
        );
        open.send(()).expect("the job receives");
        assert!(writer.flush(Duration::from_secs(60)));
        assert_eq!(done.load(Ordering::Relaxed), 2);
    }

    #[test]
    fn flush_fails_when_the_thread_has_died() {
        let writer = BackgroundWriter::start("test", 1).expect("a thread");
        // The panic of the job drops the queue.
        writer.submit(|| std::panic::resume_unwind(Box::new(())));
        while writer.submit(|| {}) {
            std::thread::yield_now();
        }
        // The queue may be full at first; once the thread has ended, flush fails.
        assert!(!writer.flush(Duration::from_secs(60)));
    }
}
