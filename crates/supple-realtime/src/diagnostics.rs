//! Lines for standard error, which may be closed, full, or a paused terminal.
//!
//! A process that controls an arm must not block on the reader of its standard error, nor end if there is none: a
//! background thread writes the lines. If the queue is full, messages are dropped; the next one that is accepted reports
//! how many.

use crate::background::BackgroundWriter;
use core::fmt::Display;
use core::time::Duration;
use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Queue length, in lines.
const CAPACITY: usize = 256;
/// Maximum time that a process waits for its last lines at its end.
const FLUSH_TIMEOUT: Duration = Duration::from_millis(300);

static WRITER: OnceLock<Option<BackgroundWriter>> = OnceLock::new();
/// Messages dropped since the last one that was accepted.
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
            // The process may end without another word.
            flush();
        }));
    }
}

/// Queues a line, given without its line end; after [`start`] it never blocks. It allocates, so threads that must not allocate cannot use
/// it.
pub fn post(line: impl Display) {
    post_part(format!("{line}\n"));
}

/// As [`post`], for text without a line end, such as a progress line that is overwritten.
pub fn post_part(text: String) {
    let dropped = DROPPED.swap(0, Ordering::Relaxed);
    let accepted = writer()
        .is_some_and(|writer| writer.submit(move || write(&mut std::io::stderr(), &text, dropped)));
    if !accepted {
        DROPPED.fetch_add(dropped + 1, Ordering::Relaxed);
    }
}

/// Waits briefly until the queued lines are written; call it last in a program. Returns false if they could not be
/// written in time, or there is no thread that writes them.
pub fn flush() -> bool {
    writer().is_some_and(|writer| writer.flush(FLUSH_TIMEOUT))
}

fn writer() -> Option<&'static BackgroundWriter> {
    let start = || BackgroundWriter::start("diagnostics", CAPACITY).ok();
    WRITER.get_or_init(start).as_ref()
}

/// One write per line, so that lines of several processes do not interleave. Errors are ignored: there is nowhere to
/// report them.
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
    fn closed_reader_is_no_error() {
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
