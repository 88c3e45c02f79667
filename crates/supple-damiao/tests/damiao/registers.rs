//! Tests of the register table and of the allowed writes.

use supple_damiao::firmware::{Firmware, FirmwareError};
use supple_damiao::register::{Access, Kind, REGISTERS, WriteError, write};
use supple_damiao::{Register, Request, Value};

#[test]
fn every_register_has_its_own_number_and_name() {
    for pair in REGISTERS.windows(2) {
        assert!(pair[0].register < pair[1].register);
    }
    for info in REGISTERS {
        assert_eq!(info.register.info(), Some(info));
        assert_eq!(Register::by_name(&info.name.to_lowercase()), Some(info));
    }
}

/// No write that this crate encodes can change a value that must be equal in host and motor, or write flash.
#[test]
fn writes_are_harmless() {
    for number in 0..=255 {
        let register = Register(number);
        for value in [Value::Integer(7), Value::Float(7.0), Value::Text(*b"0007")] {
            let Ok(frame) = write(5, register, value) else {
                continue;
            };
            let info = register.info().expect("the register is known");
            assert_eq!((info.access, info.kind), (Access::Writable, value.kind()));
            let request = Request::parse(&frame, 5).expect("a request");
            assert!(!request.writes_flash());
            assert_eq!(request, Request::Write(register, value.to_bytes()));
        }
    }
    for register in [
        Register::POSITION_RANGE,
        Register::VELOCITY_RANGE,
        Register::TORQUE_RANGE,
        Register::MOTOR_POSITION,
    ] {
        let refused = write(5, register, Value::Float(1.0));
        assert_eq!(refused, Err(WriteError::NotWritable(register)));
    }
    let refused = write(5, Register::BIT_RATE, Value::Integer(9));
    assert_eq!(refused, Err(WriteError::NotWritable(Register::BIT_RATE)));
    let nan = write(5, Register::UNDER_VOLTAGE, Value::Float(f32::NAN));
    assert_eq!(nan, Err(WriteError::NotFinite(Register::UNDER_VOLTAGE)));
    assert_eq!(Register::TIMEOUT.info().unwrap().kind, Kind::Integer);
}

#[test]
fn unsupported_firmware_is_refused() {
    let check = |text: &[u8; 4], fd| Firmware::parse(*text).unwrap().check(fd);
    assert_eq!(check(b"5017", true), Ok(()));
    assert_eq!(check(b"6417", true), Ok(()));
    assert_eq!(check(b"7038", true), Ok(()));
    assert_eq!(check(b"5013", false), Ok(()));
    assert!(matches!(check(b"5014", true), Err(FirmwareError::NoFd(_))));
    assert!(matches!(
        check(b"5012", false),
        Err(FirmwareError::TooOld(_))
    ));
    assert!(matches!(
        check(b"5041", false),
        Err(FirmwareError::FourMotors(_))
    ));
    assert!(matches!(
        check(b"9917", false),
        Err(FirmwareError::Series(99))
    ));
    assert_eq!(
        Firmware::parse([1, 2, 3, 4]),
        Err(FirmwareError::NotDigits([1, 2, 3, 4]))
    );
    assert!(
        !Firmware::parse(*b"5016")
            .unwrap()
            .reads_registers_in_operation()
    );
    assert!(
        Firmware::parse(*b"5017")
            .unwrap()
            .reads_registers_in_operation()
    );
}
