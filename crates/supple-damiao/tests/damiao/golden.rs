//! Compares the codec with reference frames, the rows of `data/golden.csv`.

use supple_damiao::{
    Feedback, Frame, MitCodes, MitCommand, Ranges, Register, RegisterReply, Request,
    SpecialCommand, Status, Value, flash, modes,
    register::{self, Operation},
};

const GOLDEN: &str = include_str!("../data/golden.csv");

struct Row {
    kind: String,
    frame: Frame,
    meaning: String,
    rounded: String,
}

/// Splits a line into fields; a field with commas is in quotation marks, which are doubled inside the field.
fn fields(line: &str) -> Vec<String> {
    let (mut fields, mut field, mut quoted) = (Vec::new(), String::new(), false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => fields.push(std::mem::take(&mut field)),
            c => field.push(c),
        }
    }
    fields.push(field);
    fields
}

fn frame(text: &str) -> Frame {
    let (id, data) = text.split_once('#').expect("id#data");
    let bytes: Vec<u8> = (0..data.len())
        .step_by(2)
        .map(|at| u8::from_str_radix(&data[at..at + 2], 16).unwrap())
        .collect();
    Frame::new(u32::from_str_radix(id, 16).unwrap(), &bytes).unwrap()
}

fn rows(kind: &str) -> Vec<Row> {
    let rows: Vec<Row> = GOLDEN
        .lines()
        .skip(1)
        .map(fields)
        .map(|fields| Row {
            kind: fields[0].clone(),
            frame: frame(&fields[1]),
            meaning: fields[2].clone(),
            rounded: fields[4].clone(),
        })
        .collect();
    assert_eq!(rows.len(), 63);
    rows.into_iter().filter(|row| row.kind == kind).collect()
}

/// Returns the number after `key=` in the column `meaning`.
fn number(meaning: &str, key: &str) -> f64 {
    let mut words = meaning.split([' ', ',']);
    let found = words.find_map(|word| word.strip_prefix(key)?.strip_prefix('='));
    found.expect(key).parse().expect("a number")
}

/// Returns the ranges of the motor that a frame is from.
fn ranges(meaning: &str) -> Ranges {
    let (velocity, torque) = match &meaning[..4] {
        "4310" => (30.0, 10.0),
        "4340" => (10.0, 28.0),
        "8009" => (45.0, 54.0),
        other => panic!("unknown type {other}"),
    };
    Ranges::new(12.5, velocity, torque).unwrap()
}

fn text(frame: &Frame) -> String {
    format!("{frame:?}")
}

#[test]
fn commands_equal_the_rounded_reference_frames() {
    let rows = rows("mit");
    assert_eq!(rows.len(), 17);
    for row in rows {
        let ranges = ranges(&row.meaning);
        let command = MitCommand {
            position_rad: number(&row.meaning, "p"),
            velocity_rad_per_s: number(&row.meaning, "v"),
            kp_nm_per_rad: number(&row.meaning, "kp"),
            kd_nm_s_per_rad: number(&row.meaning, "kd"),
            torque_nm: number(&row.meaning, "t"),
        };
        let sent = command.encode(row.frame.id() as u8, &ranges).unwrap();
        let expected = frame(&row.rounded);
        if command.kp_nm_per_rad < 500.0 {
            assert_eq!(text(&sent), row.rounded, "{}", row.meaning);
        } else {
            // The maximum stiffness is one step lower, so that no command is a special frame.
            let found = MitCodes::parse(sent.eight().unwrap());
            let golden = MitCodes::parse(expected.eight().unwrap());
            assert_eq!(
                found,
                MitCodes {
                    kp: 0xFFE,
                    ..golden
                },
                "{}",
                row.meaning
            );
        }
    }
}

/// Frames of encoders that round down: their values decode and encode to the same codes.
#[test]
fn codes_of_other_encoders_survive_a_round_trip() {
    for row in rows("mit") {
        let ranges = ranges(&row.meaning);
        let codes = MitCodes::parse(row.frame.eight().unwrap());
        let again = codes.command(&ranges).codes(&ranges).unwrap();
        assert_eq!(
            again,
            MitCodes {
                kp: codes.kp.min(0xFFE),
                ..codes
            }
        );
        let step = ranges.torque().step();
        let wanted = number(&row.meaning, "t").clamp(-ranges.torque().max(), ranges.torque().max());
        assert!((codes.command(&ranges).torque_nm - wanted).abs() <= step);
    }
}

#[test]
fn special_frames_equal_the_reference_frames() {
    let rows = rows("special");
    let expected = [
        (
            SpecialCommand::Enable.emit(2),
            Request::SpecialCommand(SpecialCommand::Enable),
        ),
        (
            SpecialCommand::Disable.emit(2),
            Request::SpecialCommand(SpecialCommand::Disable),
        ),
        (flash::set_zero(2), Request::SetZero),
        (
            SpecialCommand::ClearError.emit(2),
            Request::SpecialCommand(SpecialCommand::ClearError),
        ),
    ];
    assert_eq!(rows.len(), expected.len());
    for (row, (frame, request)) in rows.iter().zip(expected) {
        assert_eq!(frame, row.frame, "{}", row.meaning);
        assert_eq!(Request::parse(&row.frame, 2), Some(request));
        assert_eq!(Request::parse(&row.frame, 3), None);
        assert_eq!(request.writes_flash(), row.meaning.contains("flash"));
    }
}

