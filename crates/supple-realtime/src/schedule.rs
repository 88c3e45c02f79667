//! CPU affinity and scheduling priority of threads.

use rustix::thread::{CpuSet, sched_setaffinity};
use std::io::{Error, ErrorKind};

/// Binds the calling thread to a processor.
pub fn bind(cpu: usize) -> Result<(), Error> {
    if cpu >= CpuSet::MAX_CPU {
        return Err(ErrorKind::InvalidInput.into());
    }
    let mut set = CpuSet::new();
    set.set(cpu);
    Ok(sched_setaffinity(None, &set)?)
}

/// Schedules the calling thread with SCHED_FIFO at this priority.
pub fn set_sched_fifo(priority: u8) -> Result<(), Error> {
    let parameters = libc::sched_param {
        sched_priority: i32::from(priority),
    };
    // SAFETY: 0 is the calling thread; the parameters outlive the call.
    let status = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameters) };
    match status {
        0 => Ok(()),
        _ => Err(Error::last_os_error()),
    }
}
