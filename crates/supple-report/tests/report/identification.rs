//! Tests of the identification commands: complete results, and rejection of invalid input with its column.

use crate::support::{arg, assert_one_clear_line, run};
use std::path::Path;

fn table(folder: &Path, name: &str, change: impl Fn(usize, &mut Vec<f64>)) -> String {
    let mut text = "t,q[0],q[1],q[2],tau[0],tau[1],tau[2]\n".to_owned();
    for i in 0..800 {
        let t = 0.01 * i as f64;
        let mut row = vec![t];
        row.extend((0..3).map(|j| (t * (1.0 + 0.3 * f64::from(j))).sin()));
        row.extend((0..3).map(|j| 3.0 * (t + f64::from(j)).cos()));
        change(i, &mut row);
        let cells: Vec<String> = row.iter().map(ToString::to_string).collect();
        text += &(cells.join(",") + "\n");
    }
    let path = folder.join(name);
    std::fs::write(&path, text).expect("written");
    path.display().to_string()
}

#[test]
fn an_invalid_log_is_rejected_with_its_column_and_a_remedy() {
    let folder = tempfile::tempdir().expect("a folder");
    let nan = table(folder.path(), "nan.csv", |i, row| {
        if i == 7 {
            row[5] = f64::NAN;
        }
    });
    let gap = table(folder.path(), "gap.csv", |i, row| {
        if i >= 100 {
            row[0] += 1.0;
        }
    });
    let degrees = table(folder.path(), "degrees.csv", |_, row| {
        row[2] = row[2].to_degrees();
    });
    let still = table(folder.path(), "still.csv", |_, row| row[3] = 0.5);
    let out = folder.path().join("out");
    for (log, words) in [
        (&nan, ["tau[1]", "sample 7"]),
        (&gap, ["t: a gap", "split the log"]),
        (&degrees, ["q[1]", "degrees"]),
        (&still, ["q[2]", "not excited"]),
    ] {
        let answer = run(&["identify", log, "--arm", "wam3", "--out", arg(&out)]);
        assert_eq!(answer.code, Some(9), "{}", answer.stderr);
        assert_one_clear_line(&answer, &words);
        assert!(!out.exists());
    }
    let absent = run(&["identify", "nowhere.csv", "--arm", "wam3"]);
    assert_eq!(absent.code, Some(6), "{}", absent.stderr);
    let joints = run(&["identify", &still, "--arm", "wam3", "--moving", "0,7"]);
    assert_eq!(joints.code, Some(9), "{}", joints.stderr);
}

#[test]
fn a_design_writes_table_figure_and_summary() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("design");
    let answer = run(&[
        "excite",
        "design",
        "--arm",
        "wam3",
        "--candidates",
        "30",
        "--quiet",
        "--json",
        "--out",
        arg(&out),
    ]);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    let summary: serde_json::Value = serde_json::from_str(&answer.stdout).expect("JSON");
    assert!(summary["condition"].as_f64().expect("a number") >= 1.0);
    let figure = std::fs::read_to_string(out.join("excitation.svg")).expect("a figure");
    roxmltree::Document::parse(&figure).expect("an SVG");
    let table = std::fs::read_to_string(out.join("excitation.csv")).expect("a table");
    assert!(table.starts_with("t,q[0],q[1],q[2],qd[0]"));
    let duration_s = summary["duration_s"].as_f64().expect("a number");
    assert_eq!(table.lines().count(), (100.0 * duration_s) as usize + 2);
}

