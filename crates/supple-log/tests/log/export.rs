//! Tables and overviews, read by the definitions inside the log, equal the written data.

use crate::common::{self, N, STEPS};
use std::collections::BTreeMap;
use std::num::NonZeroU64;
use std::path::Path;
use supple_core::math::Vector3;
use supple_log::{CycleRecord, LogError, Reader, export_csv, info};

const EACH: NonZeroU64 = NonZeroU64::MIN;

fn table(path: &Path, channel: &str, every: u64) -> Vec<Vec<String>> {
    let mut out = Vec::new();
    let every = NonZeroU64::new(every).expect("positive");
    let rows = export_csv(path, channel, every, &mut out).expect("exported");
    let text = String::from_utf8(out).expect("text");
    let lines: Vec<_> = text.lines().map(cells).collect();
    assert_eq!(lines.len() as u64, rows + 1);
    assert!(lines.iter().all(|line| line.len() == lines[0].len()));
    lines
}

/// Cells of a line, without quotes.
fn cells(line: &str) -> Vec<String> {
    let (mut cells, mut cell, mut quoted) = (Vec::new(), String::new(), false);
    for c in line.chars() {
        match c {
            '"' => quoted = !quoted,
            ',' if !quoted => cells.push(std::mem::take(&mut cell)),
            _ => cell.push(c),
        }
    }
    cells.push(cell);
    cells
}

/// Returns the cells of a row by the names of their columns.
fn named<'a>(header_row: &'a [String], row: &'a [String]) -> BTreeMap<&'a str, &'a str> {
    let names = header_row.iter().map(String::as_str);
    names.zip(row.iter().map(String::as_str)).collect()
}

fn run() -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    common::write(&path, STEPS).expect("written");
    (folder, path)
}

/// The definition in the log matches the bytes, for every step and every type of value.
#[test]
fn every_step_is_exported_as_a_row() {
    let (_folder, path) = run();
    let lines = table(&path, "/controller_state", 1);
    let (header_row, rows) = lines.split_first().expect("a header row");
    assert_eq!(rows.len() as u64, STEPS);
    let reader = Reader::open(&path).expect("opened");
    for (row, logged) in rows.iter().zip(reader.records::<N>().expect("four joints")) {
        let logged = logged.expect("whole");
        let row = named(header_row, row);
        assert_row_equals_record(&row, logged.time_ns, &logged.value);
    }
}

fn assert_row_equals_record(row: &BTreeMap<&str, &str>, time_ns: u64, r: &CycleRecord<N>) {
    let number = |name: &str| -> f64 { row[name].parse().expect("a number") };
    let bits = |name: &str, value: f64| {
        assert_eq!(
            number(name).to_bits(),
            value.to_bits(),
            "{name} at {time_ns} ns"
        );
    };
    assert_eq!(row["log_time_ns"], time_ns.to_string());
    assert_eq!(row["step"], r.step.to_string());
    assert_eq!(row["input_cycle"], r.input_cycle.to_string());
    assert_eq!(row["mode"], r.mode.to_string());
    assert_eq!(row["request"], r.request.to_string());
    assert_eq!(row["fault"], r.fault.to_string());
    assert_eq!(row["fault_joint"], r.fault_joint.to_string());
    assert_eq!(row["fault_text"], r.fault_text.as_str());
    assert_eq!(row["refusal_text"], r.refusal_text.as_str());
    assert_eq!(row["in_contact"], u8::from(r.in_contact).to_string());
    let values = row["request_values"].split_whitespace();
    let values: Vec<f64> = values.map(|v| v.parse().expect("a number")).collect();
    assert_eq!(values, r.request_values.values());
    let joints = ["joint1", "joint2", "joint3", "joint4"];
    for (i, joint) in joints.into_iter().enumerate() {
        let has = row[format!("has_measured_position.{joint}").as_str()];
        assert_eq!(has, u8::from(r.has_measured_position[i]).to_string());
        bits(
            &format!("measured_position_rad.{joint}"),
            r.measured_position_rad[i],
        );
        bits(&format!("torque_nm.{joint}"), r.torque_nm[i]);
        // Every term has its column: their sum is the torque, where nothing limits it.
        let mut sum_nm = 0.0;
        for (term, torque_nm) in r.torques.named() {
            bits(&format!("torques.{term}.{joint}"), torque_nm[i]);
            sum_nm += torque_nm[i];
        }
        if !(r.torque_limited || r.rate_limited) {
            assert!(
                (sum_nm - r.torque_nm[i]).abs() < 1e-12,
                "{joint} at {time_ns} ns"
            );
        }
        bits(
            &format!("external_torque_nm.{joint}"),
            r.external_torque_nm[i],
        );
    }
    for (axis, name) in ["x", "y", "z"].into_iter().enumerate() {
        bits(&format!("tip_position_m.{name}"), r.tip_position_m[axis]);
        bits(
            &format!("reference_position_m.{name}"),
            r.reference_position_m[axis],
        );
        bits(
            &format!("damping_n_s_per_m.{name}"),
            r.damping_n_s_per_m[axis],
        );
    }
    bits("min_singular_value_m", r.min_singular_value_m);
    bits("fault_limit", r.fault_limit);
}

