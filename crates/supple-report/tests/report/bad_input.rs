//! Tests of invalid descriptions, infeasible experiments, read-only folders and a full disk: each gives one error line, the
//! documented exit code and no output files.

use crate::support::{Answer, arg, assert_one_clear_line, fifo, program, run, run_in, tree};
use std::fs;
use std::path::{Path, PathBuf};
use supple_model::Description;

/// Writes the built-in 4-joint arm into a new folder, with its TOML and its URDF changed by these functions.
fn arm_in(
    folder: &Path,
    toml: impl Fn(String) -> String,
    urdf: impl Fn(String) -> String,
) -> PathBuf {
    let arm = Description::asset("wam4").expect("built in");
    let arm_folder = folder.join("arm");
    fs::create_dir(&arm_folder).expect("a folder");
    fs::write(arm_folder.join("arm.toml"), toml(arm.toml().to_owned())).expect("written");
    fs::write(arm_folder.join("arm.urdf"), urdf(arm.urdf().to_owned())).expect("written");
    arm_folder
}

fn demo_of(arm: &Path, out: &Path) -> Answer {
    run(&[
        "demo",
        "--quiet",
        "--no-logs",
        "--arm",
        arg(arm),
        "--out",
        arg(out),
    ])
}

/// Replaces the first occurrence; panics if there is none.
fn replaced(text: String, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from} is not in the file");
    text.replacen(from, to, 1)
}

fn unchanged(text: String) -> String {
    text
}

#[test]
fn a_nan_in_a_urdf_is_code_3() {
    let folder = tempfile::tempdir().expect("a folder");
    let mass = |urdf: String| {
        let at = urdf.find("<mass value=\"").expect("a mass") + "<mass value=\"".len();
        let end = at + urdf[at..].find('"').expect("its end");
        format!("{}NaN{}", &urdf[..at], &urdf[end..])
    };
    let arm = arm_in(folder.path(), unchanged, mass);
    let out = folder.path().join("out");
    let answer = demo_of(&arm, &out);
    assert_eq!(answer.code, Some(3), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["arm.urdf", "mass", "NaN"]);
    assert!(!out.exists());
}

#[test]
fn a_wrong_number_of_joints_is_code_3() {
    let folder = tempfile::tempdir().expect("a folder");
    let one_more = |toml: String| replaced(toml, "home_rad = [0.0,", "home_rad = [0.0, 0.0,");
    let arm = arm_in(folder.path(), one_more, unchanged);
    let out = folder.path().join("out");
    let answer = demo_of(&arm, &out);
    assert_eq!(answer.code, Some(3), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["arm.toml", "home_rad"]);
    assert!(!out.exists());
}

#[test]
fn a_missing_file_is_code_3() {
    let answer = run(&["demo", "--arm", "no/such/arm.toml"]);
    assert_eq!(answer.code, Some(3));
    assert_one_clear_line(&answer, &["no/such/arm.toml"]);
}

#[test]
fn a_trajectory_out_of_reach_is_code_4() {
    let folder = tempfile::tempdir().expect("a folder");
    // The elbow's origin is the length of the upper arm: the shortened arm cannot reach the trajectory.
    let shorter = |urdf: String| replaced(urdf, "0.55", "0.15");
    // Without [paths], the trajectories would be scaled to the shorter arm.
    let as_in_the_paper = |toml: String| {
        toml + "\n[paths]\nradius_m = 0.6\nazimuth_rad = 0.0\nheight_m = 0.0\nscale = 1.0\n"
    };
    let arm = arm_in(folder.path(), as_in_the_paper, shorter);
    let out = folder.path().join("out");
    let answer = demo_of(&arm, &out);
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["cannot reach"]);
    assert!(!out.exists());
}

#[test]
fn an_unwritable_folder_is_code_6_before_the_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "someone else's").expect("written");
    let below_a_file = file.join("out");
    for out in [below_a_file.as_path(), &file, Path::new("/proc/supple-out")] {
        let answer = run(&["demo", "--out", arg(out)]);
        assert_eq!(answer.code, Some(6), "{}: {}", out.display(), answer.stderr);
        assert_one_clear_line(&answer, &[arg(out), "--out"]);
        assert!(
            !answer.stderr.contains('%'),
            "progress was printed: {}",
            answer.stderr
        );
    }
    assert_eq!(
        fs::read_to_string(&file).expect("still there"),
        "someone else's"
    );
    assert_eq!(tree(folder.path()), [Path::new("file")]);
}