#[test]
fn commands_of_other_modes_equal_the_reference_frames() {
    assert_eq!(
        modes::pos_vel(5, 1.5, 2.0).unwrap(),
        rows("pos_vel")[0].frame
    );
    assert_eq!(
        modes::force_pos(8, -0.5, 4.0, 0.25).unwrap(),
        rows("force_pos")[0].frame
    );
    let speeds = rows("vel");
    assert_eq!(modes::vel(5, -3.25).unwrap(), speeds[1].frame);
    for row in &speeds {
        assert_eq!(
            Request::parse(&row.frame, 5),
            Some(Request::Velocity(-3.25))
        );
    }
}

#[test]
fn register_reads_equal_the_reference_frames() {
    let rows = rows("read");
    assert_eq!(rows.len(), 10);
    for row in rows {
        let name = row.meaning.strip_prefix("id 3 ").unwrap();
        let info = Register::by_name(name).unwrap_or_else(|| panic!("{name}"));
        assert_eq!(register::read(3, info.register), row.frame);
        assert_eq!(
            Request::parse(&row.frame, 3),
            Some(Request::Read(info.register))
        );
    }
    assert_eq!(rows_frame("refresh"), register::request_feedback(3));
    assert_eq!(
        Request::parse(&rows_frame("refresh"), 3),
        Some(Request::Feedback)
    );
}

fn rows_frame(kind: &str) -> Frame {
    rows(kind)[0].frame
}

#[test]
fn register_writes_equal_the_reference_frames_or_are_refused() {
    let rows = rows("write");
    for (row, (name, value)) in rows.iter().zip([
        ("TIMEOUT", Value::Integer(400)),
        ("CTRL_MODE", Value::Integer(1)),
        ("PMAX", Value::Float(12.5)),
        ("TMAX", Value::Float(28.0)),
    ]) {
        let info = Register::by_name(name).unwrap();
        let expected = Request::Write(info.register, value.to_bytes());
        assert_eq!(
            Request::parse(&row.frame, 3),
            Some(expected),
            "{}",
            row.meaning
        );
        match register::write(3, info.register, value) {
            Ok(frame) => assert_eq!(frame, row.frame),
            Err(error) => {
                assert!(name.ends_with("MAX"), "{name}");
                assert_eq!(error, register::WriteError::NotWritable(info.register));
            }
        }
    }
    assert_eq!(rows.len(), 4);
    let stores = self::rows("store");
    assert_eq!(stores[0].frame, flash::store_all(3));
    for row in stores {
        let request = Request::parse(&row.frame, 3).unwrap();
        assert!(request == Request::StoreAll && request.writes_flash());
    }
}

#[test]
fn register_replies_equal_the_reference_frames() {
    let rows = rows("reply");
    let expected = [
        ("MST_ID", Value::Integer(19), Operation::Read),
        ("PMAX", Value::Float(12.5), Operation::Read),
        ("TIMEOUT", Value::Integer(400), Operation::Read),
        ("sw_ver", Value::Text(*b"7038"), Operation::Read),
        ("sw_ver", Value::Text(*b"5117"), Operation::Read),
        ("Gr", Value::Float(40.0), Operation::Read),
        ("CTRL_MODE", Value::Integer(1), Operation::Write),
    ];
    assert_eq!(rows.len(), expected.len());
    for (row, (name, value, operation)) in rows.iter().zip(expected) {
        let register = Register::by_name(name).unwrap().register;
        let reply = RegisterReply::parse(&row.frame, 3, operation, register).expect("a reply");
        assert_eq!(reply.value(), value, "{}", row.meaning);
        assert_eq!(reply.emit(3, 0x13, operation), row.frame);
        assert_eq!(
            RegisterReply::parse(&row.frame, 4, operation, register),
            None
        );
        assert_eq!(
            RegisterReply::parse(&row.frame, 3, operation, Register::SERIAL),
            None
        );
    }
}

#[test]
fn feedback_equals_the_reference_frames() {
    let rows = rows("feedback");
    assert_eq!(rows.len(), 14);
    for row in rows {
        let ranges = ranges(&row.meaning);
        let found = Feedback::parse(&row.frame).unwrap();
        let code = row
            .meaning
            .split("err=")
            .nth(1)
            .unwrap()
            .chars()
            .next()
            .unwrap();
        assert_eq!(
            found.status,
            Status::from_code(code.to_digit(16).unwrap() as u8)
        );
        assert_eq!(f64::from(found.motor), number(&row.meaning, "id"));
        for (value, key) in [
            (found.position_rad(&ranges), "p"),
            (found.velocity_rad_per_s(&ranges), "v"),
            (found.torque_nm(&ranges), "t"),
        ] {
            let expected = number(&row.meaning, key);
            assert!(
                (value - expected).abs() < 2e-8 * expected.abs().max(1.0),
                "{}: {key} {value}",
                row.meaning
            );
        }
        assert_eq!(
            f64::from(found.mosfet_celsius),
            number(&row.meaning, "Tmos")
        );
        assert_eq!(
            f64::from(found.winding_celsius),
            number(&row.meaning, "Trotor")
        );
        assert_eq!(found.emit(row.frame.id()), row.frame);
    }
}
