//! Tests of the force/torque sensor: two little-endian frames, and a tare time of slightly more than a second.

use crate::support::{Host, MS};

/// Property FT of node 8.
const FT: u8 = 54;

fn read(host: &mut Host) -> (Vec<u8>, Vec<u8>) {
    host.send(8, &[FT]);
    let received = host.receive_frames(MS);
    let ids: Vec<_> = received.iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0x50a, 0x50b]);
    (received[0].1.clone(), received[1].1.clone())
}

#[test]
fn a_reading_is_a_force_frame_and_a_torque_frame_with_status() {
    let mut host = Host::awake();
    host.listen(MS);
    let (force, torque) = read(&mut host);
    assert_eq!((force.len(), torque.len()), (6, 7));
    // No force acts on the tip; 1 N is 256 counts.
    for axis in force.chunks(2) {
        assert!(
            i16::from_le_bytes([axis[0], axis[1]]).abs() < 26,
            "{force:?}"
        );
    }
    assert_eq!(torque[6], 0);
}

#[test]
fn taring_gives_zeros_with_the_taring_status() {
    let mut host = Host::awake();
    host.set(8, FT, 0);
    host.listen(1000 * MS);
    let (force, torque) = read(&mut host);
    assert_eq!(force, [0; 6]);
    assert_eq!(torque, [0, 0, 0, 0, 0, 0, 0x7f]);
    host.listen(200 * MS);
    assert_eq!(read(&mut host).1[6], 0);
}
