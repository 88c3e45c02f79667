//! Tests of invalid arguments and outputs of the operator's commands: each gives one error line, the documented exit code and
//! no output files.

use crate::support::{arg, assert_one_clear_line, fifo, run_in, tree};
use std::fs;
use supple_model::Description;

/// A device as output is rejected and unchanged.
#[cfg(unix)]
#[test]
fn outputs_that_are_not_regular_files_are_code_6_before_anything_is_written() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fifo(&at("fifo"));
    fs::create_dir(at("folder")).expect("made");
    let before = tree(folder.path());
    for (word, args) in [
        (
            "a character device",
            &["up", "--plant", "sim", "--log", "/dev/null"][..],
        ),
        ("a FIFO", &["up", "--plant", "sim", "--log", "fifo"]),
        ("a folder", &["up", "--plant", "sim", "--log", "folder"]),
        (
            "a FIFO",
            &["up", "--plant", "sim", "--no-log", "--trace", "fifo"],
        ),
        (
            "a character device",
            &["up", "--plant", "sim", "--no-log", "--trace", "/dev/full"],
        ),
        ("a character device", &["drill", "--markdown", "/dev/null"]),
        ("a FIFO", &["drill", "--markdown", "fifo"]),
        ("a folder", &["drill", "--markdown", "folder"]),
        (
            "a character device",
            &[
                "drill",
                "--arm",
                "openarm",
                "--plant",
                "emu",
                "--markdown",
                "/dev/null",
            ],
        ),
        ("a character device", &["teach", "/dev/null"]),
        ("a FIFO", &["teach", "fifo"]),
        ("a folder", &["teach", "folder"]),
    ] {
        let answer = run_in(folder.path(), args);
        assert_eq!(answer.code, Some(6), "{args:?}: {}", answer.stderr);
        assert_one_clear_line(&answer, &[word, "regular file"]);
    }
    assert_eq!(tree(folder.path()), before, "no additional files");
    for device in ["/dev/null", "/dev/full"] {
        let kind = fs::metadata(device).expect("still there").file_type();
        assert!(kind.is_char_device(), "{device}");
    }
    let kind = fs::metadata(at("fifo")).expect("still there").file_type();
    assert!(kind.is_fifo());
}

#[test]
fn numbers_out_of_range_are_code_2_with_their_range() {
    let up = ["up", "--plant", "sim"];
    let gains = ["gains"];
    let folder = tempfile::tempdir().expect("a folder");
    for (command, option, value) in [
        (&up[..], "--for", "1e300"),
        (&up, "--block-m", "1e300"),
        (&up, "--rate-hz", "4294967295"),
        (&gains, "--stiffness", "1e300"),
        (&gains, "--damping", "nan"),
        (&gains, "--ramp", "1e300"),
        (&["track", "sinusoid"], "--speed", "1e300"),
        (&["track", "arc"], "--speed", "0"),
        (&["track", "arc"], "--speed", "nan"),
        (&["track", "arc"], "--speed", "-1"),
    ] {
        let value = format!("{option}={value}");
        let answer = run_in(folder.path(), &[command, &[value.as_str()]].concat());
        assert_eq!(
            answer.code,
            Some(2),
            "{command:?} {value}: {}",
            answer.stderr
        );
        let line = answer.stderr.lines().next().unwrap_or_default();
        assert!(line.contains(option), "{option} in {line}");
        assert!(
            line.contains(" to ") || line.contains("..="),
            "a range in {line}"
        );
    }
    assert!(tree(folder.path()).is_empty());
}

