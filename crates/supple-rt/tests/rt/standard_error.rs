//! Tests of the program `supple-rt` whose standard error is not read: full, or closed.

use crate::scripted::Bench;
use crate::support::terminate;
use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use std::io::{PipeReader, PipeWriter, Write, pipe};
use supple_core::controller::Mode;
use supple_ipc::OperatorClient;
use supple_ipc::message::Outcome;

/// Creates a full pipe.
fn full() -> (PipeReader, PipeWriter) {
    let (reader, mut writer) = pipe().expect("a pipe");
    let flags = fcntl_getfl(&writer).expect("flags");
    fcntl_setfl(&writer, flags | OFlags::NONBLOCK).expect("set");
    while writer.write(&[b'.'; 4096]).is_ok() {}
    while writer.write(b".").is_ok() {}
    fcntl_setfl(&writer, flags).expect("set");
    (reader, writer)
}

fn check(stderr: PipeWriter) {
    let mut bench = Bench::start(stderr);
    let mut operator = OperatorClient::new(&bench.domain).expect("an operator");
    bench.assert_idle_acts(&mut operator);
    bench.hold(&mut operator);
    // A fault writes to standard error.
    bench.fault();
    let (answer, _) = bench.idle();
    assert_eq!(
        (answer.outcome, answer.mode),
        (Outcome::Accepted, Some(Mode::Fault))
    );
    bench.reset(&mut operator);
    bench.assert_idle_acts(&mut operator);
    terminate(&bench.child);
    let status = bench.child.wait().expect("it ends");
    assert_eq!(status.code(), Some(0), "{status}");
}

#[test]
fn full_standard_error_delays_neither_requests_nor_shutdown() {
    let (_reader, writer) = full();
    check(writer);
}

#[test]
fn closed_standard_error_does_not_end_the_process() {
    let (reader, writer) = pipe().expect("a pipe");
    drop(reader);
    check(writer);
}