#[cfg(unix)]
#[test]
fn a_full_disk_is_code_6_and_leaves_no_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    // The file size limit is 64 blocks: the first log does not fit.
    let script = "trap '' XFSZ; ulimit -f 64; exec \"$0\" \"$@\"";
    let output = std::process::Command::new("sh")
        .args(["-c", script, crate::support::PROGRAM, "demo", "--quiet"])
        .args(["--out", arg(&out)])
        .output()
        .expect("it starts");
    let answer = Answer::from(output);
    assert_eq!(answer.code, Some(6), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["File too large"]);
    assert!(tree(folder.path()).is_empty(), "{:?}", tree(folder.path()));
}

#[cfg(unix)]
#[test]
#[expect(clippy::disallowed_methods, reason = "another process is waited for")]
fn an_interrupt_is_code_130_and_leaves_no_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut child = program(&["demo", "--quiet", "--out", arg(&out)])
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("it starts");
    let pid = child.id().to_string();
    // The program creates the folder of the logs just before the experiments.
    while tree(folder.path())
        .iter()
        .all(|path| !path.ends_with("logs"))
    {
        assert!(
            child.try_wait().expect("a child").is_none(),
            "the program ended by itself"
        );
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let sent = std::process::Command::new("kill")
        .args(["-INT", &pid])
        .status();
    assert!(sent.expect("kill exists").success());
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130));
    assert!(tree(folder.path()).is_empty(), "{:?}", tree(folder.path()));
}

/// Devices and FIFOs are rejected and not changed.
#[cfg(unix)]
#[test]
fn outputs_that_are_not_regular_files_are_code_6_before_anything_is_written() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    fifo(&at("fifo"));
    for out in ["demo", "design"] {
        fs::create_dir(at(out)).expect("made");
        fifo(&at(out).join("summary.json"));
    }
    fs::write(at("a.mcap"), "no log").expect("written");
    let before = tree(folder.path());
    for (word, args) in [
        ("a FIFO", &["demo", "--quiet", "--out", "demo"][..]),
        (
            "a FIFO",
            &["excite", "design", "--arm", "wam4", "--out", "design"],
        ),
        (
            "a character device",
            &["log", "export", "a.mcap", "--out", "/dev/null"],
        ),
        ("a FIFO", &["log", "export", "a.mcap", "--out", "fifo"]),
    ] {
        let answer = run_in(folder.path(), args);
        assert_eq!(answer.code, Some(6), "{args:?}: {}", answer.stderr);
        assert_one_clear_line(&answer, &[word, "regular file"]);
    }
    let answer = run_in(folder.path(), &["demo", "--quiet", "--out", "/dev/null"]);
    assert_eq!(answer.code, Some(6), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["/dev/null: not a directory", "--out"]);
    assert_eq!(tree(folder.path()), before, "a file was added or removed");
    for device in ["/dev/null", "/dev/full"] {
        let kind = fs::metadata(device).expect("still there").file_type();
        assert!(kind.is_char_device(), "{device}");
    }
    let kind = fs::metadata(at("fifo")).expect("still there").file_type();
    assert!(kind.is_fifo());
}

#[cfg(unix)]
#[test]
fn inputs_that_are_not_regular_files_are_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    fifo(&folder.path().join("fifo"));
    fifo(&folder.path().join("fifo.mcap"));
    for (code, args) in [
        (3, &["demo", "--arm", "./fifo"][..]),
        (3, &["demo", "--arm", "/dev/zero"]),
        (3, &["demo", "--model", "./fifo"]),
        (6, &["log", "info", "fifo.mcap"]),
        (6, &["log", "replay", "/dev/zero"]),
        (6, &["log", "recover", "fifo.mcap", "to.mcap"]),
        (6, &["identify", "--arm", "wam4", "fifo"]),
        (6, &["identify", "--arm", "wam4", "/dev/zero"]),
        (6, &["learn", "--arm", "wam4", "fifo.mcap"]),
        (6, &["excite", "run", "--arm", "wam4", "--design", "fifo"]),
    ] {
        let answer = run_in(folder.path(), args);
        assert_eq!(answer.code, Some(code), "{args:?}: {}", answer.stderr);
        assert_one_clear_line(&answer, &["not a regular file"]);
    }
}

