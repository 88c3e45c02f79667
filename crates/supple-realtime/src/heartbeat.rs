//! Signs of life to the service manager, for as long as every thread that matters goes on.
//!
//! A thread with a period counts its turns in a [`Pulse`], which costs it one addition. A thread of its own
//! ([`Heartbeat`]) looks at the counts twice in the manager's time and sends a sign of life only where every
//! count has moved on: a thread that hangs ends the signs, and the manager ends the process. The plant then
//! does what it does whenever its controller is gone.

use crate::notify::{Notifier, NotifyError};
use core::time::Duration;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, SyncSender, sync_channel};
use std::thread::{Builder, JoinHandle};

/// Enough for a datagram; locked memory makes every page of a stack count.
const STACK_BYTES: usize = 64 * 1024;

/// Turns of one thread. Clones count the same.
#[derive(Clone, Debug, Default)]
pub struct Pulse(Arc<AtomicU64>);

impl Pulse {
    /// One turn more. Neither waits nor allocates.
    pub fn beat(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    /// Turns so far.
    pub fn count(&self) -> u64 {
        self.0.load(Ordering::Relaxed)
    }
}

/// Counts, and what they were at the last sign of life.
#[derive(Clone, Debug)]
pub struct Watch {
    pulses: Vec<(Pulse, u64)>,
}

impl Watch {
    /// Of these threads, from their counts now.
    pub fn new(pulses: &[Pulse]) -> Watch {
        let counted = pulses.iter().map(|pulse| (pulse.clone(), pulse.count()));
        Watch {
            pulses: counted.collect(),
        }
    }

    /// Every thread has made a turn since this was last true.
    pub fn moved_on(&mut self) -> bool {
        let counts: Vec<u64> = self.pulses.iter().map(|(pulse, _)| pulse.count()).collect();
        let moved = self.pulses.iter().zip(&counts);
        let all = moved.into_iter().all(|((_, last), count)| count != last);
        if all {
            for ((_, last), count) in self.pulses.iter_mut().zip(counts) {
                *last = count;
            }
        }
        all
    }
}

/// The thread that sends signs of life; the manager hears `STOPPING=1` when it is dropped.
#[derive(Debug)]
pub struct Heartbeat {
    thread: Option<JoinHandle<()>>,
    stop: Option<SyncSender<()>>,
    notifier: Arc<Notifier>,
}

impl Heartbeat {
    /// Says that the start is complete, and goes on to say that the threads are alive where the manager
    /// watches. To be called when their periods begin, before the calling thread becomes a realtime one: a
    /// thread inherits the priority and the processor of the one that starts it.
    ///
    /// # Errors
    /// [`NotifyError::Socket`] where the manager does not listen, [`NotifyError::Thread`].
    pub fn start(notifier: Notifier, pulses: &[Pulse]) -> Result<Heartbeat, NotifyError> {
        notifier.ready()?;
        let notifier = Arc::new(notifier);
        let mut heartbeat = Heartbeat {
            thread: None,
            stop: None,
            notifier: notifier.clone(),
        };
        if let Some(watchdog) = notifier.watchdog() {
            let (stop, stopped) = sync_channel::<()>(0);
            let watch = Watch::new(pulses);
            let every = watchdog / 2;
            let thread = Builder::new()
                .name("heartbeat".to_owned())
                .stack_size(STACK_BYTES)
                .spawn(move || {
                    beat(&notifier, watch, every, &|every| {
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

/// Signs of life as long as `wait` says to go on.
fn beat(notifier: &Notifier, mut watch: Watch, every: Duration, wait: &dyn Fn(Duration) -> bool) {
    while wait(every) {
        if watch.moved_on() {
            // A manager that is gone watches nobody.
            let _ = notifier.alive();
        }
    }
}

impl Drop for Heartbeat {
    fn drop(&mut self) {
        // First, so that the manager gives the way out its own time.
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

    /// What has come, without waiting.
    fn heard(manager: &UnixDatagram) -> Vec<String> {
        manager.set_nonblocking(true).unwrap();
        let mut buffer = [0; 256];
        core::iter::from_fn(|| manager.recv(&mut buffer).ok().map(|n| buffer[..n].to_vec()))
            .map(|bytes| String::from_utf8(bytes).unwrap())
            .collect()
    }

    #[test]
    fn every_thread_has_to_move_on() {
        let (a, b) = (Pulse::default(), Pulse::default());
        let mut watch = Watch::new(&[a.clone(), b.clone()]);
        assert!(!watch.moved_on(), "nobody has begun");
        a.beat();
        assert!(!watch.moved_on(), "one has not begun");
        b.beat();
        assert!(watch.moved_on());
        assert!(!watch.moved_on(), "nobody has moved since");
        b.beat();
        assert!(!watch.moved_on(), "one hangs");
        a.beat();
        assert!(watch.moved_on(), "what the other did meanwhile counts");
    }

    /// The thread's own loop with scripted time: the loop beats in three of five intervals.
    #[test]
    fn a_thread_that_hangs_ends_the_signs_of_life() {
        let folder = tempfile::tempdir().unwrap();
        let (manager, notifier) = manager(&folder);
        let pulse = Pulse::default();
        let interval = Cell::new(0);
        beat(
            &notifier,
            Watch::new(core::slice::from_ref(&pulse)),
            Duration::ZERO,
            &|_| {
                interval.set(interval.get() + 1);
                if interval.get() <= 3 {
                    pulse.beat();
                }
                interval.get() <= 5
            },
        );
        assert_eq!(heard(&manager), ["WATCHDOG=1\n"; 3]);
    }

    #[test]
    fn the_start_the_life_and_the_end_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let (manager, notifier) = manager(&folder);
        let pulse = Pulse::default();
        let heartbeat = Heartbeat::start(notifier, core::slice::from_ref(&pulse)).unwrap();
        let mut buffer = [0; 256];
        let mut next = || {
            let bytes = manager.recv(&mut buffer).unwrap();
            String::from_utf8(buffer[..bytes].to_vec()).unwrap()
        };
        assert_eq!(next(), "READY=1\n");
        for _ in 0..3 {
            pulse.beat();
            assert_eq!(next(), "WATCHDOG=1\n", "a turn is a sign of life");
        }
        // However long this takes, a count that stands still gives none.
        drop(heartbeat);
        assert_eq!(heard(&manager), ["STOPPING=1\n"]);
    }

    #[test]
    fn a_manager_that_does_not_watch_hears_of_start_and_end_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let manager = UnixDatagram::bind(&path).unwrap();
        let variables = ManagerVariables {
            notify_socket: Some(path.into()),
            ..ManagerVariables::default()
        };
        let notifier = Notifier::new(&variables).unwrap().unwrap();
        let pulse = Pulse::default();
        let heartbeat = Heartbeat::start(notifier, core::slice::from_ref(&pulse)).unwrap();
        pulse.beat();
        drop(heartbeat);
        assert_eq!(heard(&manager), ["READY=1\n", "STOPPING=1\n"]);
    }
}
