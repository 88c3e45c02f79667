//! Round-trip tests: encoded values parse to themselves, and every input is either rejected or re-encoded identically.

use crate::property::config;
use proptest::prelude::*;
use supple_can_frame::CanFrame;
use supple_can_frame::timing::{bits, max_bits, min_bits};
use supple_puck::force_torque::{Quantity, SensorReading, SensorStatus};
use supple_puck::property::Reply;
use supple_puck::safety::{PenWord, Pendant, SafetyMode, SevenSegment, SpeedLimit};
use supple_puck::status::{MotorMode, Role, Stat};
use supple_puck::*;

#[test]
fn every_22_bit_position_round_trips() {
    let node = NodeId::joint(1).unwrap();
    for counts in Counts::MIN.get()..=Counts::MAX.get() {
        let motor = Counts::new(counts).unwrap();
        let joint = Counts::new(-1 - counts).unwrap();
        for joint in [None, Some(joint)] {
            let reply = PositionReply { motor, joint };
            assert_eq!(PositionReply::parse(&reply.emit(node)), Ok(reply));
        }
    }
    assert!(Counts::new(Counts::MAX.get() + 1).is_err());
    assert!(Counts::new(Counts::MIN.get() - 1).is_err());
}

/// Tests all 16384 patterns in all four slots; a pattern must not change the values in the other slots.
#[test]
fn every_14_bit_torque_round_trips() {
    for pattern in 0..1u64 << 14 {
        let others = pattern.wrapping_mul(0x9e37) & 0x3fff;
        for slot in 0..4 {
            let slots: [u64; 4] =
                core::array::from_fn(|i| if i == slot { pattern } else { others });
            let payload = slots.iter().fold(0xaa, |bits, slot| bits << 14 | slot);
            let frame = CanFrame::from_raw(0x402, &payload.to_be_bytes()).unwrap();
            let torques = PackedTorques::parse(&frame).unwrap();
            let signed = |p: u64| p as i16 - if p >= 1 << 13 { 1 << 14 } else { 0 };
            assert_eq!(torques.slots.map(PuckTorque::units), slots.map(signed));
            assert_eq!(torques.emit(GroupId::UPPER_TORQUES), frame);
        }
    }
}

#[test]
fn every_11_bit_id_round_trips() {
    for raw in 0..0x800 {
        let id = MessageId::from_raw(raw).unwrap();
        assert_eq!(MessageId::new(id.from(), id.to()), id);
        assert_eq!(u32::from(id.raw()), raw);
    }
}

/// All values of the pendant's 15 level bits, and of its other 12 bits, with the rest fixed.
#[test]
fn every_pendant_word_is_rejected_or_round_trips() {
    let safe = 0b001_001_001_001_001;
    let mut read = 0;
    for word in (0..1 << 15).chain((0..1 << 12).map(|upper| upper << 16 | safe)) {
        if let Ok(pendant) = Pendant::parse(PenWord(word)) {
            assert_eq!(pendant.emit(), PenWord(word));
            read += 1;
        } else {
            let one_hot = |field: u32| (word >> (3 * field) & 7).count_ones() == 1;
            assert!(!(0..5).all(one_hot), "{word:#x}");
        }
    }
    assert_eq!(read, 3u32.pow(5) + (1 << 12));
}

#[test]
fn seven_segment_digits_round_trip() {
    let shown = (0..=255).filter_map(|bits| Some((bits, SevenSegment(bits).character()?)));
    let shown: Vec<_> = shown.collect();
    assert_eq!(shown.len(), 12);
    for (bits, character) in shown {
        assert_eq!(SevenSegment::of(character), Some(SevenSegment(bits)));
    }
    assert_eq!(SevenSegment::of('P'), None);
}

/// Generates any classic frame: all ids, all lengths, all bytes.
fn any_frame() -> impl Strategy<Value = CanFrame> {
    (0..0x800u32, proptest::collection::vec(any::<u8>(), 0..=8))
        .prop_map(|(id, payload)| CanFrame::from_raw(id, &payload).unwrap())
}

fn any_node() -> impl Strategy<Value = NodeId> {
    (0..32u8).prop_map(|number| NodeId::new(number).unwrap())
}

fn any_value() -> impl Strategy<Value = Value> {
    prop_oneof![
        any::<i16>().prop_map(Value::Narrow),
        any::<i32>().prop_map(Value::Wide),
    ]
}

fn any_quantity() -> impl Strategy<Value = Quantity> {
    prop_oneof![
        Just(Quantity::Force),
        Just(Quantity::Torque),
        Just(Quantity::Acceleration)
    ]
}

