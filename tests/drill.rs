//! A part of `supple drill`: rows in virtual time, which are the same on every machine, and one loss by the wall
//! clock, with nothing said of how long things take on the machine of a test.

mod support;

use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::Command;
use support::programs;

/// Force of the impact of a braked arm that has sunk on a block; what it converges to is in
/// `supple-plant/tests/braking.rs`. It falls for 0.1 s more where the fallback torque is not quite gravity.
const IMPACT_N: core::ops::Range<f64> = 50.0..400.0;
/// The block is this far beneath the tip, whose way is level \[m\].
const HEIGHT_M: f64 = 0.05;
/// The motors' torques do not rise by more than this when nobody commands them \[N m\].
const RISE_NM: f64 = 1.0;

/// The rows of a drill, what it said, and its exit code.
fn drill(place: &Path, arguments: &[&str]) -> (Vec<Value>, String, Option<i32>) {
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(place, owner).expect("changed");
    let output = Command::new(programs().join("supple"))
        .args(["drill", "--json"])
        .args(arguments)
        .current_dir(place)
        .env("XDG_RUNTIME_DIR", place)
        .output()
        .expect("it runs");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    // The table comes first, and then what was not as expected.
    let text = String::from_utf8_lossy(&output.stdout);
    let mut documents = serde_json::Deserializer::from_str(&text).into_iter::<Value>();
    let rows = documents.next().and_then(Result::ok);
    let rows = rows.unwrap_or_else(|| panic!("{text}{words}"));
    let rows = rows.as_array().expect("rows").clone();
    (rows, words, output.status.code())
}

#[test]
fn faults_collisions_and_wrong_requests_end_as_they_were_written() {
    let place = tempfile::tempdir().expect("a folder");
    let page = place.path().join("drill.md");
    let page_name = page.display().to_string();
    let mut arguments = vec!["--markdown", &page_name];
    let wanted = [
        "sim/track/nothing",
        "sim/gravity_hold/bump:joint=3",
        "sim/move/block-in-the-way",
        "sim/track/reply-lost",
        "sim/track/encoder-sign",
        "sim/track/stiff-drives-idle-and-back",
        "sim/track/too-fast-request",
        "emu/move/bump:joint=3",
        "emu/track/drives-idle-and-back",
    ];
    for name in wanted {
        arguments.extend(["--only", name]);
    }
    arguments.push("--virtual-time");
    let (rows, words, code) = drill(place.path(), &arguments);
    assert_eq!(rows.len(), wanted.len(), "{words}");
    for row in &rows {
        assert_eq!(row["as_expected"], true, "{row:#}");
    }
    assert_eq!(code, Some(0), "{words}");
    let page = std::fs::read_to_string(page).expect("a page");
    assert!(page.contains("9 of 9 rows are as expected"), "{page}");
    assert!(
        page.contains("| sim/track/encoder-sign:joint=1 |"),
        "{page}"
    );
}

/// The same row twice is the same row.
#[test]
fn a_row_in_virtual_time_is_the_same_each_time() {
    let place = tempfile::tempdir().expect("a folder");
    let once = || drill(place.path(), &["--only", "sim/move/bump:joint=1"]).0;
    let first = once();
    assert_eq!(first.len(), 1);
    assert!(
        first[0]["tip_after_m_per_s"].as_f64() > Some(0.5),
        "{first:?}"
    );
    assert_eq!(first, once());
}

#[test]
fn a_row_that_is_not_there_is_named() {
    let output = Command::new(programs().join("supple"))
        .args(["drill", "--only", "sim/dance"])
        .output()
        .expect("it runs");
    assert_eq!(output.status.code(), Some(2));
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        words.contains("sim/dance") && words.contains("--list"),
        "{words}"
    );
}

#[test]
fn a_lost_controller_ends_in_braking_motors_and_a_slow_descent() {
    let place = tempfile::tempdir().expect("a folder");
    let arguments = [
        "--only",
        "sim/track/kill-supple-rt",
        "--only",
        "sim/track/stop-supple-rt",
    ];
    let (rows, words, _) = drill(place.path(), &arguments);
    assert_eq!(rows.len(), 2, "{words}");
    for row in rows {
        let number = |key: &str| row[key].as_f64();
        assert!(number("rejoined_after_s").is_some(), "{row}");
        assert!(number("braked_after_ms").is_some(), "{row}");
        assert!(
            number("torque_rise_nm").is_some_and(|nm| nm < RISE_NM),
            "{row}"
        );
        let sank_m = number("sank_m").expect("a depth");
        assert!((sank_m - HEIGHT_M).abs() < 0.02, "{row}");
        let peak_n = number("peak_force_n").expect("a force");
        assert!(IMPACT_N.contains(&peak_n), "{row}");
    }
}
