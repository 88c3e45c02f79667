//! CPU affinity and scheduling priority of threads.

use rustix::thread::{CpuSet, Pid, sched_getaffinity, sched_setaffinity};
use std::io::{Error, ErrorKind};

/// Binds the calling thread to a processor.
pub fn bind(cpu: usize) -> Result<(), Error> {
    bind_thread(None, cpu)
}

/// Binds the first thread of a process, and so the threads that it creates from now on, to a processor.
///
/// # Errors
/// If there is no such process or processor.
pub fn bind_process(process: u32, cpu: usize) -> Result<(), Error> {
    let id = i32::try_from(process).ok().and_then(Pid::from_raw);
    bind_thread(Some(id.ok_or(ErrorKind::InvalidInput)?), cpu)
}

fn bind_thread(thread: Option<Pid>, cpu: usize) -> Result<(), Error> {
    if cpu >= CpuSet::MAX_CPU {
        return Err(ErrorKind::InvalidInput.into());
    }
    let mut set = CpuSet::new();
    set.set(cpu);
    Ok(sched_setaffinity(thread, &set)?)
}

/// Returns the processors on which the calling thread may run; none if the system does not tell.
pub fn allowed_processors() -> Vec<usize> {
    let set = sched_getaffinity(None);
    set.map_or_else(
        |_| Vec::new(),
        |set| {
            (0..CpuSet::MAX_CPU)
                .filter(|cpu| set.is_set(*cpu))
                .collect()
        },
    )
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
