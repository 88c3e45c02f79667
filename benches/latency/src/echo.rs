//! The least that two processes can do: a datagram there, a datagram back, once a period.

use crate::{ANSWERING_PRIORITY, ASKING_PRIORITY, Common, Failure, Measured, Other, once_a_period};
use std::io;
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixDatagram;
use supple_ipc::message::{ArmState, TorqueCommand};

const THERE_BYTES: usize = size_of::<ArmState>();
const BACK_BYTES: usize = size_of::<TorqueCommand>();

pub fn measure(common: &Common) -> Result<Measured, Failure> {
    let (socket, other) = UnixDatagram::pair()?;
    let _reflector = Other::start("reflect", common, |command| {
        command.stdin(OwnedFd::from(other));
    })?;
    let (there, mut back) = ([1; THERE_BYTES], [0; BACK_BYTES]);
    let mut exchange = |_| {
        socket.send(&there)?;
        socket.recv(&mut back)?;
        Ok(())
    };
    // The other side is ready once it answers.
    exchange(0)?;
    common.enter(ASKING_PRIORITY);
    once_a_period(common, exchange)
}

pub fn reflect(common: &Common) -> Result<(), Failure> {
    let socket = UnixDatagram::from(io::stdin().as_fd().try_clone_to_owned()?);
    common.enter(ANSWERING_PRIORITY);
    let (mut there, back) = ([0; THERE_BYTES], [1; BACK_BYTES]);
    // Nothing comes any more once the other side is gone.
    while socket.recv(&mut there)? > 0 {
        socket.send(&back)?;
    }
    Ok(())
}
