//! The thread that receives idle requests. It uses no shared-memory port, no disk and no standard error, so nothing can
//! block it. Twice a second it checks that the file of its socket exists, and creates a new socket if the file is missing.

use crate::error::RtError;
use crate::queues::IdleThreadChannel;
use core::time::Duration;
use std::thread::{Builder, JoinHandle};
use std::time::Instant;
use supple_ipc::{Domain, IdleServer, IpcError};
use supple_realtime::{Settings, apply_realtime_settings, diagnostics};

/// Poll interval while no request is pending.
const POLL_INTERVAL: Duration = Duration::from_millis(20);
/// Interval at which the thread checks that the socket's file exists.
const RESTORE_INTERVAL: Duration = Duration::from_millis(500);
/// Poll interval for the loop's reply while a request is pending.
const REPLY_POLL_INTERVAL: Duration = Duration::from_micros(500);
/// Difference by which the thread's priority is lower than the loop's.
const PRIORITY_OFFSET: u8 = 1;

/// The running thread for idle requests.
#[derive(Debug)]
pub struct IdleRequestThread {
    thread: JoinHandle<Result<(), IpcError>>,
}

impl IdleRequestThread {
    /// Starts the thread with a priority just below the loop's. Only the process that holds the controller link may
    /// call this.
    ///
    /// # Errors
    /// [`RtError::Ipc`] if the socket cannot be created, [`RtError::Thread`] if the thread cannot be started.
    pub fn start(
        domain: &Domain,
        channel: IdleThreadChannel,
        realtime: Settings,
    ) -> Result<IdleRequestThread, RtError> {
        let server = IdleServer::new(domain)?;
        let realtime = Settings {
            priority: realtime
                .priority
                .map(|p| p.saturating_sub(PRIORITY_OFFSET).max(1)),
            // This thread is not bound to a processor.
            cpu: None,
            lock_memory: false,
        };
        let thread = Builder::new()
            .name("supple-rt-idle".to_owned())
            .spawn(move || {
                // Warnings are ignored here: the loop requests the same settings and reports them.
                apply_realtime_settings(&realtime);
                work(server, channel)
            })
            .map_err(RtError::Thread)?;
        Ok(IdleRequestThread { thread })
    }

    /// Waits for the thread, which ends after the loop.
    ///
    /// # Errors
    /// [`RtError::Ipc`] if its socket failed, [`RtError::Helper`] if the thread panicked.
    pub fn finish(self) -> Result<(), RtError> {
        match self.thread.join() {
            Ok(worked) => Ok(worked?),
            Err(_) => Err(RtError::Helper),
        }
    }
}

fn work(mut server: IdleServer, mut channel: IdleThreadChannel) -> Result<(), IpcError> {
    let mut batch = 1;
    let mut looked = Instant::now();
    while !channel.ended() {
        if looked.elapsed() >= RESTORE_INTERVAL {
            looked = Instant::now();
            if server.restore() {
                diagnostics::post(
                    "supple-rt: warning: the socket of idle requests was removed and has been created again; keep other programs \
                     from removing files of a running system",
                );
            }
        }
        let wait = match server.has_pending() {
            true => REPLY_POLL_INTERVAL,
            false => POLL_INTERVAL,
        };
        if server.receive_requests(batch, wait)? {
            channel.set_requested(batch);
            batch += 1;
        }
        while let Some(reply) = channel.reply() {
            server.answer(&reply);
        }
    }
    Ok(())
}
