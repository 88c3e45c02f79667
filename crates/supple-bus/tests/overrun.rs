//! A CAN interface of the kernel loses frames that are not read in time; the bus reports and counts them.
//! `./ci.sh socketcan` provides such an interface.

use supple_bus::{Bus, BusError, BusFault, Event, SocketCan};
use supple_can_frame::CanFrame;

/// More frames than the requested receive buffer holds.
const FLOOD: u64 = 20_000;
/// Time within which a full queue empties \[ns\].
const ANSWER_TIMEOUT_NS: u64 = 1_000_000_000;

fn send(bus: &mut SocketCan, number: u64) {
    let frame = CanFrame::from_raw(0x123, &number.to_le_bytes()).unwrap();
    let until_ns = bus.now_ns() + ANSWER_TIMEOUT_NS;
    while let Err(error) = bus.send(&frame) {
        assert!(matches!(error, BusError::Full), "{error}");
        assert!(bus.now_ns() < until_ns, "the queue remains full");
    }
    while bus.receive_until(0).unwrap().is_some() {}
}

/// Reads all received events; returns the numbers of frames and of reported gaps.
fn read(bus: &mut SocketCan) -> (u64, u64) {
    let (mut frames, mut gaps) = (0, 0);
    while let Some(event) = bus.receive_until(0).unwrap() {
        match event {
            Event::Frame(_) => frames += 1,
            Event::Fault(BusFault::Overrun) => gaps += 1,
            other => panic!("{other:?}"),
        }
    }
    (frames, gaps)
}

#[test]
fn lost_frames_are_reported_and_counted() {
    let Ok(interface) = std::env::var("SUPPLE_CAN_INTERFACE") else {
        eprintln!("skipped: SUPPLE_CAN_INTERFACE is not set; ./ci.sh socketcan has one");
        return;
    };
    let mut sender = SocketCan::open(&interface).unwrap();
    let mut reader = SocketCan::open(&interface).unwrap();
    send(&mut sender, 0);
    assert_eq!(read(&mut reader), (1, 0));
    (1..=FLOOD).for_each(|number| send(&mut sender, number));
    let (mut frames, mut gaps) = read(&mut reader);
    assert!(frames < FLOOD, "nothing was lost");
    // The last loss is reported with the next frame.
    for number in 1..=2 {
        send(&mut sender, FLOOD + number);
        let (more_frames, more_gaps) = read(&mut reader);
        (frames, gaps) = (frames + more_frames, gaps + more_gaps);
    }
    assert!(gaps > 0);
    assert_eq!(frames + reader.lost(), FLOOD + 2);
    // After that, with timely reads, there are no further losses.
    let lost = reader.lost();
    send(&mut sender, 0);
    assert_eq!(read(&mut reader), (1, 0));
    assert_eq!(reader.lost(), lost);
}