/// Designs a motion, logs it, identifies a model and refits it; each command uses the output of the previous one.
#[test]
fn a_model_identified_from_a_designed_motion_loads() {
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name).display().to_string();
    let (design, excited, identified, learnt) =
        (at("design"), at("excited"), at("identified"), at("learnt"));
    let done = |arguments: &[&str]| -> serde_json::Value {
        let answer = run(arguments);
        assert_eq!(answer.code, Some(0), "{arguments:?}: {}", answer.stderr);
        serde_json::from_str(&answer.stdout).expect("JSON")
    };
    let short = [
        "--candidates",
        "40",
        "--period",
        "8",
        "--periods",
        "2",
        "--quiet",
        "--json",
    ];
    done(
        &[
            &["excite", "design", "--arm", "wam3", "--out", &design],
            &short[..],
        ]
        .concat(),
    );
    let followed = done(&[
        "excite", "run", "--arm", "wam3", "--design", &design, "--out", &excited, "--json",
    ]);
    let log = followed["log"].as_str().expect("a path");
    let found = done(&[
        "identify",
        log,
        "--arm",
        "wam3",
        "--out",
        &identified,
        "--json",
    ]);
    assert_eq!(found["positive_definite"], 1.0);
    let error = found["held_out"][0]["total_relative"]
        .as_f64()
        .expect("a number");
    assert!(error < 0.15, "{error}");
    let report = std::fs::read_to_string(folder.path().join("identified/report.html"));
    let report = report.expect("a report");
    assert!(report.contains("<svg"));
    let corrected = done(&[
        "learn",
        log,
        "--arm",
        &identified,
        "--out",
        &learnt,
        "--last",
        "10",
        "--json",
    ]);
    let joints = corrected["joints"].as_array().expect("a list");
    assert_eq!(joints.len(), 3);
    let empty = run(&[
        "excite",
        "run",
        "--arm",
        "wam4",
        "--design",
        &design,
        "--out",
        &at("no"),
    ]);
    assert_eq!(empty.code, Some(9), "{}", empty.stderr);
    assert_one_clear_line(&empty, &["centre_rad", "4 joints"]);
    // The motion was designed for another arm, with a joint that this arm lacks.
    let summary = std::fs::read_to_string(folder.path().join("design/summary.json"));
    let mut edited: serde_json::Value =
        serde_json::from_str(&summary.expect("a summary")).expect("JSON");
    edited["arm"] = "another".into();
    edited["moving"] = [0, 1, 3].as_slice().into();
    std::fs::write(at("edited.json"), edited.to_string()).expect("written");
    let foreign = run(&[
        "excite",
        "run",
        "--arm",
        "wam3",
        "--design",
        &at("edited.json"),
        "--out",
        &at("no"),
    ]);
    assert_eq!(foreign.code, Some(9), "{}", foreign.stderr);
    for part in [
        "designed for another, and runs on",
        "joint 3 of `moving`",
        "3 joints",
    ] {
        assert!(foreign.stderr.contains(part), "{part}: {}", foreign.stderr);
    }
    let absent = run(&["excite", "run", "--arm", "wam3", "--design", &at("nowhere")]);
    assert_eq!(absent.code, Some(6), "{}", absent.stderr);
    let log = run(&["learn", "nowhere.mcap", "--arm", "wam3"]);
    assert_eq!(log.code, Some(6), "{}", log.stderr);
}

#[test]
fn a_calibration_prints_its_verdict_and_the_demo_with_its_model() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("calibrated");
    let answer = run(&[
        "calibrate",
        "--ripple",
        "0.3",
        "--quiet",
        "--out",
        arg(&out),
    ]);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    for words in [
        "breakaway of joint1",
        "ripple of motor 3: harmonic 6",
        "for 5 N/m: the torques that the feed-forward leaves allow",
        "sinusoid at 5 N/m with this model",
        "this is a simulation",
        "given plant: sinusoid at 5 N/m, RMS error",
    ] {
        assert!(
            answer.stdout.contains(words),
            "{words} in {}",
            answer.stdout
        );
    }
    for file in [
        "arm.toml",
        "arm.urdf",
        "report.html",
        "calibration.json",
        "logs",
        "plant/arm.toml",
        "demo/report.html",
    ] {
        assert!(out.join(file).exists(), "{file}");
    }
    assert!(
        !answer.stdout.contains("perturbed model"),
        "{}",
        answer.stdout
    );
    // The demo uses the calibrated arm with its model and its encoders, and no other plant.
    let summary = std::fs::read_to_string(out.join("demo/summary.json")).expect("a summary");
    let summary: serde_json::Value = serde_json::from_str(&summary).expect("JSON");
    assert!(summary["model"].is_string(), "{}", summary["model"]);
    assert_eq!(summary["plant"]["encoder_noise_rad"], 5e-4);
    assert!(summary["realistic"].is_null(), "{}", summary["realistic"]);
}

