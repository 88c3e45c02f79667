//! The operator's declaration that an arm without brakes is supported, by the signal SIGUSR1.

use core::sync::atomic::{AtomicBool, Ordering};

static DECLARED: AtomicBool = AtomicBool::new(false);

/// Whether the process has received SIGUSR1 since [`listen_for_support`].
pub fn support_is_declared() -> bool {
    DECLARED.load(Ordering::Acquire)
}

/// Forgets an earlier declaration: it is valid only while the program shuts down.
pub fn forget_support() {
    DECLARED.store(false, Ordering::Release);
}

/// Makes SIGUSR1 set the declaration. Before this call the signal ends the process.
pub fn listen_for_support() {
    let handler = declare as extern "C" fn(libc::c_int);
    // SAFETY: the handler only stores to an atomic, which is allowed in a signal handler.
    unsafe { libc::signal(libc::SIGUSR1, handler as libc::sighandler_t) };
}

extern "C" fn declare(_: libc::c_int) {
    DECLARED.store(true, Ordering::Release);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustix::process::{Signal, getpid, kill_process};

    #[test]
    fn the_signal_declares_support() {
        listen_for_support();
        assert!(!support_is_declared());
        kill_process(getpid(), Signal::USR1).expect("sent");
        let until = std::time::Instant::now() + core::time::Duration::from_secs(10);
        while !support_is_declared() && std::time::Instant::now() < until {
            std::thread::yield_now();
        }
        assert!(support_is_declared());
        forget_support();
        assert!(!support_is_declared());
    }
}
