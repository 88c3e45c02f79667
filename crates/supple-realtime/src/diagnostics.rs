//! Writes lines to standard error, which may be closed, full, or a paused terminal.
//!
//! A process that controls an arm must not block if its standard error is not read, nor end if it is closed: a background
//! thread writes the lines. If the queue is full, messages are dropped; the next one that is accepted reports
//! how many.

use crate::background::BackgroundWriter;
use core::fmt::Display;
use core::time::Duration;
use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Queue length, in lines.
const CAPACITY: usize = 256;
/// Maximum time for which a process waits at its end until its last lines are written.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(300);

static WRITER: OnceLock<Option<BackgroundWriter>> = OnceLock::new();
/// Number of messages dropped since the last accepted message.
static DROPPED: AtomicU64 = AtomicU64::new(0);

/// Starts the writer thread and redirects panic messages to it. Call it at the start of a program, before realtime
/// settings are applied.
pub fn start() {
    if writer().is_some() {
        std::panic::set_hook(Box::new(|panic| {
            let thread = std::thread::current();
            post(format_args!(
                "thread {}: {panic}",
                thread.name().unwrap_or("without a name")
            ));
            // The process may end after this message.
            flush();
        }));
    }
}

/// Queues a line, given without its line end. After [`start`] this never blocks. It allocates memory: threads that may not
/// allocate must not call it.
pub fn post(line: impl Display) {
    post_part(format!("{line}\n"));
}

/// Queues text without a line end, such as a progress line that is overwritten; otherwise as [`post`].
pub fn post_part(text: String) {
    let dropped = DROPPED.swap(0, Ordering::Relaxed);
    let accepted = writer()
        .is_some_and(|writer| writer.submit(move || write(&mut std::io::stderr(), &text, dropped)));
    if !accepted {
        DROPPED.fetch_add(dropped + 1, Ordering::Relaxed);
    }
}

/// Waits briefly until the queued lines are written; call it last in a program. Returns false if they were
/// not written in time, or if [`start`] was not called.
pub fn flush() -> bool {
    writer().is_some_and(|writer| writer.flush(FLUSH_TIMEOUT))
}

fn writer() -> Option<&'static BackgroundWriter> {
    let start = || BackgroundWriter::start("diagnostics", CAPACITY).ok();
    WRITER.get_or_init(start).as_ref()
}

/// Writes a line with one call, so that lines of several processes do not interleave. Ignores errors, because they cannot
/// be reported.
fn write(out: &mut impl Write, text: &str, dropped: u64) {
    let text = match dropped {
        0 => text.to_owned(),
        n => format!("{n} messages were dropped here: standard error was blocked\n{text}"),
    };
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dropped_lines_are_reported() {
        let mut out = Vec::new();
        write(&mut out, "first\n", 0);
        write(&mut out, "second\n", 3);
        let written = String::from_utf8(out).expect("text");
        assert_eq!(
            written,
            "first\n3 messages were dropped here: standard error was blocked\nsecond\n"
        );
    }

    #[test]
    fn write_ignores_a_closed_standard_error() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
        }
        write(&mut Closed, "no reader\n", 0);
    }
}
