//! The thread that hears requests for idle, and does nothing else: no port, no disk, no standard error holds it up.

use crate::error::RtError;
use crate::rings::IdleOutside;
use core::time::Duration;
use std::thread::{Builder, JoinHandle};
use supple_ipc::{Domain, IdleServer, IpcError};
use supple_realtime::{Settings, enter};

/// How often it looks whether the loop has ended.
const LOOK_EVERY: Duration = Duration::from_millis(20);
/// How often it looks for the loop's answer once somebody has asked.
const ANSWER_EVERY: Duration = Duration::from_micros(500);
/// By how much its priority is below that of the loop.
const BELOW: u8 = 1;

/// The thread at work.
#[derive(Debug)]
pub struct IdleWatch {
    thread: JoinHandle<Result<(), IpcError>>,
}

impl IdleWatch {
    /// Starts it, to run just below the loop's priority. To be called by who has the controller's place.
    ///
    /// # Errors
    /// [`RtError::Ipc`] where the socket is not to be had, [`RtError::Thread`].
    pub fn start(
        domain: &Domain,
        outside: IdleOutside,
        realtime: Settings,
    ) -> Result<IdleWatch, RtError> {
        let server = IdleServer::new(domain)?;
        let realtime = Settings {
            priority: realtime.priority.map(|p| p.saturating_sub(BELOW).max(1)),
            // Wherever there is time for it.
            cpu: None,
            lock_memory: false,
        };
        let thread = Builder::new()
            .name("supple-rt-idle".to_owned())
            .spawn(move || {
                // The loop asks for more, and says what it does not get.
                enter(&realtime);
                work(server, outside)
            })
            .map_err(RtError::Thread)?;
        Ok(IdleWatch { thread })
    }

    /// Waits until it has seen that the loop has ended.
    ///
    /// # Errors
    /// [`RtError::Ipc`] where its socket failed, [`RtError::Helper`].
    pub fn finish(self) -> Result<(), RtError> {
        match self.thread.join() {
            Ok(worked) => Ok(worked?),
            Err(_) => Err(RtError::Helper),
        }
    }
}

fn work(mut server: IdleServer, mut outside: IdleOutside) -> Result<(), IpcError> {
    let mut look = 1;
    while !outside.ended() {
        let wait = match server.is_asked() {
            true => ANSWER_EVERY,
            false => LOOK_EVERY,
        };
        if server.look(look, wait)? {
            outside.ask(look);
            look += 1;
        }
        while let Some(reply) = outside.reply() {
            server.answer(&reply);
        }
    }
    Ok(())
}
