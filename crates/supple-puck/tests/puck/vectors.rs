//! Frames encoded by hand from the protocol descriptions, byte by byte.

use supple_can_frame::CanFrame;
use supple_can_frame::timing::{max_bits, min_bits};
use supple_puck::force_torque::{self, Quantity, SensorReading, SensorStatus};
use supple_puck::inbound::InboundError;
use supple_puck::property::{self, PropertyError, Reply};
use supple_puck::safety::{Button, Level, PenWord, Pendant, PendantError, SevenSegment};
use supple_puck::*;

fn frame(id: u32, payload: &[u8]) -> CanFrame {
    CanFrame::from_raw(id, payload).unwrap()
}

fn joint(number: u8) -> NodeId {
    NodeId::joint(number).unwrap()
}

fn id(number: u8) -> PropertyId {
    PropertyId::new(number).unwrap()
}

#[test]
fn message_ids_equal_hand_encoded_ids() {
    let finger = NodeId::hand(1).unwrap();
    let group = MessageId::to_group;
    for (found, expected) in [
        (MessageId::to_node(NodeId::HOST, joint(3)), 0x003),
        (group(joint(3), GroupId::ARM), 0x464),
        (group(NodeId::HOST, GroupId::ACTUATORS), 0x400),
        (group(NodeId::HOST, GroupId::LOWER_TORQUES), 0x401),
        (group(NodeId::HOST, GroupId::UPPER_TORQUES), 0x402),
        (group(NodeId::HOST, GroupId::ARM), 0x404),
        (group(joint(1), GroupId::POSITION), 0x423),
        (group(joint(7), GroupId::POSITION), 0x4e3),
        (group(joint(1), GroupId::REPLY), 0x426),
        (group(NodeId::SAFETY, GroupId::REPLY), 0x546),
        (group(NodeId::SAFETY, GroupId::ACTUATORS), 0x540),
        (group(NodeId::FORCE_TORQUE, GroupId::FORCE), 0x50a),
        (group(NodeId::FORCE_TORQUE, GroupId::TORQUE), 0x50b),
        (group(NodeId::FORCE_TORQUE, GroupId::ACCELERATION), 0x50c),
        (group(finger, GroupId::TACTILE_FULL), 0x569),
    ] {
        assert_eq!(found.raw(), expected, "{found}");
    }
    assert_eq!(
        MessageId::from_raw(0x800).unwrap_err().to_string(),
        "message id is 0x800, it must be at most 0x7ff"
    );
    assert!(NodeId::new(32).is_err() && GroupId::new(32).is_err());
    assert_eq!([NodeId::joint(0), NodeId::joint(8)], [None, None]);
    assert_eq!([NodeId::hand(0), NodeId::hand(5)], [None, None]);
}

#[test]
fn frames_of_more_than_eight_bytes_are_rejected() {
    let error = CanFrame::from_raw(1, &[0; 9]).unwrap_err();
    assert_eq!(
        error.to_string(),
        "payload has 9 bytes, a classic frame carries at most 8"
    );
    assert_eq!(frame(0x404, &[0x30]).payload(), [0x30]);
}

#[test]
fn positions_equal_hand_encoded_frames() {
    for (counts, bytes) in [
        (0, [0x00, 0x00, 0x00]),
        (1, [0x00, 0x00, 0x01]),
        (-1, [0x3f, 0xff, 0xff]),
        (-2, [0x3f, 0xff, 0xfe]),
        (2_097_151, [0x1f, 0xff, 0xff]),
        (-2_097_152, [0x20, 0x00, 0x00]),
        (4096, [0x00, 0x10, 0x00]),
        (-12345, [0x3f, 0xcf, 0xc7]),
    ] {
        let reply = PositionReply {
            motor: Counts::new(counts).unwrap(),
            joint: None,
        };
        let expected = frame(0x423, &bytes);
        assert_eq!(reply.emit(joint(1)), expected);
        assert_eq!(PositionReply::parse(&expected), Ok(reply));
    }
    let both = PositionReply {
        motor: Counts::new(-12345).unwrap(),
        joint: Some(Counts::new(4096).unwrap()),
    };
    let expected = frame(0x463, &[0x3f, 0xcf, 0xc7, 0x00, 0x10, 0x00]);
    assert_eq!(both.emit(joint(3)), expected);
    assert_eq!(PositionReply::parse(&expected), Ok(both));
}

