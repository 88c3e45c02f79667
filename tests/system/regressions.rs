//! Regression tests for faults and requests after which the arm oscillated, accelerated suddenly or pressed. They use
//! only the command line: the tip motion is read from the log.

use crate::running::{Up, stderr_of};
use crate::table::cells;
use std::process::Output;

/// Maximum tip speed in normal operation, while descending on braking motors, or while coming to rest \[m/s\].
const TIP_M_PER_S: f64 = 1.0;
/// Maximum tip speed of an arm whose drives are re-enabled while it stands still \[m/s\].
const ACTIVATED_M_PER_S: f64 = 0.5;
/// Observed tip force above which the arm counts as touching an obstacle \[N\].
const TOUCHED_N: f64 = 15.0;
/// Maximum number of cycles of 1 ms until a collision stops a move.
const STOPS_WITHIN: usize = 20;

/// Columns of the steps of a log, by the names of `supple log export`.
struct Steps(Vec<Vec<f64>>);

impl Steps {
    fn of(up: &Up, columns: &[&str]) -> Steps {
        let output = up.run(&["log", "export", "out/up.mcap"]);
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let mut lines = text.lines();
        let heading: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
        let index_of = |name: &&str| {
            let found = heading.iter().position(|column| column == name);
            found.unwrap_or_else(|| panic!("no column {name}: {heading:?}{}", stderr_of(&output)))
        };
        let indices: Vec<usize> = columns.iter().map(index_of).collect();
        let rows = lines.map(|line| {
            let cells: Vec<&str> = cells(line);
            let cell = |column: &usize| cells[*column].parse().expect("a number");
            indices.iter().map(cell).collect()
        });
        Steps(rows.collect())
    }

    /// Returns the length of the vector in the first three columns, per cycle.
    fn lengths(&self) -> impl Iterator<Item = f64> {
        self.0
            .iter()
            .map(|row| row.iter().take(3).map(|x| x * x).sum::<f64>().sqrt())
    }
}

fn max_tip_speed(up: &Up) -> f64 {
    let velocity = ["x", "y", "z"].map(|axis| format!("tip_velocity_m_per_s.{axis}"));
    let steps = Steps::of(up, &velocity.each_ref().map(String::as_str));
    assert!(steps.0.len() > 1000, "{} steps", steps.0.len());
    steps.lengths().fold(0.0, f64::max)
}

/// Waits for `cycles` control cycles.
fn wait(up: &Up, cycles: u64) {
    let now = up.wait_until("a look", |_| true)["cycle"].as_u64();
    up.wait_until("more cycles", |status| {
        status["cycle"].as_u64() > now.map(|cycle| cycle + cycles)
    });
}

fn accepted_or_refused(output: &Output) {
    let code = output.status.code();
    assert!(
        matches!(code, Some(0 | 11)),
        "{code:?}: {}",
        stderr_of(output)
    );
}

#[test]
fn a_motion_that_is_too_fast_does_not_make_the_arm_oscillate() {
    let up = &mut Up::tracking(&["--plant", "sim"]);
    accepted_or_refused(&up.run(&["track", "sinusoid", "--speed", "1000"]));
    wait(up, 2000);
    up.run(&["stop"]);
    up.ended();
    let speed = max_tip_speed(up);
    assert!(speed < TIP_M_PER_S, "{speed} m/s");
}

#[test]
fn reenabled_drives_do_not_jump() {
    let up = &mut Up::tracking(&["--plant", "emu"]);
    let stiff = [
        "gains",
        "--stiffness",
        "1000",
        "--damping",
        "60",
        "--ramp",
        "0",
    ];
    accepted_or_refused(&up.run(&stiff));
    for button in ["idle", "activate"] {
        let output = up.run(&["pendant", button]);
        assert!(output.status.success(), "{}", stderr_of(&output));
        wait(up, 1000);
    }
    up.run(&["stop"]);
    up.ended();
    let speed = max_tip_speed(up);
    assert!(speed < ACTIVATED_M_PER_S, "{speed} m/s");
}

/// The fault ends the run and its log; `supple drill` measures the later force on the block.
#[test]
fn a_block_in_the_way_stops_a_move() {
    let block = ["--plant", "sim", "--block-m", "0.1", "--for", "9"];
    let up = &mut Up::start(&[&block[..], &["--virtual-time"]].concat());
    up.ended();
    let columns = ["x", "y", "z"].map(|axis| format!("external_force_n.{axis}"));
    let [x, y, z] = columns.each_ref().map(String::as_str);
    let steps = Steps::of(up, &[x, y, z, "fault"]);
    let contact = steps.lengths().position(|force| force > TOUCHED_N);
    let contact = contact.expect("the arm touches the block");
    let fault = steps.0.iter().position(|row| row[3] > 0.0);
    let fault = fault.expect("no fault");
    assert!(
        (contact..contact + STOPS_WITHIN).contains(&fault),
        "contact in step {contact}, fault in step {fault}"
    );
}
