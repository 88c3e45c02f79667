//! Tests of feedback from the wrong motor or of the wrong length, and of the ambiguity with register replies.

use supple_damiao::feedback::FeedbackError;
use supple_damiao::register::Operation;
use supple_damiao::{Feedback, Frame, Register, RegisterReply, Status};

#[test]
fn feedback_of_another_motor_is_refused() {
    let frame = Frame::new(0x13, &[0x13, 0x7F, 0x3B, 0x7F, 0xF8, 0, 0x1A, 0x19]).unwrap();
    assert!(Feedback::of_motor(&frame, 3).is_ok());
    let error = Feedback::of_motor(&frame, 4).unwrap_err();
    assert_eq!(
        error,
        FeedbackError::Motor {
            found: 3,
            expected: 4
        }
    );
    assert_eq!(
        error.to_string(),
        "feedback of motor 3 came with the reply id of motor 4"
    );
}

#[test]
fn feedback_of_another_length_is_refused() {
    let frame = Frame::new(0x13, &[0x13, 0x7F]).unwrap();
    assert_eq!(Feedback::parse(&frame), Err(FeedbackError::Length(2)));
}

/// A register reply has the form of feedback of a disabled motor near -12.48 rad; only the request distinguishes them.
#[test]
fn a_register_reply_also_parses_as_feedback() {
    let frame = Frame::new(0x13, &[0x03, 0x00, 0x33, 0x0A, 1, 0, 0, 0]).unwrap();
    assert!(RegisterReply::parse(&frame, 3, Operation::Read, Register::MODE).is_some());
    let feedback = Feedback::of_motor(&frame, 3).unwrap();
    assert_eq!(feedback.status, Status::Disabled);
    let ranges = supple_damiao::Ranges::new(12.5, 30.0, 10.0).unwrap();
    assert!((feedback.position_rad(&ranges) + 12.4805).abs() < 1e-3);
}

#[test]
fn every_code_has_a_status_and_only_one_has_torque() {
    for code in 0..16 {
        let status = Status::from_code(code);
        assert_eq!(status.code(), code);
        assert_eq!(status == Status::Enabled, code == 1);
        assert_eq!(status.is_error(), code > 1);
        assert!(!status.to_string().is_empty());
    }
    assert_eq!(Status::from_code(5).to_string(), "unknown error code 5");
}

#[test]
fn frames_convert_to_and_from_both_bus_formats() {
    use supple_can_frame::{CanFrame, CanId, FrameFormat};
    let frame = supple_damiao::SpecialCommand::Enable.emit(2);
    for format in [
        FrameFormat::Classic,
        FrameFormat::Fd {
            bit_rate_switch: true,
        },
    ] {
        let on_bus = frame.on_bus(format);
        assert_eq!(on_bus.format(), format);
        assert_eq!(Frame::of_bus(&on_bus), Ok(frame));
    }
    let extended = CanFrame::new(CanId::extended(2).unwrap(), &[0; 8]).unwrap();
    assert!(Frame::of_bus(&extended).is_err());
    let long = CanFrame::fd(CanId::standard(2).unwrap(), true, &[0; 12]).unwrap();
    assert!(Frame::of_bus(&long).is_err());
}
