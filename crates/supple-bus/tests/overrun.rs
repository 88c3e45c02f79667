//! Frames that are not read in time, on a CAN interface of the kernel: lost, but neither silently nor
//! uncounted. `./ci.sh socketcan` has such an interface.

use supple_bus::{Bus, BusError, BusFault, Event, SocketCan};
use supple_puck::CanFrame;

/// More than any receive buffer that was asked for holds.
const FLOOD: u64 = 20_000;
/// A queue that is full empties within this \[ns\].
const PATIENCE_NS: u64 = 1_000_000_000;

fn send(bus: &mut SocketCan, number: u64) {
    let frame = CanFrame::from_raw(0x123, &number.to_le_bytes()).unwrap();
    let until_ns = bus.now_ns() + PATIENCE_NS;
    while let Err(error) = bus.send(&frame) {
        assert!(matches!(error, BusError::Full), "{error}");
        assert!(bus.now_ns() < until_ns, "the queue stays full");
    }
    while bus.receive_until(0).unwrap().is_some() {}
}

/// Frames and gaps in what there is to read.
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
fn lost_frames_are_told_and_counted() {
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
    // What was lost last is told with whatever comes next.
    for number in 1..=2 {
        send(&mut sender, FLOOD + number);
        let (more_frames, more_gaps) = read(&mut reader);
        (frames, gaps) = (frames + more_frames, gaps + more_gaps);
    }
    assert!(gaps > 0);
    assert_eq!(frames + reader.lost(), FLOOD + 2);
    // And once it reads in time again, no more.
    let lost = reader.lost();
    send(&mut sender, 0);
    assert_eq!(read(&mut reader), (1, 0));
    assert_eq!(reader.lost(), lost);
}
