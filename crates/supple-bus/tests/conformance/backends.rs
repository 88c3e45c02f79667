//! Opens every backend with an echo node on the arm's side. Each function returns the echo node, which runs until it is
//! dropped, and the host's bus.

use crate::echo::{EchoNodes, EchoThread};
use supple_bus::virtual_time::{DirectBus, LockstepBus, LockstepResponder};
use supple_bus::{
    Bus, BusError, DatagramBus, FaultInjector, OwnerFolder, PacedBus, PacedResponder, Side,
    SocketCan,
};
use tempfile::TempDir;

type Arm = (Option<EchoThread>, Option<TempDir>);
type Opened = Option<(Arm, Box<dyn Bus>)>;

/// Returns the name of the CAN interface for the tests.
fn interface() -> String {
    std::env::var("SUPPLE_CAN_INTERFACE").unwrap_or_else(|_| "vcan0".into())
}

fn folder() -> (TempDir, OwnerFolder) {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    (temporary, folder)
}

pub fn direct() -> Opened {
    Some(((None, None), Box::new(DirectBus(EchoNodes::default()))))
}

pub fn lockstep() -> Opened {
    let (temporary, folder) = folder();
    let echo_thread = EchoThread::responder(LockstepResponder::open(&folder).unwrap());
    let bus = LockstepBus::open(&folder).unwrap();
    Some(((Some(echo_thread), Some(temporary)), Box::new(bus)))
}

pub fn paced() -> Opened {
    let (temporary, folder) = folder();
    let echo_thread = EchoThread::paced(PacedResponder::open(&folder, 0).unwrap());
    let bus = PacedBus::open(&folder).unwrap();
    Some(((Some(echo_thread), Some(temporary)), Box::new(bus)))
}

fn datagram_pair() -> (Arm, DatagramBus) {
    let (temporary, folder) = folder();
    let echo_thread = EchoThread::on_bus(DatagramBus::open(&folder, Side::Arm).unwrap());
    let bus = DatagramBus::open(&folder, Side::Host).unwrap();
    ((Some(echo_thread), Some(temporary)), bus)
}

pub fn datagram() -> Opened {
    let (arm, bus) = datagram_pair();
    Some((arm, Box::new(bus)))
}

/// Opens the CAN interface; if the kernel has none, prints the reason and returns `None`. The tests of this backend run
/// one after another, because every socket on the interface receives every frame.
pub fn socket_can() -> Opened {
    let name = interface();
    let bus = match SocketCan::open(&name) {
        Ok(bus) => bus,
        Err(error @ BusError::Interface { .. }) => {
            assert!(
                std::env::var_os("SUPPLE_CAN_INTERFACE").is_none(),
                "{error}"
            );
            eprintln!("skipped: {error}");
            return None;
        }
        Err(error) => panic!("{error}"),
    };
    let echo_thread = EchoThread::on_bus(SocketCan::open(&name).unwrap());
    Some(((Some(echo_thread), None), Box::new(bus)))
}

pub fn injected_direct() -> Opened {
    let bus = FaultInjector::new(DirectBus(EchoNodes::default()), 1);
    Some(((None, None), Box::new(bus)))
}

pub fn injected_datagram() -> Opened {
    let (arm, bus) = datagram_pair();
    Some((arm, Box::new(FaultInjector::new(bus, 1))))
}
