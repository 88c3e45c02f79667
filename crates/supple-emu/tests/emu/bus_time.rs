//! Compares frame durations at 1 Mbit/s with bits counted by hand.
//!
//! The position request, id 0x404 and payload 30, from the start bit to the end of its checksum; the bits in
//! brackets are stuff bits, each after five equal ones:
//!
//! ```text
//! 0 100000[1]00100 000[1] 0001 00110000 0[1]10101011011110
//! ```
//!
//! 42 bits and 3 stuff bits, then delimiters and acknowledge (3), end of frame (7) and interframe space (3): 58.

use crate::support::{Host, MS, P, frame};
use supple_bus::Event;

const US: u64 = 1_000;

/// Sends a frame that has no reply and returns its duration \[us\].
fn lasts_us(host: &mut Host, id: u32, payload: &[u8]) -> u64 {
    host.listen(MS);
    let (begin_ns, busy_ns) = (host.now_ns(), host.arm().bus_busy_ns());
    host.send(id, payload);
    let events = host.listen(MS);
    let busy_ns = host.arm().bus_busy_ns() - busy_ns;
    let sent = Event::Sent(frame(id, payload));
    assert_eq!(events, [(begin_ns + busy_ns, sent)]);
    assert_eq!(busy_ns % US, 0);
    busy_ns / US
}

#[test]
fn frame_durations_equal_bits_counted_by_hand() {
    let mut host = Host::awake();
    for (id, payload, bits) in [
        (0x01f, &[][..], 51),
        (0x01f, &[0x55; 8], 113),
        (0x01f, &[0x00; 8], 127),
        // The packed torques [1, 2, 3, 4], to a group without members.
        (
            0x41e,
            &[0xaa, 0x00, 0x04, 0x00, 0x20, 0x00, 0xc0, 0x04],
            123,
        ),
    ] {
        assert_eq!(lasts_us(&mut host, id, payload), bits, "{payload:x?}");
        assert_eq!(count_bits(id, payload), bits, "{payload:x?}");
    }
}

#[test]
fn random_frame_durations_equal_their_bits() {
    let mut host = Host::awake();
    let mut word = 0x9e37_79b9_7f4a_7c15_u64;
    for length in (0..=8).cycle().take(200) {
        word ^= word << 13;
        word ^= word >> 7;
        word ^= word << 17;
        let payload = &(word & word >> 20).to_be_bytes()[..length];
        let bits = lasts_us(&mut host, 0x41e, payload);
        assert_eq!(bits, count_bits(0x41e, payload), "{payload:x?}");
    }
}

/// Counts the bits of a frame as a string of zeros and ones, with the checksum by long division.
fn count_bits(id: u32, payload: &[u8]) -> u64 {
    let mut bits = format!("0{id:011b}000{:04b}", payload.len());
    bits.extend(payload.iter().map(|byte| format!("{byte:08b}")));
    let number = |c: char| u32::from(c == '1');
    let mut rest: Vec<u32> = bits.chars().map(number).chain([0; 15]).collect();
    let divisor: Vec<u32> = "1100010110011001".chars().map(number).collect();
    for start in 0..bits.len() {
        if rest[start] == 1 {
            for (digit, by) in rest[start..].iter_mut().zip(&divisor) {
                *digit ^= by;
            }
        }
    }
    let check: String = rest[bits.len()..].iter().map(u32::to_string).collect();
    bits.push_str(&check);
    let mut stuffed = String::new();
    for bit in bits.chars() {
        stuffed.push(bit);
        let opposite = if bit == '1' { '0' } else { '1' };
        if stuffed.ends_with(&bit.to_string().repeat(5)) {
            stuffed.push(opposite);
        }
    }
    stuffed.len() as u64 + 3 + 7 + 3
}

/// Request and four replies, all counters at zero: 58 bits, and 78, 77, 77, 77 for ids 0x423, 0x443, 0x463 and
/// 0x483 with three bytes of zero. The replies follow each other without a gap, after the latency of the pucks.
#[test]
fn a_position_request_takes_the_time_of_all_its_frames() {
    let mut host = Host::awake();
    for puck in 1..=4 {
        host.set(puck, P, 0);
    }
    host.listen(MS);
    let (begin_ns, busy_ns) = (host.now_ns(), host.arm().bus_busy_ns());
    host.send(0x404, &[P]);
    let events = host.listen(MS);
    let ends: Vec<u64> = events.iter().map(|(ns, _)| ns - begin_ns).collect();
    assert_eq!(events[0].1, Event::Sent(frame(0x404, &[0x30])));
    assert_eq!(ends[0], 58 * US);
    let mut bits: Vec<u64> = Vec::new();
    for (index, (_, event)) in events[1..].iter().enumerate() {
        let Event::Frame(reply) = event else {
            panic!("{event:?}")
        };
        assert_eq!(reply.payload(), [0, 0, 0]);
        bits.push(if reply.id().raw() == 0x423 { 78 } else { 77 });
        if index > 0 {
            assert_eq!(ends[index + 1] - ends[index], bits[index] * US);
        }
    }
    assert_eq!(bits.len(), 4);
    let latency_ns = ends[1] - ends[0] - bits[0] * US;
    assert!((10 * US..=15 * US).contains(&latency_ns), "{latency_ns}");
    let busy_ns = host.arm().bus_busy_ns() - busy_ns;
    assert_eq!(busy_ns, (58 + 78 + 3 * 77) * US);
}