fn any_destination() -> impl Strategy<Value = Destination> {
    (0..0x800u32).prop_map(|raw| MessageId::from_raw(raw).unwrap().to())
}

proptest! {
    #![proptest_config(config(1000, 20_260_301))]

    #[test]
    fn property_messages_round_trip(
        from in any_node(),
        to in any_destination(),
        id in 0..128u8,
        value in any_value(),
    ) {
        let id = PropertyId::new(id).unwrap();
        for message in [PropertyMessage::Get(id), PropertyMessage::Set(id, value)] {
            let frame = message.emit(from, to);
            let id = MessageId::of(&frame).unwrap();
            prop_assert_eq!(id.from(), from);
            prop_assert_eq!(id.to(), to);
            prop_assert_eq!(PropertyMessage::parse(&frame), Ok(message));
        }
        let reply = Reply { property: id, value };
        prop_assert_eq!(Reply::parse(&reply.emit(from)), Ok(reply));
        if from != NodeId::HOST {
            prop_assert_eq!(Inbound::parse(&reply.emit(from)), Ok((from, Inbound::Reply(reply))));
        }
    }

    #[test]
    fn sensor_readings_round_trip(
        from in any_node(),
        quantity in any_quantity(),
        counts in any::<[i16; 3]>(),
        status in any::<Option<u8>>(),
    ) {
        let reading = SensorReading { quantity, counts, status: status.map(SensorStatus) };
        prop_assert_eq!(SensorReading::parse(quantity, &reading.emit(from)), Ok(reading));
        prop_assert_eq!(quantity.counts(reading.components()), Ok(counts));
    }

    /// Decoders accept or reject any frame, and re-encode an accepted one identically.
    #[test]
    fn frames_are_rejected_or_round_trip(frame in any_frame()) {
        let id = MessageId::of(&frame).unwrap();
        let (from, to) = (id.from(), id.to());
        if let Ok(message) = PropertyMessage::parse(&frame) {
            prop_assert_eq!(message.emit(from, to), frame);
        }
        if let Ok(reply) = Reply::parse(&frame) {
            let written = reply.emit(from);
            prop_assert_eq!(written.payload(), frame.payload());
        }
        if let Ok(reply) = PositionReply::parse(&frame) {
            let mut defined = frame.payload().to_vec();
            for high in defined.iter_mut().step_by(3) {
                *high &= 0x3f;
            }
            let written = reply.emit(from);
            prop_assert_eq!(written.payload(), &defined[..]);
        }
        if let Ok(torques) = PackedTorques::parse(&frame) {
            let written = torques.emit(GroupId::LOWER_TORQUES);
            prop_assert_eq!(written.payload(), frame.payload());
        }
        for quantity in [Quantity::Force, Quantity::Torque, Quantity::Acceleration] {
            if let Ok(reading) = SensorReading::parse(quantity, &frame) {
                let written = reading.emit(from);
                prop_assert_eq!(written.payload(), frame.payload());
            }
        }
        if let Ok((node, inbound)) = Inbound::parse(&frame) {
            prop_assert_eq!(node, from);
            let written = match inbound {
                Inbound::Position(_) | Inbound::Other => None,
                Inbound::Reply(reply) => Some(reply.emit(from)),
                Inbound::Sensor(reading) => Some(reading.emit(from)),
            };
            prop_assert!(written.is_none_or(|written| written == frame));
        }
        let length = bits(&frame);
        prop_assert!((min_bits(frame.dlc())..=max_bits(frame.dlc())).contains(&length));
    }

    #[test]
    fn values_are_rejected_or_round_trip(value in prop_oneof![-3..9i32, any::<i32>()]) {
        let kept = |found: Option<i16>| found.is_none_or(|found| i32::from(found) == value);
        prop_assert!(kept(Stat::from_value(value).ok().map(Stat::value)));
        prop_assert!(kept(MotorMode::from_value(value).ok().map(MotorMode::value)));
        prop_assert!(kept(SafetyMode::from_value(value).ok().map(SafetyMode::value)));
        let speed = SpeedLimit::from_value(value).ok();
        prop_assert!(kept(speed.map(|limit| limit.map_or(0, SpeedLimit::value))));
        prop_assert_eq!(speed.is_some(), (0..=32767).contains(&value));
        let word = PenWord::from_value(value);
        prop_assert_eq!(word.value(), value);
        if let Ok(pendant) = Pendant::parse(word) {
            prop_assert_eq!(pendant.emit().0, word.0 & PenWord::MASK);
        }
        let role = Role::from_value(value);
        prop_assert_eq!(role.role_type().is_ok(), value & 0x1f <= 6);
    }
}