/// Expected values, written before the first run: ten of twelve combinations, moments within 5 % of the plant's, gravity within
/// 3 %.
#[test]
fn the_papers_procedure_finds_the_moments_of_the_papers_arm() {
    let answer = run(&["calibrate-paper", "--json", "--quiet"]);
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    let found: serde_json::Value = serde_json::from_str(&answer.stdout).expect("JSON");
    assert_eq!(
        (found["samples"].as_u64(), found["rank"].as_u64()),
        (Some(1600), Some(10))
    );
    for name in ["m2r2", "m3r3"] {
        let rows = found["combinations"].as_array().expect("rows");
        let row = rows.iter().find(|row| row["name"] == name).expect("named");
        let number = |key: &str| row[key].as_f64().expect("a number");
        let error = number("found") / number("plant") - 1.0;
        assert!(error.abs() < 0.05, "{name}: {error}");
    }
    let gravity = found["gravity_error_relative"].as_f64().expect("a number");
    assert!(gravity < 0.03, "{gravity}");
    let short = run(&["calibrate-paper", "--samples", "1599"]);
    assert_eq!(short.code, Some(2));
    assert!(short.stderr.contains("1600"), "{}", short.stderr);
}

#[test]
fn help_lists_the_identification_commands() {
    let help = run(&["--help"]).stdout;
    for word in ["identify", "excite", "breakaway", "calibrate", "learn"] {
        assert!(help.contains(word), "{word} in {help}");
    }
    assert!(run(&["demo", "--help"]).stdout.contains("--model"));
}

/// The arm's motors give all of the commanded torque; 300 g are at its tip, 0.36 m from the last joint.
#[test]
fn a_weight_of_known_mass_gives_torque_scales() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let weight = path("weight.toml");
    std::fs::write(&weight, "tool_extra_kg = 0.3\n").expect("written");
    let design = path("design");
    let done = |arguments: &[&str]| {
        let answer = run(arguments);
        assert_eq!(answer.code, Some(0), "{}", answer.stderr);
        answer.stdout
    };
    let arm = ["--arm", "wam4"];
    let out = ["--candidates", "60", "--quiet", "--out", arg(&design)];
    done(&[&["excite", "design"][..], &arm, &out].concat());
    let motion = ["excite", "run", "--no-slow", "--design", arg(&design)];
    let (empty, loaded) = (path("empty"), path("loaded"));
    done(&[&motion[..], &arm, &["--out", arg(&empty)]].concat());
    let with = ["--plant-options", arg(&weight), "--out", arg(&loaded)];
    done(&[&motion[..], &arm, &with].concat());
    let log = |of: &Path| of.join("logs/excitation.mcap").display().to_string();
    let (empty, loaded) = (log(&empty), log(&loaded));
    let model = path("model");
    let model = ["--quiet", "--json", "--out", arg(&model)];
    let weighed = ["identify", &empty, "--weighed", &loaded];
    let text = done(&[&weighed[..], &["--weight-kg", "0.3"], &arm, &model].concat());
    let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let weighing = &summary["weighing"];
    for joint in 1..4 {
        let scale = weighing["joints"][joint]["torque_scale"].as_f64();
        assert!(
            scale.is_some_and(|scale| (scale - 1.0).abs() < 0.02),
            "{weighing}"
        );
    }
    let along_m = weighing["com_m"][1].as_f64().expect("a number");
    assert!((along_m + 0.36).abs() < 0.01, "{weighing}");
    let alone = run(&[&weighed[..], &arm].concat());
    assert_eq!(alone.code, Some(2), "{}", alone.stderr);
    assert!(alone.stderr.contains("--weight-kg"), "{}", alone.stderr);
}
