//! Lines for standard error, which may be closed, full, or a terminal that somebody has paused.
//!
//! A process that controls an arm must not wait for whoever reads its words, nor end because nobody does: lines are
//! written by a thread of their own. A line that finds no room is dropped, and the next one says how many were.

use crate::background::BackgroundWriter;
use core::fmt::Display;
use core::time::Duration;
use std::io::Write;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU64, Ordering};

/// Lines that may wait.
const CAPACITY: usize = 256;
/// How long the end of a process waits for its last lines.
const FLUSH_WITHIN: Duration = Duration::from_millis(300);

static WRITER: OnceLock<Option<BackgroundWriter>> = OnceLock::new();
/// Lines dropped since the last one that was written.
static DROPPED: AtomicU64 = AtomicU64::new(0);

/// Starts the writer, and sends the words of panics to it. To be called at the start of a program, before it asks for a
/// realtime priority.
pub fn start() {
    if writer().is_some() {
        std::panic::set_hook(Box::new(|panic| post(format_args!("{panic}"))));
    }
}

/// Hands over a line, without its end; never waits. It allocates: not for a thread that must not.
pub fn post(line: impl Display) {
    post_part(format!("{line}\n"));
}

/// As [`post`], of text that is no whole line, such as one that is written over again and again.
pub fn post_part(text: String) {
    let accepted = writer().is_some_and(|writer| {
        writer.submit(move || {
            write(
                &mut std::io::stderr(),
                &text,
                DROPPED.swap(0, Ordering::Relaxed),
            )
        })
    });
    if !accepted {
        DROPPED.fetch_add(1, Ordering::Relaxed);
    }
}

/// Waits a moment for the lines that were handed over, as the last thing a program does; false where nobody takes
/// them.
pub fn flush() -> bool {
    writer().is_none_or(|writer| writer.flush(FLUSH_WITHIN))
}

fn writer() -> Option<&'static BackgroundWriter> {
    let start = || BackgroundWriter::start("diagnostics", CAPACITY).ok();
    WRITER.get_or_init(start).as_ref()
}

/// One call for a line: lines of several processes do not mix. There is nobody to tell where it fails.
fn write(out: &mut impl Write, text: &str, dropped: u64) {
    let text = match dropped {
        0 => text.to_owned(),
        n => format!("{n} lines were dropped here: nobody read them\n{text}"),
    };
    let _ = out.write_all(text.as_bytes()).and_then(|()| out.flush());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_that_were_dropped_are_told() {
        let mut out = Vec::new();
        write(&mut out, "first\n", 0);
        write(&mut out, "second\n", 3);
        let said = String::from_utf8(out).expect("text");
        assert_eq!(
            said,
            "first\n3 lines were dropped here: nobody read them\nsecond\n"
        );
    }

    #[test]
    fn a_reader_that_is_gone_is_no_error() {
        struct Closed;
        impl Write for Closed {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Err(std::io::ErrorKind::BrokenPipe.into())
            }
        }
        write(&mut Closed, "nobody hears\n", 0);
    }
}
