//! A log suffices to run the controller again, and a replay detects differences.

use crate::common::{self, N, STEPS};
use supple_core::math::Vector3;
use supple_log::{Extras, LogError, Reader, Writer, replay};

#[test]
fn a_log_replays_without_differences() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    common::write(&path, STEPS).expect("written");
    let replay = replay(&path).expect("replayed");
    assert_eq!(replay.steps, STEPS);
    assert_eq!(replay.different_steps, 0);
    assert_eq!(replay.first_difference, None);
    assert!(replay.to_string().contains("to the last bit"));
    // The log contained steps to compare with.
    let reader = Reader::open(&path).expect("opened");
    assert_eq!(reader.records::<N>().expect("steps").count() as u64, STEPS);
}

#[test]
fn a_difference_of_one_bit_is_detected() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let (changed, joint) = (900, 2);
    let mut before = 0.0;
    rewrite(&path, |step, cycle| {
        if step == changed {
            let torque = &mut cycle.output.torque_nm[joint];
            before = *torque;
            *torque = f64::from_bits(torque.to_bits() ^ 1);
        }
        true
    });
    let replay = replay(&path).expect("replayed");
    assert_eq!(replay.different_steps, 1);
    let first = replay.first_difference.as_ref().expect("a difference");
    assert_eq!(
        (first.step, first.time_ns),
        (changed, changed * common::CYCLE_NS)
    );
    let name = common::description().joint_names()[joint].clone();
    assert_eq!(first.field, format!("torque_nm.{name}"));
    assert_eq!(first.replayed, format!("{before:?}"));
    assert_ne!(first.logged, first.replayed);
    assert!(replay.to_string().contains(&first.field), "{replay}");
}

/// A changed input changes the following outputs.
#[test]
fn a_changed_input_is_detected() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    rewrite(&path, |step, cycle| {
        if step == 700 {
            let position = cycle.input.position_rad[1].as_mut().expect("an answer");
            *position += 1e-6;
        }
        if step > 700 {
            cycle.input.tip_force_n = Some(Vector3::zeros());
        }
        true
    });
    let replay = replay(&path).expect("replayed");
    assert!(replay.different_steps > 100, "{replay}");
    assert_eq!(replay.first_difference.expect("a difference").step, 700);
}

#[test]
fn a_log_with_missing_steps_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    rewrite(&path, |step, _| !(300..302).contains(&step));
    let error = replay(&path).expect_err("two steps are missing");
    let LogError::Gap {
        expected, found, ..
    } = error
    else {
        panic!("{error}");
    };
    assert_eq!((expected, found), (300, 302));
    assert!(error_text(&path).contains("run.mcap"));
}

fn error_text(path: &std::path::Path) -> String {
    replay(path).expect_err("refused").to_string()
}

/// Writes the sample with changed steps; a step for which `change` returns false is omitted.
fn rewrite(path: &std::path::Path, mut change: impl FnMut(u64, &mut common::Cycle) -> bool) {
    let mut writer = Writer::create(
        path,
        &common::description(),
        &common::config(),
        &common::run_info(),
    )
    .expect("created");
    let mut step = 0;
    common::run(STEPS, |cycle| {
        let mut cycle = cycle.clone();
        if change(step, &mut cycle) {
            let extras = Extras {
                step: Some(step),
                ..cycle.extras
            };
            writer
                .write(cycle.time_ns, &cycle.input, &cycle.output, &extras)
                .expect("written");
        }
        step += 1;
    });
    writer.finish().expect("finished");
}

/// Neither changed messages of faults and refusals nor added fields count as differences between versions.
#[test]
fn a_log_of_the_first_format_replays() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/version_1.mcap");
    let replay = replay(std::path::Path::new(path)).expect("replayed");
    assert_eq!(replay.steps, 400);
    assert_eq!(replay.first_difference, None);
}