/// The warning is printed once, or the file is rejected with --strict; no system runs, so the command then fails.
#[test]
fn unread_urdf_elements_are_a_warning_or_an_error_with_strict() {
    let folder = tempfile::tempdir().expect("a folder");
    let built_in = Description::asset("wam4").expect("built in");
    let arm = folder.path().join("arm");
    fs::create_dir(&arm).expect("a folder");
    let urdf = built_in
        .urdf()
        .replacen("</robot>", "<gazebo/><gazebo/></robot>", 1);
    fs::write(arm.join("arm.toml"), built_in.toml()).expect("written");
    fs::write(arm.join("arm.urdf"), urdf).expect("written");
    let track = ["track", "sinusoid", "--arm", arg(&arm)];
    let answer = run_in(folder.path(), &track);
    assert_eq!(answer.code, Some(10), "{}", answer.stderr);
    let warnings = answer.stderr.matches("warning: ").count();
    assert_eq!(warnings, 1, "{}", answer.stderr);
    assert!(
        answer.stderr.contains("<gazebo> first of 2"),
        "{}",
        answer.stderr
    );
    for command in [
        &track[..],
        &["probe", "--arm", arg(&arm)],
        &["up", "--plant", "sim", "--arm", arg(&arm)],
        &["drill", "--arm", arg(&arm)],
    ] {
        let answer = run_in(folder.path(), &[command, &["--strict"]].concat());
        assert_eq!(answer.code, Some(3), "{command:?}: {}", answer.stderr);
        assert_one_clear_line(&answer, &["arm.urdf", "<gazebo>", "without strict"]);
    }
}

/// The writer of a log renames the file when it is complete; a killed writer leaves the incomplete file.
#[test]
fn a_log_whose_writer_was_killed_is_found_beside_its_name() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("run.mcap.part"), "cut").expect("written");
    for command in ["info", "replay", "export"] {
        let answer = run_in(folder.path(), &["log", command, "run.mcap"]);
        let words = ["run.mcap.part", "supple log recover"];
        assert_one_clear_line(&answer, &words);
        assert!(!answer.stderr.contains("--out"), "{}", answer.stderr);
        assert_eq!(answer.code, Some(6), "{command}: {}", answer.stderr);
    }
}

/// If a plant on a bus has no drives for the arm, no process starts.
#[test]
fn the_error_of_an_arm_without_drives_suggests_the_simulation() {
    let folder = tempfile::tempdir().expect("a folder");
    for plant in ["emu", "can"] {
        let command = ["up", "--plant", plant, "--arm", "wam3", "--no-log"];
        let answer = run_in(folder.path(), &command);
        assert_eq!(answer.code, Some(2), "{plant}: {}", answer.stderr);
        assert_one_clear_line(&answer, &["`wam3` has 3 joints", "--plant sim"]);
    }
}

/// For a URDF without a tip, the selected tip is reported once.
#[test]
fn the_default_tip_is_reported_once() {
    let folder = tempfile::tempdir().expect("a folder");
    let built_in = Description::asset("wam4").expect("built in");
    fs::write(folder.path().join("robot.urdf"), built_in.urdf()).expect("written");
    let track = ["track", "sinusoid", "--arm", "robot.urdf"];
    let answer = run_in(folder.path(), &track);
    assert_eq!(answer.code, Some(10), "{}", answer.stderr);
    let warning = "the tip: no link is named as the tip";
    assert_eq!(
        answer.stderr.matches(warning).count(),
        1,
        "{}",
        answer.stderr
    );
    let answer = run_in(folder.path(), &[&track[..], &["--tip", "tip"]].concat());
    assert!(!answer.stderr.contains(warning), "{}", answer.stderr);
}

/// The tip of a URDF can be given wherever the arm can be given.
#[test]
fn a_tip_that_a_urdf_does_not_have_is_code_3() {
    let folder = tempfile::tempdir().expect("a folder");
    let built_in = Description::asset("wam4").expect("built in");
    fs::write(folder.path().join("robot.urdf"), built_in.urdf()).expect("written");
    for command in [
        &["probe"][..],
        &["motors"],
        &["view"],
        &["track", "arc"],
        &["play", "a.csv"],
        &["up", "--plant", "sim"],
        &["drill"],
    ] {
        let arm = ["--arm", "robot.urdf", "--tip", "no_such_link"];
        let answer = run_in(folder.path(), &[command, &arm].concat());
        assert_eq!(answer.code, Some(3), "{command:?}: {}", answer.stderr);
        assert_one_clear_line(&answer, &["robot.urdf", "no_such_link"]);
    }
}

