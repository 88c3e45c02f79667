//! Baseline: two processes exchange one datagram each way per period.

use crate::common::{
    CONTROLLER_PRIORITY, Common, Failure, Measured, PLANT_PRIORITY, PeerProcess, run_periodically,
};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixDatagram;
use supple_ipc::message::{ArmState, TorqueCommand};

const REQUEST_BYTES: usize = size_of::<ArmState>();
const REPLY_BYTES: usize = size_of::<TorqueCommand>();

pub fn measure(common: &Common) -> Result<Measured, Failure> {
    let (socket, other) = UnixDatagram::pair()?;
    let _reflector = PeerProcess::start("reflect", common, |command| {
        command.stdin(OwnedFd::from(other));
    })?;
    let (there, mut back) = ([1; REQUEST_BYTES], [0; REPLY_BYTES]);
    let mut exchange = |_| {
        socket.send(&there)?;
        socket.recv(&mut back)?;
        Ok(())
    };
    // The peer is ready once it replies.
    exchange(0)?;
    common.enter(PLANT_PRIORITY);
    run_periodically(common, exchange)
}

pub fn answer_echo(common: &Common) -> Result<(), Failure> {
    let socket = UnixDatagram::from(io::stdin().as_fd().try_clone_to_owned()?);
    common.enter(CONTROLLER_PRIORITY);
    let (mut there, back) = ([0; REQUEST_BYTES], [1; REPLY_BYTES]);
    // The loop ends when the peer closes its socket.
    while socket.recv(&mut there)? > 0 {
        socket.send(&back)?;
    }
    Ok(())
}