#[test]
fn numbers_out_of_range_are_code_2_with_their_range() {
    let design = ["excite", "design", "--arm", "wam4"];
    let identify = ["identify", "--arm", "wam4", "log.csv"];
    let folder = tempfile::tempdir().expect("a folder");
    for (command, option, value) in [
        (&design[..], "--candidates", "4294967296"),
        (&design, "--candidates", "0"),
        (&design, "--period", "1e300"),
        (&design, "--periods", "1e300"),
        (&design, "--periods", "nan"),
        (&identify, "--rate", "1e300"),
        (&identify, "--cutoff", "inf"),
        (&identify, "--slow", "-1e300"),
        (&identify, "--noise", "1e300"),
        (&["breakaway"], "--ripple", "1e300"),
        (&["calibrate"], "--ripple", "nan"),
        (&["learn", "--arm", "wam4", "log.csv"], "--last", "1e300"),
        (&["learn", "--arm", "wam4", "log.csv"], "--payload", "1e300"),
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
        assert!(line.contains(option), "{option} is not in {line}");
        assert!(
            line.contains(" to ") || line.contains("..="),
            "no range in {line}"
        );
    }
    assert!(tree(folder.path()).is_empty());
}

/// The duration, periods times period, is too long although each number is in range.
#[test]
fn an_excitation_of_days_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let long = ["--period", "3600", "--periods", "1000", "--quiet"];
    let answer = run_in(
        folder.path(),
        &[&["excite", "design", "--arm", "wam4"], &long[..]].concat(),
    );
    assert_eq!(answer.code, Some(9), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["period_s times periods", "3600000", "7200 s"]);
}

/// Half an hour, sampled once a second, on a grid of 100 kHz would need gigabytes.
#[test]
fn a_resampling_grid_that_exceeds_memory_is_rejected() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut table = "t,q0,q1,q2,q3,tau0,tau1,tau2,tau3\n".to_owned();
    for i in 0..2000 {
        let q = f64::from(i % 100) * 1e-2;
        table += &format!("{i},{q},{q},{q},{q},{q},{q},{q},{q}\n");
    }
    fs::write(folder.path().join("log.csv"), table).expect("written");
    // One sample per second looks like a wrong unit of time, which is checked first.
    let args = [
        "identify",
        "--arm",
        "wam4",
        "log.csv",
        "--accept-wrong-logs",
    ];
    let answer = run_in(folder.path(), &[&args[..], &["--rate", "1e5"]].concat());
    assert_eq!(answer.code, Some(9), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["samples at the rate of the grid", "1.999e8"]);
}

/// One warning is printed; with `--strict` the file is rejected.
#[test]
fn unread_urdf_elements_are_a_warning_or_an_error_with_strict() {
    let folder = tempfile::tempdir().expect("a folder");
    let gazebo = |urdf: String| replaced(urdf, "</robot>", "<gazebo/><gazebo/></robot>");
    let arm = arm_in(folder.path(), unchanged, gazebo);
    let identify = ["identify", "--arm", arg(&arm), "log.csv"];
    let answer = run_in(folder.path(), &identify);
    assert_eq!(answer.code, Some(6), "{}", answer.stderr);
    let warnings = answer.stderr.matches("warning: ").count();
    assert_eq!(warnings, 1, "{}", answer.stderr);
    assert!(
        answer.stderr.contains("<gazebo> first of 2"),
        "{}",
        answer.stderr
    );
    for command in [
        &identify[..],
        &["demo", "--arm", arg(&arm)],
        &["excite", "design", "--arm", arg(&arm)],
        &["excite", "run", "--arm", arg(&arm)],
        &["breakaway", "--arm", arg(&arm)],
        &["calibrate", "--arm", arg(&arm)],
        &["learn", "--arm", arg(&arm), "log.csv"],
    ] {
        let answer = run_in(folder.path(), &[command, &["--strict"]].concat());
        assert_eq!(answer.code, Some(3), "{command:?}: {}", answer.stderr);
        assert_one_clear_line(&answer, &["arm.urdf", "<gazebo>", "without strict"]);
    }
}

#[test]
fn a_workspace_has_six_numbers() {
    let folder = tempfile::tempdir().expect("a folder");
    let design = ["excite", "design", "--arm", "wam4", "--quiet"];
    for workspace in ["-1,-1,-1,1,1", "-1,-1,-1,1,1,1,1"] {
        let answer = run_in(
            folder.path(),
            &[&design[..], &["--workspace", workspace]].concat(),
        );
        assert_eq!(answer.code, Some(2), "{workspace}: {}", answer.stderr);
        assert_one_clear_line(&answer, &["--workspace", "6: minimum x, y, z"]);
    }
    assert!(tree(folder.path()).is_empty());
    let six = ["--workspace", "-2,-2,-2,2,2,2", "--candidates", "1"];
    let answer = run_in(folder.path(), &[&design[..], &six].concat());
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
}