#[test]
fn other_channels_and_every_nth_row_are_exported() {
    let (_folder, path) = run();
    let joints = table(&path, "/joint_states", 100);
    assert_eq!(joints.len() as u64, 1 + STEPS / 100);
    let row = named(&joints[0], &joints[3]);
    assert_eq!(row["log_time_ns"], "200000000");
    assert_eq!(row["name.joint2"], "joint2");
    assert!(row.contains_key("effort.joint4"));
    assert!(!joints[0].iter().any(|name| name.starts_with("header")));

    let wrench = table(&path, "/wrench_ext", 1);
    let row = named(&wrench[0], &wrench[1]);
    assert_eq!(
        (row["log_time_ns"], row["wrench.force.z"]),
        ("600000000", "0.3333333333333333")
    );
    let timing = table(&path, "/cycle_timing", 1);
    assert_eq!(
        timing[0],
        ["log_time_ns", "step", "period_ns", "latency_ns", "step_ns"]
    );
    assert_eq!(timing[8], ["7000000", "7", "1000000", "107", "2000"]);
    let truth = table(&path, "/plant_truth", 1);
    assert!(truth[0].contains(&"contact_force_n.x".to_owned()));

    let transforms = table(&path, "/tf", 1);
    assert_eq!(transforms.len() as u64, 1 + STEPS / 20);
    let row = named(&transforms[0], &transforms[1]);
    assert_eq!(row["transforms.0.header.frame_id"], "base");
    let children: Vec<_> = row
        .keys()
        .filter(|k| k.ends_with("child_frame_id"))
        .collect();
    assert_eq!(row[children[children.len() - 1]], "tip_base_axes");
}

#[test]
fn text_is_quoted() {
    let (_folder, path) = run();
    let mut out = Vec::new();
    export_csv(&path, "/controller_state", EACH, &mut out).expect("exported");
    let text = String::from_utf8(out).expect("text");
    assert!(text.contains(",\"refused: "), "a refusal with a comma");
}

#[test]
fn the_error_of_an_unknown_channel_lists_the_channels() {
    let (_folder, path) = run();
    let error = export_csv(&path, "/joints", EACH, &mut Vec::new()).expect_err("no such channel");
    assert!(matches!(error, LogError::UnknownChannel { .. }), "{error}");
    for word in [
        "run.mcap",
        "/joints",
        "/joint_states",
        "/controller_state",
        "/tf",
    ] {
        assert!(error.to_string().contains(word), "{error}");
    }
}

