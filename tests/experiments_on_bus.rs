//! Tests that compare the paper's experiments through all processes in virtual time (controller, shared memory, bus,
//! pucks, arm) with the same experiments in one process (controller and plant).
//!
//! Differences between the two, which explain the tolerances: on the bus encoders are read and torques applied
//! some 0.7 ms apart, while one process has a whole cycle of delay; counts and torque units are those of the
//! pucks; motors and encoders act on the physics' grid of 0.2 ms instead of 1 ms. In slow free motion these
//! differences cause at most a fraction of a millimetre; the force of an impact of a few milliseconds is sampled
//! once per millisecond.

mod support;

use serde_json::Value;
use std::os::unix::fs::PermissionsExt;
use std::process::Command;
use supple_core::Trajectory;
use supple_core::trajectory::{Probe, ProbePhase};
use supple_experiment::{Plan, Setup, Variant, run, scenario};
use supple_model::Description;
use supple_plant::Scene;
use support::programs;

/// Duration from power-up to tracking in `supple up --plant emu`, and a part of the trajectory \[s\].
const TRACKED_S: &str = "16";
/// Duration up to and including the first stroke down to the block \[s\].
const PROBE_S: &str = "10";
/// Maximum difference between the two RMS errors \[m\].
const MAX_RMS_DIFFERENCE_M: f64 = 3e-4;
/// Maximum difference between the first transients, as a fraction of the one in one process. The bus samples the
/// force only once per millisecond, and the impact speed at 5 N/m depends on the friction state at the start of
/// the stroke: on the bus the arm comes from a move, in one process it starts at rest.
const TRANSIENT_FRACTION: f64 = 0.2;
/// Maximum difference between the forces at rest \[N\]. The same controller leaves the same residual dry
/// friction; a controller with the plant's breakaway torque would have 0.3 N more at rest.
const MAX_REST_DIFFERENCE_N: f64 = 0.05;
/// Window of the first transient \[ms\].
const TRANSIENT_MS: usize = 50;

/// Runs the emulated arm; returns the summary and the vertical forces of the trace, one per millisecond.
fn on_the_bus(arguments: &[&str]) -> (Value, Vec<f64>) {
    let folder = tempfile::tempdir().expect("a folder");
    let owner = std::fs::Permissions::from_mode(0o700);
    std::fs::set_permissions(folder.path(), owner).expect("changed");
    let always = "up --plant emu --virtual-time --no-log --json --trace trace.csv";
    let output = Command::new(programs().join("supple"))
        .args(always.split(' '))
        .args(arguments)
        .current_dir(folder.path())
        .env("XDG_RUNTIME_DIR", folder.path())
        .output()
        .expect("it runs");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{stderr}");
    let summary = serde_json::from_slice(&output.stdout).expect("JSON");
    let trace = std::fs::read_to_string(folder.path().join("trace.csv")).expect("a trace");
    let mut lines = trace
        .lines()
        .map(|line| line.split(',').collect::<Vec<_>>());
    let header = lines.next().expect("a header");
    let column = header.iter().position(|name| *name == "force_z_n");
    let column = column.expect("a column of forces");
    let forces = lines.map(|line| line[column].parse().expect("a number"));
    (summary, forces.collect())
}

/// Runs the same experiment in one process; returns RMS error and vertical forces, one per cycle.
fn in_one_process(trajectory: Trajectory, duration_s: f64, scene: Scene) -> (f64, Vec<f64>) {
    let description = Description::asset("wam4").expect("built in");
    let setup = Setup::<4>::new(&description, 0).expect("valid");
    let plan = Plan {
        name: "beside the bus".to_owned(),
        // Configuration from the description, which does not specify how far breakaway exceeds Coulomb friction.
        config: description.config().expect("valid"),
        plant: setup.plant(&Variant::EXACT, scene),
        trajectory,
        duration_s,
        learning: false,
        gain_change: None,
    };
    let mut forces = Vec::new();
    let run = run(&plan, &mut |cycle, _| {
        forces.push(cycle.truth.contact_force_n.z);
        Ok(())
    });
    let run = run.expect("it runs");
    assert_eq!(run.ended, None);
    (run.rms_error_m, forces)
}

