//! Written data are read back bit-exactly and suffice to run the controller again.

use crate::common::{self, CYCLE_NS, N, STEPS};
use supple_core::controller::Mode;
use supple_log::{CycleRecord, LogError, Reader};

#[test]
fn every_step_is_read_back_bit_exactly() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let written = common::write(&path, STEPS).expect("written");
    assert_eq!(written.path, path);
    assert_eq!(written.bytes, std::fs::metadata(&path).expect("file").len());

    let reader = Reader::open(&path).expect("opened");
    let mut records = reader.records::<N>().expect("four joints");
    let mut plant_truths = reader.plant_truths::<N>().expect("four joints");
    let mut timings = reader.timings().expect("timed");
    let mut k = 0;
    common::run(STEPS, |cycle| {
        let read = records.next().expect("a step").expect("complete");
        assert_eq!(read.time_ns, cycle.time_ns);
        let names = common::config().joint_names;
        let record = CycleRecord::new(k, &cycle.input, &cycle.output)
            .with_joint_names(&cycle.output, &names);
        assert_eq!(read.value, record);
        assert_eq!(read.value.input().expect("a known request"), cycle.input);
        assert_eq!(read.value.mode(), Some(cycle.output.mode));
        let truth = plant_truths.next().expect("truth").expect("complete");
        assert_eq!(Some(truth.value), cycle.extras.truth);
        let timing = timings.next().expect("timing").expect("complete");
        assert_eq!(Some(timing.value), cycle.extras.timing);
        assert_eq!(timing.time_ns, k * CYCLE_NS);
        k += 1;
    });
    assert_eq!(k, STEPS);
    assert!(records.next().is_none() && plant_truths.next().is_none() && timings.next().is_none());
}

/// Compares field by field: a round trip alone would not detect swapped fields.
#[test]
fn a_record_equals_the_output_of_the_controller() {
    common::run(STEPS, |cycle| {
        let (i, o) = (&cycle.input, &cycle.output);
        let r = CycleRecord::new(5, i, o);
        assert_eq!((r.step, r.input_cycle, r.cycle), (5, i.cycle, o.cycle));
        assert_eq!(r.mode_time_s, o.mode_time_s);
        let joints = [
            (&r.torque_nm, &o.torque_nm),
            (&r.fallback_torque_nm, &o.fallback_torque_nm),
            (&r.position_rad, &o.position_rad),
            (&r.velocity_rad_per_s, &o.velocity_rad_per_s),
            (&r.external_torque_nm, &o.external_torque_nm),
        ];
        for (logged, expected) in joints {
            assert_eq!(logged.as_slice(), expected.as_slice());
        }
        assert_eq!(r.torques, o.torques);
        let vectors = [
            (&r.tip_position_m, &o.tip_position_m),
            (&r.tip_velocity_m_per_s, &o.tip_velocity_m_per_s),
            (&r.stiffness_n_per_m, &o.gains.stiffness_n_per_m),
            (&r.damping_n_s_per_m, &o.gains.damping_n_s_per_m),
            (&r.external_force_n, &o.external_force_n),
        ];
        for (logged, expected) in vectors {
            assert_eq!(logged.as_slice(), expected.as_slice());
        }
        let reference = o.reference.map(|reference| {
            let vectors = [
                reference.position,
                reference.velocity,
                reference.acceleration,
            ];
            vectors.map(<[f64; 3]>::from)
        });
        let logged = [
            r.reference_position_m,
            r.reference_velocity_m_per_s,
            r.reference_acceleration_m_per_s2,
        ];
        assert_eq!(r.has_reference, reference.is_some());
        assert_eq!(logged, reference.unwrap_or_default());
        assert_eq!(
            (r.torque_limited, r.rate_limited, r.in_contact),
            (o.torque_limited, o.rate_limited, o.in_contact)
        );
        assert_eq!(
            [
                r.force_against_n,
                r.contact_threshold_n,
                r.friction_share,
                r.min_singular_value_m
            ],
            [
                o.force_against_n,
                o.contact_threshold_n,
                o.friction_share,
                o.min_singular_value_m
            ]
        );
        let text = |expected: Option<String>| expected.unwrap_or_default();
        assert_eq!(
            r.fault_text.as_str(),
            text(o.fault.map(|fault| fault.to_string()))
        );
        assert_eq!(
            r.refusal_text.as_str(),
            text(o.refusal.map(|refusal| refusal.to_string()))
        );
    });
}

