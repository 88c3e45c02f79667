//! Access rights of sockets and folders, and behaviour of a bus without the other side.

use std::os::unix::fs::PermissionsExt;
use supple_bus::virtual_time::LockstepBus;
use supple_bus::{Bus, BusError, BusFault, DatagramBus, Event, OwnerFolder, Side, SocketCan};
use supple_can_frame::CanFrame;

fn mode(path: &std::path::Path) -> u32 {
    std::fs::metadata(path).unwrap().permissions().mode() & 0o777
}

#[test]
fn folder_and_sockets_are_accessible_only_to_the_owner() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("a/b")).unwrap();
    let _bus = DatagramBus::open(&folder, Side::Host).unwrap();
    assert_eq!(mode(folder.path()), 0o700);
    assert_eq!(mode(&folder.path().join("host.can")), 0o600);
}

#[test]
fn a_folder_open_to_others_is_rejected() {
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
    assert!(error.contains("is a link or no folder"), "{error}");
}

#[test]
fn a_side_can_be_opened_once_and_again_after_it_is_closed() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let first = DatagramBus::open(&folder, Side::Host).unwrap();
    let second = DatagramBus::open(&folder, Side::Host);
    assert!(
        matches!(second, Err(BusError::SocketInUse { .. })),
        "{second:?}"
    );
    drop(first);
    DatagramBus::open(&folder, Side::Host).unwrap();
}

#[test]
fn a_socket_left_behind_is_replaced() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    // A killed process leaves such a socket: bound, without a listener.
    drop(std::os::unix::net::UnixDatagram::bind(folder.path().join("host.can")).unwrap());
    DatagramBus::open(&folder, Side::Host).unwrap();
}

#[test]
fn frames_are_not_acknowledged_until_a_peer_connects() {
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

/// If the arm stops reading, the queue fills, which is an error.
#[test]
fn send_fails_when_the_queue_is_full_and_only_sent_frames_are_confirmed() {
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
        assert!(sent < 10_000, "the queue does not fill");
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
fn error_frames_arrive_as_faults() {
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
fn virtual_time_requires_a_running_arm() {
    let temporary = tempfile::tempdir().unwrap();
    let folder = OwnerFolder::open(temporary.path().join("bus")).unwrap();
    let error = LockstepBus::open(&folder).unwrap_err();
    assert!(matches!(error, BusError::NoPeer { .. }), "{error}");
}

#[test]
fn the_error_of_a_missing_interface_has_its_name_and_a_remedy() {
    let error = SocketCan::open("no_such_can").unwrap_err().to_string();
    assert!(error.contains("`no_such_can`"), "{error}");
    assert!(
        error.contains("ip -details link") || error.contains("no CAN support"),
        "{error}"
    );
}