/// Compares the RMS errors of a trajectory on the bus and in one process, over the same part of it.
fn assert_same_tracking_error(trajectory_name: &str, trajectory: Trajectory) {
    let (summary, _) = on_the_bus(&["--track", trajectory_name, "--for", TRACKED_S]);
    let on_bus_m = summary["rms_error_m"].as_f64().expect("it tracked");
    let cycles = summary["tracked_cycles"].as_u64().expect("it tracked");
    assert!(cycles > 6000, "{summary}");
    let (alone_m, _) = in_one_process(trajectory, cycles as f64 * 1e-3, Scene::default());
    println!("RMS error of {trajectory_name}: {on_bus_m} m on the bus, {alone_m} m in one process");
    assert!(
        (on_bus_m - alone_m).abs() < MAX_RMS_DIFFERENCE_M,
        "{on_bus_m} {alone_m}"
    );
}

#[test]
fn the_sinusoid_tracking_error_matches_one_process() {
    let (trajectory, _) = scenario::sinusoid(1.0);
    assert_same_tracking_error("sinusoid", trajectory);
}

#[test]
fn the_arc_tracking_error_matches_one_process() {
    let (trajectory, _) = scenario::arc();
    assert_same_tracking_error("arc", trajectory);
}

#[test]
fn the_quadrant_tracking_error_matches_one_process() {
    let (quadrant, _) = scenario::quadrant(scenario::QUADRANT_SPEED_M_PER_S);
    assert_same_tracking_error("quadrant", Trajectory::Quadrant(quadrant));
}

/// Returns the maximum force of the first transient, and the mean force at rest before the stroke reverses \[N\].
fn contact(forces: &[f64], probe: &Probe) -> (f64, f64) {
    let touch = forces.iter().position(|force| *force > 0.0);
    let touch = touch.expect("contact with the block");
    let transient = &forces[touch..touch + TRANSIENT_MS];
    let peak_n = transient.iter().copied().fold(0.0, f64::max);
    // The cap meets the face 0.06 m into a stroke of 0.1 m: the remaining time, less a margin.
    let stroke_s = probe.stroke_m / probe.speed_m_per_s;
    let remaining = (0.4 * stroke_s * 1e3) as usize;
    let rest = &forces[touch + remaining - 300..touch + remaining];
    (peak_n, rest.iter().sum::<f64>() / rest.len() as f64)
}

#[test]
fn contact_forces_match_those_in_one_process() {
    let (summary, forces) = on_the_bus(&["--track", "probe", "--block-m", "0", "--for", PROBE_S]);
    assert_eq!(summary["faults"], Value::Array(Vec::new()));
    let radius_m = Description::asset("wam4").expect("built in").tool();
    let radius_m = radius_m.expect("a cap").cap_radius_m;
    let (probe, _) = scenario::probe(radius_m);
    assert_eq!(probe.phase_at(0.0).0, ProbePhase::Down);
    let trajectory = Trajectory::Probe(probe);
    let (_, alone) = in_one_process(trajectory, 3.0, Scene::with_block_at(0.0));
    let ((peak_n, rest_n), (alone_peak_n, alone_rest_n)) =
        (contact(&forces, &probe), contact(&alone, &probe));
    println!("first transient: {peak_n} N on the bus, {alone_peak_n} N in one process");
    println!("at rest: {rest_n} N on the bus, {alone_rest_n} N in one process");
    let difference = (peak_n - alone_peak_n).abs();
    assert!(
        difference < TRANSIENT_FRACTION * alone_peak_n,
        "{peak_n} {alone_peak_n}"
    );
    assert!(
        (rest_n - alone_rest_n).abs() < MAX_REST_DIFFERENCE_N,
        "{rest_n} {alone_rest_n}"
    );
}
