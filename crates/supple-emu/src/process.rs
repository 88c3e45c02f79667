//! The process: serves its host on the arm's bus, in real time or as the host advances it, until a shutdown.

use crate::error::EmulatorError;
use crate::real_time::{EmulatedArm, advance_to_bus_time, receive_host_frame};
use supple_bus::virtual_time::{EmulatedNodes, LockstepResponder};
use supple_bus::{Address, OwnerFolder, PacedResponder, SocketCan};
use supple_realtime::{Stop, monotonic_ns};

/// Maximum wait in virtual time, which pauses while the host is silent \[ns\].
const IDLE_NS: u64 = 10_000_000;
/// Time for which the process continues after no motor has torque any more \[ns\]: the host must receive the last replies.
const FINAL_REPORT_NS: u64 = 50_000_000;

/// An emulated arm with what belongs to its process: a pendant, a trace, messages.
pub(crate) trait ArmProcess {
    /// The arm.
    type Arm: EmulatedArm;

    /// Maximum time until the motors have no torque after a shutdown was requested \[ns\].
    const SHUTDOWN_TIMEOUT_NS: u64;

    /// The arm.
    fn arm(&mut self) -> &mut Self::Arm;

    /// Whether a motor has torque.
    fn has_torque(&self) -> bool;

    /// Does what is due between two exchanges with the host: answers the pendant, writes the trace, reports events.
    fn attend(&mut self);
}

/// Serves the host on this bus until a shutdown is requested and the motors have no torque, or the timeout has passed.
pub(crate) fn serve(
    process: &mut impl ArmProcess,
    address: &Address,
    virtual_time: bool,
    stop: &Stop,
) -> Result<(), EmulatorError> {
    let mut shutdown = Shutdown::default();
    match (address, virtual_time) {
        (Address::Folder(folder), true) => {
            let mut responder = LockstepResponder::open(&OwnerFolder::open(folder.clone())?)?;
            while !shutdown.is_complete(process, stop) {
                responder.serve(process.arm(), IDLE_NS)?;
                process.attend();
            }
        }
        (Address::Folder(folder), false) => {
            let folder = OwnerFolder::open(folder.clone())?;
            let mut responder = PacedResponder::open(&folder, process.arm().now_ns())?;
            while !shutdown.is_complete(process, stop) {
                responder.serve(process.arm())?;
                process.arm().set_offset_ns(responder.offset_ns());
                process.attend();
            }
        }
        (Address::Interface(name), false) => {
            let mut can = SocketCan::open(name)?;
            while !shutdown.is_complete(process, stop) {
                advance_to_bus_time(process.arm(), &mut can)?;
                process.attend();
                receive_host_frame(process.arm(), &mut can)?;
            }
        }
        (Address::Interface(_), true) => return Err(EmulatorError::VirtualInterface),
    }
    Ok(())
}

/// The end of a process: its host shuts down first.
#[derive(Default)]
struct Shutdown {
    /// When the process ends \[ns\], once a shutdown was requested.
    until_ns: Option<u64>,
    /// Whether no motor has had torque since.
    at_rest: bool,
}

impl Shutdown {
    fn is_complete<P: ArmProcess>(&mut self, process: &P, stop: &Stop) -> bool {
        if !stop.shutdown_requested() {
            return false;
        }
        let now_ns = monotonic_ns();
        let until_ns = self.until_ns.get_or_insert(now_ns + P::SHUTDOWN_TIMEOUT_NS);
        if !process.has_torque() && !self.at_rest {
            self.at_rest = true;
            *until_ns = (*until_ns).min(now_ns + FINAL_REPORT_NS);
        }
        now_ns > *until_ns
    }
}