/// The log is not changed: under its own name, through a link, or as the incomplete file of an ended run.
#[test]
fn a_table_is_not_written_over_its_log() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["run.mcap", "cut.mcap.part"] {
        std::fs::write(folder.path().join(name), "a log").expect("written");
    }
    std::os::unix::fs::symlink("run.mcap", folder.path().join("link.csv")).expect("linked");
    for (log, out) in [
        ("run.mcap", "run.mcap"),
        ("run.mcap", "./run.mcap"),
        ("run.mcap", "link.csv"),
        ("cut.mcap.part", "cut.mcap"),
    ] {
        let answer = run_in(folder.path(), &["log", "export", log, "--out", out]);
        assert_ne!(answer.code, Some(0), "{log} to {out}");
        assert_one_clear_line(&answer, &[log, "another name"]);
        let kept = std::fs::read_to_string(folder.path().join(log)).expect("still there");
        assert_eq!(kept, "a log", "{log} to {out}");
    }
}

/// A run whose log would replace its trace, or whose trace cannot be written, is not started.
#[test]
fn outputs_of_a_run_that_replace_one_another_are_code_6_before_anything_is_written() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("old.mcap"), "an older log").expect("written");
    std::os::unix::fs::symlink("old.mcap", folder.path().join("link")).expect("linked");
    let before = tree(folder.path());
    let up = ["up", "--plant", "sim", "--virtual-time", "--for", "0.1"];
    for (log, trace) in [
        ("same.x", "same.x"),
        ("same.x", "./same.x"),
        ("same.x", "same.x.part"),
        ("old.mcap", "link"),
    ] {
        let answer = run_in(
            folder.path(),
            &[&up[..], &["--log", log, "--trace", trace]].concat(),
        );
        assert_eq!(answer.code, Some(6), "{log} {trace}: {}", answer.stderr);
        assert_one_clear_line(
            &answer,
            &[trace, log, "--trace", "--log", "different names"],
        );
    }
    for trace in ["/proc/self/x", "none/trace.csv"] {
        let answer = run_in(
            folder.path(),
            &[&up[..], &["--no-log", "--trace", trace]].concat(),
        );
        assert_eq!(answer.code, Some(6), "{trace}: {}", answer.stderr);
        assert_one_clear_line(&answer, &[trace, "a folder that exists"]);
    }
    assert_eq!(tree(folder.path()), before, "no additional files");
}

/// A message does not repeat a value of megabytes completely.
#[test]
fn a_long_value_is_shortened_in_the_message() {
    let folder = tempfile::tempdir().expect("a folder");
    let value = "x".repeat(2_000_000);
    let csv = format!("time_s,x_m,y_m,z_m\n0,{value},1,2\n");
    fs::write(folder.path().join("long.csv"), csv).expect("written");
    let answer = run_in(folder.path(), &["play", "long.csv"]);
    assert_eq!(answer.code, Some(3));
    assert!(answer.stderr.len() < 300, "{} bytes", answer.stderr.len());
    assert_one_clear_line(
        &answer,
        &["long.csv", "line 2", "x_m", "2000000 characters"],
    );
}

#[test]
fn with_json_errors_of_operator_commands_are_objects_on_standard_output() {
    let folder = tempfile::tempdir().expect("a folder");
    for command in [
        &["stop"][..],
        &["pendant", "status"],
        &["log", "export", "none.mcap", "--out", "none.csv"],
    ] {
        let answer = run_in(folder.path(), &[command, &["--json"]].concat());
        let object: serde_json::Value = serde_json::from_str(&answer.stdout)
            .unwrap_or_else(|error| panic!("{command:?}: {error}"));
        let code = object["error"]["exit_code"].as_i64();
        assert_eq!(code, answer.code.map(i64::from), "{command:?}: {object}");
    }
}
