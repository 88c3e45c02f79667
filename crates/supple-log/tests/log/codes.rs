//! The numbers of modes, faults, requests and refusals never change: they equal those of the first message definition,
//! `data/ControllerState.msg`.

use supple_core::codes::{self, FaultCode, MODES};
use supple_core::controller::{Fault, Mode, Refusal};

/// Value of a constant in the message definition.
fn constant(name: &str) -> Option<u8> {
    let definition = include_str!("../data/ControllerState.msg");
    let line = format!("uint8 {name}=");
    let value = definition.lines().find_map(|l| l.strip_prefix(&line))?;
    value.parse().ok()
}

#[test]
fn modes_are_numbered_as_the_definition_says() {
    for mode in MODES {
        let name = format!("MODE_{}", mode.name().to_uppercase());
        assert_eq!(constant(&name), Some(mode as u8), "{name}");
        assert_eq!(MODES[mode as usize], mode);
    }
}

#[test]
fn faults_are_numbered_as_the_definition_says() {
    let (value, limit, joint) = (2.5, 1.5, 3);
    let faults = [
        (
            Fault::MeasurementNotFinite { joint: Some(3) },
            (3, 0.0, 0.0),
        ),
        (Fault::MeasurementNotFinite { joint: None }, (-1, 0.0, 0.0)),
        (Fault::EncoderLost { joint }, (3, 0.0, 0.0)),
        (
            Fault::StateStale {
                cycles: 9,
                limit: 4,
            },
            (-1, 9.0, 4.0),
        ),
        (
            Fault::StateOutOfOrder {
                last: 9,
                received: 4,
            },
            (-1, 4.0, 9.0),
        ),
        (
            Fault::JointPosition {
                joint,
                value_rad: value,
                limit_rad: limit,
            },
            (3, value, limit),
        ),
        (
            Fault::JointSpeed {
                joint,
                value_rad_per_s: value,
                limit_rad_per_s: limit,
            },
            (3, value, limit),
        ),
        (
            Fault::TipSpeed {
                value_m_per_s: value,
                limit_m_per_s: limit,
            },
            (-1, value, limit),
        ),
        (
            Fault::TrackingError {
                value_m: value,
                limit_m: limit,
            },
            (-1, value, limit),
        ),
        (Fault::MassMatrix, (-1, 0.0, 0.0)),
        (Fault::TorqueNotFinite { term: "force" }, (-1, 0.0, 0.0)),
        (
            Fault::EncoderJump {
                joint,
                value_rad: value,
                limit_rad: limit,
            },
            (3, value, limit),
        ),
        (
            Fault::JointTrackingError {
                joint,
                value_rad: value,
                limit_rad: limit,
            },
            (3, value, limit),
        ),
    ];
    for (fault, (joint, value, limit)) in faults {
        let name = format!("FAULT_{}", fault.name().to_uppercase());
        let code = constant(&name).unwrap_or_else(|| panic!("{name} is not defined"));
        let expected = FaultCode {
            kind: code,
            joint,
            value,
            limit,
        };
        assert_eq!(FaultCode::new(Some(&fault)), expected, "{name}");
    }
}

#[test]
fn refusals_are_numbered_as_the_definition_says() {
    let refusals = [
        ("MODE", Refusal::Mode { mode: Mode::Idle }),
        (
            "FAR_FROM_START",
            Refusal::FarFromStart {
                distance_m: 1.0,
                limit_m: 0.1,
            },
        ),
        (
            "UNREACHABLE",
            Refusal::BeyondJointStop {
                joint: 0,
                value_rad: 9.0,
            },
        ),
    ];
    for (name, refusal) in refusals {
        let code = constant(&format!("REFUSAL_{name}"));
        assert_eq!(code, Some(codes::refusal(Some(&refusal))), "{name}");
    }
}

#[test]
fn every_number_is_the_one_that_the_definition_gives_its_name() {
    for (prefix, all) in [
        ("REQUEST", codes::request_kind::ALL),
        ("TRAJECTORY", codes::trajectory_kind::ALL),
        ("FAULT", codes::fault_kind::ALL),
        ("REFUSAL", codes::refusal_kind::ALL),
    ] {
        for code in all {
            let name = format!("{prefix}_{}", code.name.to_uppercase());
            assert_eq!(constant(&name), Some(code.number), "{name}");
        }
    }
}

/// `docs/logs.md` has a row for each number. A mode's meaning ends there with its first clause.
#[test]
fn the_documentation_lists_every_number() {
    let page = include_str!("../../../../docs/logs.md");
    let mut rows = Vec::new();
    for all in [
        codes::fault_kind::ALL,
        codes::refusal_kind::ALL,
        codes::request_kind::ALL,
        codes::trajectory_kind::ALL,
    ] {
        let numbers = all.iter().skip(1);
        rows.extend(numbers.map(|code| (code.number, code.name, code.meaning)));
    }
    rows.extend(MODES.map(|mode| {
        let meaning = mode.meaning().split([';', ':']).next().unwrap_or_default();
        let meaning = meaning.split(". ").next().unwrap_or_default();
        (mode as u8, mode.name(), meaning.trim_end_matches('.'))
    }));
    let documented = page.lines().filter(|line| {
        let number = line
            .strip_prefix("| ")
            .and_then(|rest| rest.split(' ').next());
        number.is_some_and(|number| number.parse::<u8>().is_ok())
    });
    assert_eq!(documented.count(), rows.len());
    for (number, name, meaning) in rows {
        let row = format!(
            "| {number} | `{name}` | {}. |\n",
            meaning.trim_end_matches('.')
        );
        assert!(page.contains(&row), "docs/logs.md lacks: {row}");
    }
}
