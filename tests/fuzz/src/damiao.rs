//! Fuzz targets of Damiao frames, as the host and as a motor parse them.

use supple_damiao::register::Operation;
use supple_damiao::{Feedback, Frame, MitCodes, Register, RegisterReply, Request};

/// Builds a frame from two bytes of id and the payload.
fn frame(data: &[u8]) -> Option<Frame> {
    let (id, payload) = data.split_first_chunk()?;
    let id = u32::from(u16::from_le_bytes(*id));
    let frame = Frame::new(id, payload);
    assert_eq!(frame.is_ok(), id <= 0x7ff && payload.len() <= 8);
    frame.ok()
}

/// Parses any frame to the host as feedback and as a register reply.
pub fn damiao_reply(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    if let Ok(feedback) = Feedback::parse(&frame) {
        assert_eq!(feedback.emit(frame.id()), frame);
    }
    let [id, _, _, register, ..] = *frame.payload() else {
        return;
    };
    for operation in [Operation::Read, Operation::Write] {
        let reply = RegisterReply::parse(&frame, id, operation, Register(register));
        if let Some(reply) = reply {
            assert_eq!(reply.emit(id, frame.id(), operation), frame);
            assert_eq!(reply.value().to_bytes(), reply.bytes);
            assert!(!reply.value().to_string().contains('\n'));
        }
    }
}

/// Parses any frame to a motor.
pub fn damiao_request(data: &[u8]) {
    let Some(frame) = frame(data) else {
        return;
    };
    let requests = (1..16u8).filter_map(|id| Some((id, Request::parse(&frame, id)?)));
    let requests: Vec<_> = requests.collect();
    assert!(requests.len() <= 1, "one motor receives a frame");
    for (id, request) in requests {
        if let Request::Mit(codes) = request {
            // Encoding the parsed codes gives a command, never a special frame.
            let again = codes.emit(id);
            assert!(matches!(Request::parse(&again, id), Some(Request::Mit(_))));
            let kp = codes.kp.min(0xFFE);
            let found = again.eight().map(MitCodes::parse);
            assert_eq!(found, Some(MitCodes { kp, ..codes }));
        }
    }
}