#[test]
fn torques_equal_hand_encoded_frames() {
    for (units, bytes) in [
        (
            [1, 2, 3, 4],
            [0xaa, 0x00, 0x04, 0x00, 0x20, 0x00, 0xc0, 0x04],
        ),
        (
            [-1, -2, -3, -4],
            [0xaa, 0xff, 0xff, 0xff, 0xef, 0xff, 0x7f, 0xfc],
        ),
        (
            [8191, -8191, 4860, -4320],
            [0xaa, 0x7f, 0xfe, 0x00, 0x14, 0xbf, 0x2f, 0x20],
        ),
        (
            [100, -200, 300, -400],
            [0xaa, 0x01, 0x93, 0xf3, 0x80, 0x4b, 0x3e, 0x70],
        ),
    ] {
        let torques = PackedTorques {
            property: id(42),
            slots: units.map(PuckTorque::saturating),
        };
        let expected = frame(0x401, &bytes);
        assert_eq!(torques.emit(GroupId::LOWER_TORQUES), expected);
        assert_eq!(PackedTorques::parse(&expected), Ok(torques));
        let slots = [0, 1, 2, 3, 4, 5].map(|pidx| torques.slot(pidx));
        let [a, b, c, d] = torques.slots.map(Some);
        assert_eq!(slots, [None, a, b, c, d, None]);
    }
    let get = frame(0x401, &[0x2a, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(
        PackedTorques::parse(&get).unwrap_err().to_string(),
        "torque frame begins with 0x2a, expected a property id with bit 0x80 set"
    );
    assert!(PackedTorques::parse(&frame(0x401, &[0xaa; 7])).is_err());
}

#[test]
fn property_messages_equal_hand_encoded_frames() {
    let p = PropertyTable::of_firmware(PuckKind::Motor, 175)
        .unwrap()
        .id(Property::P)
        .unwrap();
    assert_eq!(property::get(GroupId::ARM, p), frame(0x404, &[0x30]));
    assert_eq!(
        property::set(NodeId::SAFETY, id(45), Value::Wide(4096)),
        frame(0x00a, &[0xad, 0, 0x00, 0x10, 0, 0])
    );
    assert_eq!(
        property::set(joint(2), id(8), Value::Narrow(-2)),
        frame(0x002, &[0x88, 0, 0xfe, 0xff])
    );
    let stat = Reply {
        property: id(5),
        value: Value::Narrow(2),
    };
    assert_eq!(stat.emit(joint(1)), frame(0x426, &[0x85, 0, 2, 0]));
    assert_eq!(Reply::parse(&frame(0x426, &[0x85, 0, 2, 0])), Ok(stat));
    let negative = Reply::parse(&frame(0x426, &[0x85, 0, 0xff, 0xff])).unwrap();
    assert_eq!(negative.value.get(), -1);
    let parse = |payload: &[u8]| Reply::parse(&frame(0x426, payload)).unwrap_err();
    assert_eq!(parse(&[0x05]), PropertyError::NotAReply(id(5)));
    assert_eq!(parse(&[0x85]), PropertyError::SetWithoutValue(0x85));
    assert_eq!(parse(&[0x05, 0, 2, 0]), PropertyError::GetWithValue(5));
    assert_eq!(parse(&[0x85, 1, 2, 0]), PropertyError::Padding(1));
    assert_eq!(
        parse(&[0x85, 0, 2]).to_string(),
        "property message: payload has 3 bytes, expected 1 or 4 or 6"
    );
}

#[test]
fn force_torque_frames_equal_hand_encoded_frames() {
    assert_eq!(force_torque::request(), frame(0x008, &[54]));
    assert_eq!(force_torque::request_acceleration(), frame(0x008, &[64]));
    assert_eq!(force_torque::tare(), frame(0x008, &[0xb6, 0, 0, 0, 0, 0]));
    // 1 N, -1 N, 0.5 N; then 1 N m, -0.25 N m, 0 with axis 2 saturated since the tare and bad data.
    let force = frame(0x50a, &[0x00, 0x01, 0x00, 0xff, 0x80, 0x00]);
    let force = SensorReading::parse(Quantity::Force, &force).unwrap();
    assert_eq!(force.components(), [1.0, -1.0, 0.5]);
    assert_eq!(force.status, None);
    let torque = frame(0x50b, &[0x00, 0x10, 0x00, 0xfc, 0x00, 0x00, 0x44]);
    let torque = SensorReading::parse(Quantity::Torque, &torque).unwrap();
    assert_eq!(torque.components(), [1.0, -0.25, 0.0]);
    let status = torque.status.unwrap();
    assert!(status.is_bad());
    let saturated = [0, 1, 2, 3, 4, 5, 6].map(|axis| status.saturated_since_tare(axis));
    let [no, yes] = [Some(false), Some(true)];
    assert_eq!(saturated, [no, no, yes, no, no, no, None]);
    assert!(SensorStatus::TARING.is_bad());
    let acceleration = frame(0x50c, &[0x00, 0x04, 0, 0, 0, 0]);
    let acceleration = SensorReading::parse(Quantity::Acceleration, &acceleration).unwrap();
    assert_eq!(acceleration.components(), [1.0, 0.0, 0.0]);
}

/// Idle, all levels safe except a voltage warning: button 11, idle light, '1', fields 001 001 010 001 001.
#[test]
fn the_pendant_word_equals_the_hand_encoded_word() {
    let word = PenWord(0x0d06_0000 | 0b001_001_010_001_001);
    let pendant = Pendant {
        button: Button::None,
        activate_light: false,
        idle_light: true,
        segments: SevenSegment::of('1').unwrap(),
        velocity: Level::Safe,
        torque: Level::Safe,
        voltage: Level::Warning,
        heartbeat: Level::Safe,
        other: Level::Safe,
    };
    assert_eq!(Pendant::parse(word), Ok(pendant));
    assert_eq!(pendant.emit(), word);
    assert_eq!(pendant.worst(), Level::Warning);
    let reply = frame(0x546, &[0xab, 0, 0x89, 0x12, 0x06, 0x0d]);
    let reply = Reply::parse(&reply).unwrap();
    assert_eq!(reply.property, id(43));
    assert_eq!(PenWord::from_value(reply.value.get()), word);
    assert_eq!(
        Pendant::parse(PenWord(word.0 | 0b110 << 9)),
        Err(PendantError {
            field: "heartbeat",
            bits: 0b111
        })
    );
}

#[test]
fn inbound_frames_are_distinguished_by_group() {
    let kind = |id, payload: &[u8]| Inbound::parse(&frame(id, payload));
    assert!(matches!(kind(0x423, &[0; 3]), Ok((n, Inbound::Position(_))) if n == joint(1)));
    assert!(matches!(
        kind(0x546, &[0x88, 0, 1, 0]),
        Ok((NodeId::SAFETY, Inbound::Reply(_)))
    ));
    for (id, quantity) in [
        (0x50a, Quantity::Force),
        (0x50b, Quantity::Torque),
        (0x50c, Quantity::Acceleration),
    ] {
        let (node, inbound) = kind(id, &[0; 7]).unwrap();
        assert_eq!(node, NodeId::FORCE_TORQUE);
        assert!(matches!(inbound, Inbound::Sensor(reading) if reading.quantity == quantity));
    }
    assert_eq!(
        kind(0x540, &[0x88, 0, 2, 0]),
        Ok((NodeId::SAFETY, Inbound::Other))
    );
    assert_eq!(kind(0x404, &[0x30]), Err(InboundError::FromHost));
    assert_eq!(
        kind(0x4e3, &[0; 4]).unwrap_err().to_string(),
        "position of node 7: payload has 4 bytes, expected 3 or 6"
    );
}

#[test]
fn cycle_durations_equal_those_computed_by_hand() {
    for (dlc, min, max) in [
        (1, 55, 65),
        (3, 71, 85),
        (4, 79, 95),
        (6, 95, 115),
        (7, 103, 125),
        (8, 111, 135),
    ] {
        assert_eq!((min_bits(dlc), max_bits(dlc)), (min, max), "{dlc}");
    }
    let cycle = |bits: fn(u8) -> u32, joints: u32, torque_frames: u32| {
        bits(1) + joints * bits(3) + torque_frames * bits(8)
    };
    assert_eq!([cycle(min_bits, 4, 1), cycle(max_bits, 4, 1)], [450, 540]);
    assert_eq!([cycle(min_bits, 7, 2), cycle(max_bits, 7, 2)], [774, 930]);
}