#[test]
fn the_sample_contains_the_events_that_other_tests_need() {
    let (mut modes, mut refusals, mut faults) = (Vec::new(), 0, 0);
    common::run(STEPS, |cycle| {
        modes.push(cycle.output.mode);
        refusals += u32::from(cycle.output.refusal.is_some());
        faults += u32::from(cycle.output.fault.is_some());
    });
    modes.dedup();
    let expected = [
        Mode::GravityHold,
        Mode::Move,
        Mode::Track,
        Mode::Fault,
        Mode::Idle,
        Mode::GravityHold,
    ];
    assert_eq!(modes, expected);
    assert_eq!(refusals, 1);
    assert_eq!(faults, 9);
}

#[test]
fn a_log_contains_its_metadata() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    common::write(&path, 10).expect("written");
    let reader = Reader::open(&path).expect("opened");

    let metadata = reader.metadata();
    assert_eq!(metadata.arm, "wam4");
    assert_eq!(metadata.experiment, "sample");
    assert_eq!(metadata.seed, Some(7));
    assert_eq!(metadata.start_ns, 0);
    assert_eq!(metadata.notes, common::run_info().notes);
    assert!(metadata.software.starts_with("supple-log "));
    let description = reader.description().expect("the arm");
    assert_eq!(metadata.joints, description.joint_names());
    assert_eq!(description.urdf(), common::description().urdf());
    assert_eq!(description.toml(), common::description().toml());
    let names: Vec<_> = reader.attachments().keys().collect();
    assert_eq!(names, ["arm.toml", "arm.urdf", "controller.toml"]);
}

#[test]
fn a_wrong_number_of_joints_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    common::write(&path, 10).expect("written");
    let reader = Reader::open(&path).expect("opened");
    let Err(error) = reader.records::<7>() else {
        panic!("seven joints were read from a log of four");
    };
    assert!(
        matches!(
            error,
            LogError::JointCount {
                expected: 7,
                found: 4,
                ..
            }
        ),
        "{error}"
    );
    assert!(error.to_string().contains("run.mcap"));
    assert!(reader.config::<3>().is_err());
}

#[test]
fn the_same_run_gives_identical_bytes() {
    let folder = tempfile::tempdir().expect("a folder");
    let bytes = ["a", "b"].map(|name| {
        let path = folder.path().join(name).with_extension("mcap");
        common::write(&path, 600).expect("written");
        std::fs::read(path).expect("read")
    });
    assert!(bytes[0] == bytes[1]);
}

/// `data/version_1.mcap` was written when the message definition still had another order of fields: records are read by
/// the names in the definition inside the file.
#[test]
fn a_log_of_the_first_format_is_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/version_1.mcap");
    let reader = Reader::open(std::path::Path::new(path)).expect("opened");
    let records = reader.records::<N>().expect("four joints");
    let records: Vec<_> = records.map(|record| record.expect("whole").value).collect();
    assert_eq!(records.len(), 400);
    for (step, record) in records.iter().enumerate() {
        assert_eq!((record.step, record.cycle), (step as u64, step as u64));
        let input = record.input().expect("a known request");
        assert_eq!(input.position_rad, record.position_rad.data.0[0].map(Some));
        if !(record.torque_limited || record.rate_limited) {
            let difference = record.torques.total() - record.torque_nm;
            assert!(difference.amax() < 1e-12, "step {step}: {difference}");
        }
    }
    let last = &records[399];
    assert_eq!((last.mode(), last.fault), (Some(Mode::Move), 0));
    assert!(last.drives_active && last.fault_text.as_str().is_empty());
    assert!(last.torques.gravity.amax() > 1.0, "{last:?}");
    // The field has the name least_singular_value_m in that format.
    let values = records.iter().map(|record| record.min_singular_value_m);
    assert!(values.fold(f64::INFINITY, f64::min) > 0.01, "{last:?}");
}
