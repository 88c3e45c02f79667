//! Tests of `supple drill` with a subset of its cases: test cases in virtual time, which are reproducible, and one process loss in wall-clock
//! time without timing checks.

use crate::running::{run, stderr_of, temporary_folder};
use serde_json::Value;
use std::path::Path;

/// Impact force of a braked arm that has descended onto a block; the converged value is in
/// `supple-plant/tests/plant/braking.rs`. The arm falls for another 0.1 s if the fallback torque differs slightly from
/// gravity.
const IMPACT_N: core::ops::Range<f64> = 50.0..400.0;
/// Distance of the block beneath the tip, whose path is level \[m\].
const HEIGHT_M: f64 = 0.05;
/// Maximum rise of a motor torque after the commands stop \[N m\].
const MAX_TORQUE_RISE_NM: f64 = 1.0;

/// Runs `supple drill`; returns its results, standard error and exit code.
fn drill(folder: &Path, arguments: &[&str]) -> (Vec<Value>, String, Option<i32>) {
    let output = run(folder, &[&["drill", "--json"], arguments].concat());
    let stderr = stderr_of(&output);
    // The table comes first, then the unexpected results.
    let text = String::from_utf8_lossy(&output.stdout);
    let mut documents = serde_json::Deserializer::from_str(&text).into_iter::<Value>();
    let rows = documents.next().and_then(Result::ok);
    let rows = rows.unwrap_or_else(|| panic!("{text}{stderr}"));
    let rows = rows.as_array().expect("rows").clone();
    (rows, stderr, output.status.code())
}

#[test]
fn faults_collisions_and_invalid_requests_give_the_expected_results() {
    let folder = temporary_folder();
    let page = folder.path().join("drill.md");
    let page_name = page.display().to_string();
    let mut arguments = vec!["--markdown", &page_name];
    let wanted = [
        "sim/probe/nothing",
        "sim/gravity_hold/bump:joint=3",
        "sim/move/block-in-the-way",
        "sim/track/reply-lost",
        "sim/move/encoder-sign",
        "sim/track/stiff-drives-idle-and-back",
        "sim/track/too-fast-request",
        "emu/move/bump:joint=3",
        "emu/track_pose/drives-idle-at-home-and-back-realistic",
        "emu/move/e-stop",
    ];
    for name in wanted {
        arguments.extend(["--only", name]);
    }
    arguments.push("--virtual-time");
    let (rows, stderr, code) = drill(folder.path(), &arguments);
    assert_eq!(rows.len(), wanted.len(), "{stderr}");
    // Standard error is a pipe: each case is reported on a separate line.
    for number in 1..=wanted.len() {
        let line = format!("{number}/{}: ", wanted.len());
        assert!(
            stderr.lines().any(|said| said.starts_with(&line)),
            "{line}in {stderr}"
        );
    }
    for row in &rows {
        assert_eq!(row["as_expected"], true, "{row:#}");
    }
    assert_eq!(code, Some(0), "{stderr}");
    let page = std::fs::read_to_string(page).expect("a page");
    let count = wanted.len();
    let result = format!("{count} of {count} test cases gave the expected result");
    assert!(page.contains(&result), "{page}");
    assert!(page.contains("| sim/move/encoder-sign:joint=1 |"), "{page}");
}

/// Random cases are the same in each run, for any distribution to the processors. None of these cases gives the arm more than 3 J or
/// causes a false fault. A stuck encoder under a stiff law once gave it 33 J.
#[test]
fn random_faults_are_reproducible_and_bounded() {
    let folder = temporary_folder();
    let page = folder.path().join("random.md");
    let page_name = page.display().to_string();
    let search = |more: &[&str]| drill(folder.path(), &[&["--random", "150"], more].concat());
    let (rows, stderr, code) = search(&["--markdown", &page_name]);
    let count = rows.len();
    assert!(count > 130, "{count} cases: {stderr}");
    assert_eq!(search(&[]).0, rows);
    let exceeding = |row: &&Value| !row["excesses"].as_array().expect("a list").is_empty();
    let exceeding: Vec<&Value> = rows.iter().filter(exceeding).collect();
    assert_eq!(
        code,
        Some(if exceeding.is_empty() { 0 } else { 12 }),
        "{stderr}"
    );
    for row in &rows {
        // A bump transfers its energy to the arm.
        let struck = row["faults"].to_string().contains("bump");
        let peak_j = row["peak_j"].as_f64().expect("a number");
        assert!(struck || peak_j < 3.0, "{row:#}");
        assert_ne!(row["excesses"][0], "false_fault", "{row:#}");
        assert_ne!(row["excesses"][0], "idle_refused", "{row:#}");
    }
    let page = std::fs::read_to_string(page).expect("a page");
    let summary = format!("{count} cases, {} with something", exceeding.len());
    assert!(page.contains(&summary), "{page}");
    if let Some(row) = exceeding.first() {
        let seed = row["seed"].to_string();
        let repeated = drill(folder.path(), &["--random", "1", "--seed", &seed]).0;
        assert_eq!(&&repeated[0], row);
    }
}

/// Two runs of a test case in virtual time give the same result.
#[test]
fn a_test_case_in_virtual_time_is_reproducible() {
    let folder = temporary_folder();
    let once = || drill(folder.path(), &["--only", "sim/move/bump:joint=1"]).0;
    let first = once();
    assert_eq!(first.len(), 1);
    assert!(
        first[0]["tip_after_m_per_s"].as_f64() > Some(0.5),
        "{first:?}"
    );
    assert_eq!(first, once());
}

#[test]
fn the_error_of_an_unknown_test_case_contains_its_name() {
    let folder = temporary_folder();
    let output = run(folder.path(), &["drill", "--only", "sim/dance"]);
    assert_eq!(output.status.code(), Some(2));
    let stderr = stderr_of(&output);
    assert!(
        stderr.contains("sim/dance") && stderr.contains("--list"),
        "{stderr}"
    );
}

#[test]
fn a_lost_controller_ends_in_braking_motors_and_a_slow_descent() {
    let folder = temporary_folder();
    let arguments = [
        "--only",
        "sim/track/kill-supple-rt",
        "--only",
        "sim/track/stop-supple-rt",
    ];
    let (rows, stderr, _) = drill(folder.path(), &arguments);
    assert_eq!(rows.len(), 2, "{stderr}");
    for row in rows {
        let number = |key: &str| row[key].as_f64();
        assert!(number("rejoined_after_s").is_some(), "{row}");
        assert!(number("braked_after_ms").is_some(), "{row}");
        assert!(
            number("torque_rise_nm").is_some_and(|nm| nm < MAX_TORQUE_RISE_NM),
            "{row}"
        );
        let sank_m = number("sank_m").expect("a depth");
        assert!((sank_m - HEIGHT_M).abs() < 0.02, "{row}");
        let peak_n = number("peak_force_n").expect("a force");
        assert!(IMPACT_N.contains(&peak_n), "{row}");
    }
}
