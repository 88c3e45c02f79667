//! Sockets and folders: whose they are, and what happens when the other side is not there.

use std::os::unix::fs::PermissionsExt;
use supple_bus::virtual_time::Lockstep;
use supple_bus::{Bus, BusError, BusFault, DatagramBus, Event, OwnerFolder, Side, SocketCan};
use supple_puck::CanFrame;

fn mode(path: &std::path::Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o777
}

#[test]
fn folder_and_sockets_are_the_owners_alone() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("a/b")).unwrap();
    let _bus = DatagramBus::open(&folder, Side::Host).unwrap();
    assert_eq!(mode(folder.path()), 0o700);
    assert_eq!(mode(&folder.path().join("host.can")), 0o600);
}

#[test]
fn a_folder_open_to_others_is_refused() {
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("open");
    std::fs::create_dir(&path).unwrap();
    std::fs::set_permissions(&path, PermissionsExt::from_mode(0o755)).unwrap();
    let error = OwnerFolder::open(&path).unwrap_err().to_string();
    assert!(
        error.contains("mode 755") && error.contains("chmod 700"),
        "{error}"
    );
    let link = temporary.path().join("link");
    let real = OwnerFolder::open(temporary.path().join("real")).unwrap();
    std::os::unix::fs::symlink(real.path(), &link).unwrap();
    let error = OwnerFolder::open(&link).unwrap_err().to_string();
    assert!(error.contains("is not a folder"), "{error}");
}

#[test]
fn a_side_has_one_process_and_outlives_its_end() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let first = DatagramBus::open(&folder, Side::Host).unwrap();
    let second = DatagramBus::open(&folder, Side::Host);
    assert!(matches!(second, Err(BusError::Taken { .. })), "{second:?}");
    drop(first);
    DatagramBus::open(&folder, Side::Host).unwrap();
}

#[test]
fn a_socket_left_behind_is_replaced() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    // As a process that was killed leaves it: bound, and nobody listens.
    drop(std::os::unix::net::UnixDatagram::bind(folder.path().join("host.can")).unwrap());
    DatagramBus::open(&folder, Side::Host).unwrap();
}

#[test]
fn without_a_peer_nobody_acknowledges_and_a_peer_may_come_later() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let mut host = DatagramBus::open(&folder, Side::Host).unwrap();
    let frame = CanFrame::from_raw(0x404, &[0x30]).unwrap();
    host.send(&frame).unwrap();
    let event = host.receive_until(0).unwrap();
    assert_eq!(event, Some(Event::Fault(BusFault::NoAcknowledge)));
    let mut arm = DatagramBus::open(&folder, Side::Arm).unwrap();
    host.send(&frame).unwrap();
    assert_eq!(host.receive_until(0).unwrap(), Some(Event::Sent(frame)));
    assert_eq!(arm.receive_until(0).unwrap(), Some(Event::Frame(frame)));
    drop(arm);
    host.send(&frame).unwrap();
    let event = host.receive_until(0).unwrap();
    assert_eq!(event, Some(Event::Fault(BusFault::NoAcknowledge)));
}

/// The arm stops reading: the queue fills, and that is said.
#[test]
fn a_full_queue_is_an_error_and_nothing_is_confirmed() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let mut host = DatagramBus::open(&folder, Side::Host).unwrap();
    let _arm = DatagramBus::open(&folder, Side::Arm).unwrap();
    let frame = CanFrame::from_raw(0x404, &[0x30]).unwrap();
    let mut sent = 0;
    let refused = loop {
        match host.send(&frame) {
            Ok(()) => sent += 1,
            Err(error) => break error,
        }
        assert!(sent < 10_000, "no queue is so long");
    };
    assert!(matches!(refused, BusError::Full));
    let mut confirmed = 0;
    while let Some(event) = host.receive_until(0).unwrap() {
        assert_eq!(event, Event::Sent(frame));
        confirmed += 1;
    }
    assert_eq!(confirmed, sent);
}

#[test]
fn error_frames_cross_as_faults() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let mut host = DatagramBus::open(&folder, Side::Host).unwrap();
    let mut arm = DatagramBus::open(&folder, Side::Arm).unwrap();
    for fault in [
        BusFault::Restarted,
        BusFault::ArbitrationLost,
        BusFault::Warning,
        BusFault::Protocol,
        BusFault::Passive,
        BusFault::Overrun,
        BusFault::Transceiver,
        BusFault::NoAcknowledge,
        BusFault::TransmitTimeout,
        BusFault::BusOff,
    ] {
        arm.send_fault(fault).unwrap();
        assert_eq!(host.receive_until(0).unwrap(), Some(Event::Fault(fault)));
    }
}

#[test]
fn virtual_time_needs_its_arm() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let error = Lockstep::open(&folder).unwrap_err();
    assert!(matches!(error, BusError::NoPeer { .. }), "{error}");
}

#[test]
fn an_interface_that_is_not_there_is_named_with_a_remedy() {
    let error = SocketCan::open("no_such_can").unwrap_err().to_string();
    assert!(error.contains("`no_such_can`"), "{error}");
    assert!(
        error.contains("ip -details link") || error.contains("no CAN"),
        "{error}"
    );
}
