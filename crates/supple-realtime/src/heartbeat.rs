//! Sends watchdog messages to the service manager while all monitored threads make progress.
//!
//! Each periodic thread increments its [`LivenessCounter`] once per iteration. The [`Heartbeat`] thread compares the
//! counts twice per watchdog interval and sends `WATCHDOG=1` only if every count has advanced. If a thread hangs, the
//! messages stop and the manager kills the process; the plant then reacts as to every loss of the controller.

use crate::notify::{Notifier, NotifyError};
use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

/// Stack size, enough for one datagram; under locked memory every page of the stack is resident.
const STACK_BYTES: usize = 64 * 1024;

/// Iteration counter of one thread. Clones share the counter.
#[derive(Clone, Debug, Default)]
pub struct LivenessCounter(Arc<AtomicU64>);

impl LivenessCounter {
    /// Counts one iteration. Does not block or allocate memory.
    pub fn increment(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// Number of iterations so far.
    pub fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// Detects whether all threads make progress; holds their counters and the values at the last watchdog message.
#[derive(Clone, Debug)]
pub struct LivenessMonitor {
    counters: Vec<(LivenessCounter, u64)>,
}

impl LivenessMonitor {
    /// Creates the monitor of these counters, starting from their current values.
    pub fn new(counters: &[LivenessCounter]) -> LivenessMonitor {
        let counted = counters
            .iter()
            .map(|counter| (counter.clone(), counter.count()));
        LivenessMonitor {
            counters: counted.collect(),
        }
    }

    /// Whether every thread has advanced since this function last returned true.
    pub fn all_advanced(&mut self) -> bool {
        let counts: Vec<u64> = self
            .counters
            .iter()
            .map(|(counter, _)| counter.count())
            .collect();
        let moved = self.counters.iter().zip(&counts);
        let all = moved.into_iter().all(|((_, last), count)| count != last);
        if all {
            for ((_, last), count) in self.counters.iter_mut().zip(counts) {
                *last = count;
            }
        }
        all
    }
}

/// The thread that sends watchdog messages; dropping it sends `STOPPING=1`.
#[derive(Debug)]
pub struct Heartbeat {
    thread: Option<JoinHandle<()>>,
    stop: Option<SyncSender<()>>,
    notifier: Arc<Notifier>,
}

impl Heartbeat {
    /// Sends `READY=1`, and then watchdog messages if the manager has a watchdog. Call it when the periodic threads
    /// start and before the calling thread gets its realtime settings, because a new thread inherits priority and
    /// affinity.
    ///
    /// # Errors
    /// [`NotifyError::Socket`] if the manager's socket cannot be reached, [`NotifyError::Thread`] if the thread cannot
    /// be created.
    pub fn start(
        notifier: Notifier,
        counters: &[LivenessCounter],
    ) -> Result<Heartbeat, NotifyError> {
        notifier.ready()?;
        let notifier = Arc::new(notifier);
        let mut heartbeat = Heartbeat {
            thread: None,
            stop: None,
            notifier: notifier.clone(),
        };
        if let Some(watchdog) = notifier.watchdog() {
            let (stop, stopped) = sync_channel::<()>(0);
            let monitor = LivenessMonitor::new(counters);
            let every = watchdog / 2;
            let thread = Builder::new()
                .name("heartbeat".to_owned())
                .stack_size(STACK_BYTES)
                .spawn(move || {
                    send_watchdog_messages(&notifier, monitor, every, &|every| {
                        stopped.recv_timeout(every) == Err(RecvTimeoutError::Timeout)
                    });
                })
                .map_err(NotifyError::Thread)?;
            heartbeat.thread = Some(thread);
            heartbeat.stop = Some(stop);
        }
        Ok(heartbeat)
    }
}

/// Sends watchdog messages until `wait` returns false.
fn send_watchdog_messages(
    notifier: &Notifier,
    mut monitor: LivenessMonitor,
    every: Duration,
    wait: &dyn Fn(Duration) -> bool,
) {
    while wait(every) {
        if monitor.all_advanced() {
            // Errors are ignored: if the manager has ended, no watchdog expires.
            let _ = notifier.alive();
        }
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        // `STOPPING=1` is sent first, so that the manager applies its shutdown timeout instead of the watchdog.
        let _ = self.notifier.stopping();
        drop(self.stop.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::notify::ManagerVariables;
    use std::cell::Cell;
    use std::os::unix::net::UnixDatagram;

    fn manager(folder: &tempfile::TempDir) -> (UnixDatagram, Notifier) {
        let path = folder.path().join("notify");
        let manager = UnixDatagram::bind(&path).unwrap();
        let notifier = Notifier::new(&ManagerVariables {
            notify_socket: Some(path.into()),
            watchdog_usec: Some("1000".into()),
            watchdog_pid: None,
        });
        (manager, notifier.unwrap().unwrap())
    }

    /// All messages received so far, without waiting.
    fn received(manager: &UnixDatagram) -> Vec<String> {
        manager.set_nonblocking(true).unwrap();
        let mut buffer = [0; 256];
        core::iter::from_fn(|| manager.recv(&mut buffer).ok().map(|n| buffer[..n].to_vec()))
            .map(|bytes| String::from_utf8(bytes).unwrap())
            .collect()
    }

    #[test]
    fn all_advanced_requires_progress_of_every_thread() {
        let (a, b) = (LivenessCounter::default(), LivenessCounter::default());
        let mut monitor = LivenessMonitor::new(&[a.clone(), b.clone()]);
        assert!(!monitor.all_advanced(), "no thread has advanced");
        a.increment();
        assert!(!monitor.all_advanced(), "one thread has not advanced");
        b.increment();
        assert!(monitor.all_advanced());
        assert!(!monitor.all_advanced(), "no thread has advanced since");
        b.increment();
        assert!(!monitor.all_advanced(), "one hangs");
        a.increment();
        assert!(
            monitor.all_advanced(),
            "earlier progress of the other thread counts"
        );
    }

    /// The loop of the heartbeat thread with a simulated wait: the counter advances in three of five intervals.
    #[test]
    fn watchdog_messages_stop_while_a_thread_hangs() {
        let folder = tempfile::tempdir().unwrap();
        let (manager, notifier) = manager(&folder);
        let counter = LivenessCounter::default();
        let interval = Cell::new(0);
        send_watchdog_messages(
            &notifier,
            LivenessMonitor::new(core::slice::from_ref(&counter)),
            Duration::ZERO,
            &|_| {
                interval.set(interval.get() + 1);
                if interval.get() <= 3 {
                    counter.increment();
                }
                interval.get() <= 5
            },
        );
        assert_eq!(received(&manager), ["WATCHDOG=1\n"; 3]);
    }

    #[test]
    fn heartbeat_sends_ready_watchdog_and_stopping() {
        let folder = tempfile::tempdir().unwrap();
        let (manager, notifier) = manager(&folder);
        let counter = LivenessCounter::default();
        let heartbeat = Heartbeat::start(notifier, core::slice::from_ref(&counter)).unwrap();
        let mut buffer = [0; 256];
        let mut next = || {
            let bytes = manager.recv(&mut buffer).unwrap();
            String::from_utf8(buffer[..bytes].to_vec()).unwrap()
        };
        assert_eq!(next(), "READY=1\n");
        for _ in 0..3 {
            counter.increment();
            assert_eq!(next(), "WATCHDOG=1\n", "each iteration sends a message");
        }
        // While the counter does not change, no watchdog message is sent, however long the drop takes.
        drop(heartbeat);
        assert_eq!(received(&manager), ["STOPPING=1\n"]);
    }

    #[test]
    fn manager_without_watchdog_gets_only_ready_and_stopping() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let manager = UnixDatagram::bind(&path).unwrap();
        let variables = ManagerVariables {
            notify_socket: Some(path.into()),
            ..ManagerVariables::default()
        };
        let notifier = Notifier::new(&variables).unwrap().unwrap();
        let counter = LivenessCounter::default();
        let heartbeat = Heartbeat::start(notifier, core::slice::from_ref(&counter)).unwrap();
        counter.increment();
        drop(heartbeat);
        assert_eq!(received(&manager), ["READY=1\n", "STOPPING=1\n"]);
    }
}