#[test]
fn an_output_that_cannot_be_written_is_an_error() {
    struct Full;
    impl std::io::Write for Full {
        fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
            Err(std::io::ErrorKind::StorageFull.into())
        }
        fn flush(&mut self) -> std::io::Result<()> {
            Ok(())
        }
    }
    let (_folder, path) = run();
    let error = export_csv(&path, "/joint_states", EACH, &mut Full).expect_err("full");
    assert!(matches!(error, LogError::Output(_)), "{error}");
}

#[test]
fn the_overview_shows_the_content_of_the_log() {
    let (_folder, path) = run();
    let info = info(&path).expect("read");
    assert_eq!(info.incomplete, None);
    assert_eq!((info.steps, info.missing_steps, info.chunks), (STEPS, 0, 8));
    assert_eq!(info.span_ns, Some((0, (STEPS - 1) * common::CYCLE_NS)));
    let count = |topic: &str| {
        let channel = info.channels.iter().find(|channel| channel.topic == topic);
        channel.map(|channel| (channel.schema.as_str(), channel.messages))
    };
    let state = Some(("supple_msgs/msg/ControllerState", STEPS));
    assert_eq!(count("/controller_state"), state);
    assert_eq!(
        count("/joint_states"),
        Some(("sensor_msgs/msg/JointState", STEPS))
    );
    assert_eq!(
        count("/wrench_ext"),
        Some(("geometry_msgs/msg/WrenchStamped", STEPS - 600))
    );
    assert_eq!(count("/tf"), Some(("tf2_msgs/msg/TFMessage", STEPS / 20)));
    assert_eq!(
        count("/robot_description"),
        Some(("std_msgs/msg/String", 1))
    );
    let modes: Vec<_> = info
        .modes
        .iter()
        .map(|m| (m.time_ns / 1_000_000, m.mode.as_str()))
        .collect();
    let expected = [
        (0, "gravity_hold"),
        (100, "move"),
        (600, "track"),
        (common::FAULT_CYCLE + 1, "fault"),
        (1_510, "idle"),
        (1_530, "gravity_hold"),
    ];
    assert_eq!(modes, expected);
    assert_eq!(info.faults.len(), 1);
    assert!(
        info.faults[0].fault.contains("encoder"),
        "{:?}",
        info.faults
    );

    let text = info.to_string();
    for words in [
        "run.mcap",
        "wam4",
        "joint3",
        "seed 7",
        "complete    yes",
        "none missing",
    ] {
        assert!(text.contains(words), "{words} is not in\n{text}");
    }
    let json = serde_json::to_value(&info).expect("JSON");
    assert_eq!(json["about"]["arm"], "wam4");
    assert_eq!(
        json["channels"].as_array().map(Vec::len),
        Some(info.channels.len())
    );
}

#[test]
fn missing_steps_are_counted() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.mcap");
    let (description, config) = (common::description(), common::config());
    let mut writer = supple_log::Writer::create(&path, &description, &config, &common::run_info())
        .expect("created");
    common::run(60, |cycle| {
        let step = cycle.input.cycle;
        if (20..23).contains(&step) || step == 40 {
            return;
        }
        let extras = supple_log::Extras {
            step: Some(step),
            tip_force_n: Some(Vector3::new(1.0, -2.5, 3.0)),
            ..cycle.extras
        };
        writer
            .write(cycle.time_ns, &cycle.input, &cycle.output, &extras)
            .expect("written");
    });
    writer.finish().expect("finished");
    let info = info(&path).expect("read");
    assert_eq!((info.steps, info.missing_steps), (56, 4));
    assert!(info.to_string().contains("cannot be replayed"));

    // The force sensor reading, which the controller did not receive.
    let wrench = table(&path, "/wrench_ext", 1);
    assert_eq!(wrench.len(), 1 + 56);
    let row = named(&wrench[0], &wrench[1]);
    assert_eq!(row["wrench.force.y"], "-2.5");
    assert_eq!(table(&path, "/controller_state", 1).len(), 1 + 56);
}
