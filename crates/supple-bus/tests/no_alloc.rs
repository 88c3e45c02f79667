//! Sending and receiving allocate nothing, on sockets and through the fault injector.

#[path = "../../../tests/support/counting.rs"]
mod counting;

use counting::count_allocations;
use supple_bus::{Bus, DatagramBus, Event, FaultInjector, FaultKind, FaultRule};
use supple_bus::{OwnerFolder, Side, TrafficDirection};
use supple_can_frame::CanFrame;

#[test]
fn a_thousand_exchanges_allocate_nothing() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let mut arm = DatagramBus::open(&folder, Side::Arm).unwrap();
    let host = DatagramBus::open(&folder, Side::Host).unwrap();
    let mut host = FaultInjector::new(host, 1);
    let none = FaultRule::always(TrafficDirection::Received, FaultKind::Loss).with_probability(0.0);
    host.add(none);
    let request = CanFrame::from_raw(0x404, &[0x30]).unwrap();
    let reply = CanFrame::from_raw(0x423, &[0, 0x10, 0]).unwrap();
    let mut exchange = || {
        host.send(&request).unwrap();
        assert_eq!(arm.receive_until(0).unwrap(), Some(Event::Frame(request)));
        arm.send(&reply).unwrap();
        assert_eq!(arm.receive_until(0).unwrap(), Some(Event::Sent(reply)));
        assert_eq!(host.receive_until(0).unwrap(), Some(Event::Sent(request)));
        assert_eq!(host.receive_until(0).unwrap(), Some(Event::Frame(reply)));
        // A wait that times out.
        let soon_ns = host.now_ns() + 1_000;
        assert_eq!(host.receive_until(soon_ns).unwrap(), None);
    };
    exchange();
    assert_eq!(count_allocations(|| (0..1000).for_each(|_| exchange())), 0);
}
