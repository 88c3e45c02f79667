//! A part of `supple drill`, by the wall clock as it is meant, but with nothing said of how long things take on
//! the machine of a test: what the motors do when their controller is killed or stopped, and what that does to a
//! body beneath the arm.

mod support;

use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;
use support::programs;

/// Force of the impact of a braked arm that has sunk on a block; what it converges to is in
/// `supple-plant/tests/braking.rs`. It falls for 0.1 s more where the fallback torque is not quite gravity.
const IMPACT_N: core::ops::Range<f64> = 50.0..400.0;
/// The block is this far beneath the tip, whose way is level \[m\].
const HEIGHT_M: f64 = 0.05;
/// The motors' torques do not rise by more than this when nobody commands them \[N m\].
const RISE_NM: f64 = 1.0;

#[test]
fn a_lost_controller_ends_in_braking_motors_and_a_slow_descent() {
    let place = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(place.path(), owner).expect("changed");
    let arguments = "drill --plant sim --process supple-rt --json";
    let output = Command::new(programs().join("supple"))
        .args(arguments.split(' '))
        .current_dir(place.path())
        .env("XDG_RUNTIME_DIR", place.path())
        .output()
        .expect("it runs");
    let words = String::from_utf8_lossy(&output.stderr);
    // The table comes first, and then, on a machine that is late, what was not as expected.
    let text = String::from_utf8_lossy(&output.stdout);
    let mut documents = serde_json::Deserializer::from_str(&text).into_iter::<Value>();
    let rows = documents.next().and_then(Result::ok);
    let rows = rows.unwrap_or_else(|| panic!("{text}{words}"));
    let rows = rows.as_array().expect("rows");
    assert_eq!(rows.len(), 3, "{text}");
    for row in rows {
        let number = |key: &str| row[key].as_f64();
        assert!(number("rejoined_after_s").is_some(), "{row}");
        if row["loss"] == "nothing" {
            assert_eq!(row["outcome"], "tracked on", "{row}");
            assert_eq!(number("peak_force_n"), Some(0.0), "{row}");
            continue;
        }
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
