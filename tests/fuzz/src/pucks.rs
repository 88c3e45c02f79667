//! Fuzz targets of Barrett's frames, one for each decoder.

use supple_can_frame::{CanFrame, timing};
use supple_puck::force_torque::{Quantity, SensorReading};
use supple_puck::property::Reply;
use supple_puck::safety::{PenWord, Pendant, SafetyMode, SpeedLimit};
use supple_puck::status::{MotorMode, Role, Stat};
use supple_puck::{
    GroupId, Inbound, MessageId, PackedTorques, PositionReply, PropertyMessage, PropertyTable,
    PuckKind,
};

/// Builds a frame: two bytes of id, then the payload.
fn frame(data: &[u8]) -> Option<CanFrame> {
    let (id, payload) = data.split_first_chunk()?;
    let id = u32::from(u16::from_le_bytes(*id));
    let frame = CanFrame::from_raw(id, payload);
    assert_eq!(frame.is_ok(), id <= 0x7ff && payload.len() <= 8);
    frame.ok()
}

/// Returns the id of a frame that [`frame`] has built.
fn id_of(frame: &CanFrame) -> MessageId {
    MessageId::of(frame).expect("a classic frame with an 11-bit id")
}

/// Parses any frame to the host.
pub fn inbound(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    if let Ok((node, _)) = Inbound::parse(&frame) {
        assert_eq!(node, id_of(&frame).from());
    }
    let bits = timing::bits(&frame);
    assert!(bits >= timing::min_bits(frame.dlc()) && bits <= timing::max_bits(frame.dlc()));
}

/// Parses property messages and replies, and looks up their ids.
pub fn property(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    let Ok(message) = PropertyMessage::parse(&frame) else {
        assert!(Reply::parse(&frame).is_err());
        return;
    };
    assert_eq!(
        message.emit(id_of(&frame).from(), id_of(&frame).to()),
        frame
    );
    if let PropertyMessage::Set(id, value) = message {
        for kind in [PuckKind::Motor, PuckKind::Safety, PuckKind::ForceTorque] {
            if let Ok(table) = PropertyTable::of_firmware(kind, value.get()) {
                table.slot(id);
            }
        }
    }
}

/// Parses position replies.
pub fn position(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    if let Ok(reply) = PositionReply::parse(&frame) {
        let again = reply.emit(id_of(&frame).from());
        assert_eq!(PositionReply::parse(&again), Ok(reply));
    }
}

/// Parses packed torques.
pub fn torque(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    if let Ok(torques) = PackedTorques::parse(&frame) {
        let again = torques.emit(GroupId::LOWER_TORQUES);
        assert_eq!(again.payload(), frame.payload());
    }
}

/// Parses frames of the force/torque sensor.
pub fn force_torque(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    for quantity in [Quantity::Force, Quantity::Torque, Quantity::Acceleration] {
        if let Ok(reading) = SensorReading::parse(quantity, &frame) {
            let again = reading.emit(id_of(&frame).from());
            assert_eq!(again.payload(), frame.payload());
            assert_eq!(quantity.counts(reading.components()), Ok(reading.counts));
        }
    }
}

/// Parses the state word of the pendant, four bytes.
pub fn pendant(data: &[u8]) {
    let Some(data) = data.first_chunk() else {
        return;
    };
    let word = PenWord(u32::from_le_bytes(*data));
    if let Ok(pendant) = Pendant::parse(word) {
        assert_eq!(pendant.emit().0, word.0 & PenWord::MASK);
        pendant.segments.character();
    }
}

/// Parses property values of modes, roles and limits, four bytes.
pub fn values(data: &[u8]) {
    let Some(data) = data.first_chunk() else {
        return;
    };
    let value = i32::from_le_bytes(*data);
    let same = |found: i16| assert_eq!(i32::from(found), value);
    let _ = Stat::from_value(value).map(|stat| same(stat.value()));
    let _ = MotorMode::from_value(value).map(|mode| same(mode.value()));
    let _ = SafetyMode::from_value(value).map(|mode| same(mode.value()));
    let _ = SpeedLimit::from_value(value).map(|limit| same(limit.map_or(0, SpeedLimit::value)));
    let role = Role::from_value(value);
    assert!(role.role_type().is_ok() || role.kind().is_none());
}
