//! Set-points of the tip: the reference follows them without a jump and ends at rest; a refused set-point has no effect.

use crate::support::configs::{four, unlimited};
use crate::support::plant::Plant;
use crate::support::rig::{Rig, bent};
use supple_core::Output;
use supple_core::controller::{
    MAX_SET_POINT_AHEAD_S, Mode, Refusal, Request, SetPoint, check_motion,
};
use supple_core::math::Vector3;
use supple_core::trajectory::{Line, Trajectory};

/// An arm whose tip is held by the impedance law.
fn held() -> (Rig<4>, Plant<4>) {
    let mut config = four();
    unlimited(&mut config);
    let mut rig = Rig::holding(config, bent());
    let mut plant = Plant::at_rest(config.arm, bent());
    let hold = rig.hold_tip_request();
    rig.drive(&mut plant, Some(hold), crate::support::plant::nothing);
    (rig, plant)
}

/// A point beside the tip, at rest.
fn beside(rig: &Rig<4>, by_m: [f64; 3], ahead: u64) -> SetPoint {
    SetPoint {
        position_m: rig.tip() + Vector3::from(by_m),
        velocity_m_per_s: Vector3::zeros(),
        acceleration_m_per_s2: Vector3::zeros(),
        at_cycle: rig.cycle + ahead,
    }
}

fn drive(rig: &mut Rig<4>, plant: &mut Plant<4>, request: Option<Request<4>>) -> Output<4> {
    let output = rig.drive(plant, request, crate::support::plant::nothing);
    assert_eq!((output.refusal, output.fault), (None, None));
    output
}

#[test]
fn a_stream_of_set_points_on_a_line_follows_the_line() {
    let (mut rig, mut plant) = held();
    let (mut other, mut other_plant) = (rig.clone(), plant.clone());
    let from_m = rig.tip();
    let line = Trajectory::Line(Line {
        from_m,
        to_m: from_m + Vector3::new(0.0, 0.05, -0.03),
        duration_s: 1.0,
    });
    drive(&mut other, &mut other_plant, Some(Request::Track(line)));
    let start = rig.cycle;
    let mut worst_m = 0.0_f64;
    drive(&mut rig, &mut plant, None);
    for k in 1..1300_u64 {
        // Every 10 cycles, each with its time, 30 cycles ahead.
        let request = k.is_multiple_of(10).then(|| {
            let at_cycle = rig.cycle + 30;
            let there = line.at((at_cycle - start) as f64 * 1e-3);
            Request::SetPoint(SetPoint {
                position_m: there.position,
                velocity_m_per_s: there.velocity,
                acceleration_m_per_s2: there.acceleration,
                at_cycle,
            })
        });
        let streamed = drive(&mut rig, &mut plant, request);
        let inside = drive(&mut other, &mut other_plant, None);
        worst_m = worst_m.max((streamed.tip_position_m - inside.tip_position_m).norm());
        assert_eq!(streamed.mode, Mode::Track);
    }
    assert!(worst_m < 1e-4, "{worst_m} m");
    let end = rig.tip() - line.at(2.0).position;
    assert!(end.norm() < 2e-3, "{} m", end.norm());
}

#[test]
fn the_reference_never_jumps_and_rests_after_the_last_set_point() {
    let (mut rig, mut plant) = held();
    let mut last = drive(&mut rig, &mut plant, None);
    let mut next = beside(&rig, [0.01, 0.0, 0.0], 40);
    for k in 0..2000_u64 {
        // Set-points at irregular times, to both sides, with a final speed; the last set-point comes after a second.
        let request = [3, 17, 18, 19, 250, 251, 600, 990].contains(&k).then(|| {
            let side = if k.is_multiple_of(2) { 1.0 } else { -1.0 };
            next = beside(&rig, [0.0, 0.01 * side, 0.0], 300 + k / 10);
            next.velocity_m_per_s.y = 0.08 * side;
            Request::SetPoint(next)
        });
        let output = drive(&mut rig, &mut plant, request);
        let (before, now) = (last.reference.expect("one"), output.reference.expect("one"));
        let limits = &rig.controller.config().limits;
        assert!((now.position - before.position).norm() <= limits.tip_speed_m_per_s * 1e-3);
        let jump = (now.velocity - before.velocity).norm();
        assert!(
            jump <= limits.tip_acceleration_m_per_s2 * 1.1e-3,
            "cycle {k}: {jump}"
        );
        last = output;
    }
    let end = last.reference.expect("still held");
    assert_eq!(end.velocity.norm() + end.acceleration.norm(), 0.0);
    // The reference continued beyond the last set-point, by less than its speed times the time of the stop.
    let behind = (end.position - next.position_m).norm();
    assert!(behind > 0.0 && behind < 0.08 * 0.2, "{behind} m");
    assert_eq!(last.mode, Mode::Track);
}

#[test]
fn a_refused_set_point_has_a_reason_and_no_effect() {
    let (mut rig, mut plant) = held();
    drive(&mut rig, &mut plant, None);
    let good = Request::SetPoint(beside(&rig, [0.01, 0.0, 0.0], 100));
    drive(&mut rig, &mut plant, Some(good));
    let far = (MAX_SET_POINT_AHEAD_S / 1e-3) as u64 + 1;
    let refuse = |set_point: SetPoint, part: &str| {
        let (mut other, mut same) = (rig.clone(), rig.clone());
        let output = other.request(Request::SetPoint(set_point));
        let refusal = output
            .refusal
            .unwrap_or_else(|| panic!("{set_point:?} is accepted"));
        assert!(refusal.to_string().contains(part), "{refusal}");
        let without = Output {
            refusal: None,
            ..output
        };
        assert_eq!(without, same.cycle(), "{part}");
        assert_eq!(other.cycles(300), same.cycles(300), "{part}");
    };
    refuse(beside(&rig, [0.0; 3], 0), "too late");
    refuse(beside(&rig, [0.0; 3], far), "time to the set-point");
    refuse(beside(&rig, [0.2, 0.0, 0.0], 50), "speed");
    refuse(beside(&rig, [0.02, 0.0, 0.0], 30), "acceleration");
    refuse(beside(&rig, [f64::NAN, 0.0, 0.0], 30), "position_m");
    let mut fast = beside(&rig, [0.0; 3], 200);
    fast.velocity_m_per_s.x = 5.0;
    refuse(fast, "speed");
    let mut infinite = beside(&rig, [0.0; 3], 200);
    infinite.acceleration_m_per_s2.z = f64::INFINITY;
    refuse(infinite, "acceleration_m_per_s2");
}

#[test]
fn pending_set_points_do_not_resume_an_ended_motion() {
    for end in [Request::GravityHold, Request::Idle, Request::Float] {
        let (mut rig, mut plant) = held();
        let point = Request::SetPoint(beside(&rig, [0.01, 0.0, 0.0], 100));
        drive(&mut rig, &mut plant, Some(point));
        let ended = drive(&mut rig, &mut plant, Some(end));
        let output = rig.request(Request::SetPoint(beside(&rig, [0.02, 0.0, 0.0], 100)));
        assert_eq!(output.refusal, Some(Refusal::Mode { mode: ended.mode }));
        assert_eq!(output.mode, ended.mode);
    }
}

#[test]
fn the_check_before_the_control_loop_rejects_points_out_of_reach() {
    let (rig, _) = held();
    let check = |set_point| check_motion(&rig.controller, &rig.q, &Request::SetPoint(set_point));
    assert_eq!(check(beside(&rig, [0.02, 0.0, 0.0], 30)), Ok(()));
    let refusal = check(beside(&rig, [0.0, 0.0, 5.0], 30)).expect_err("out of reach");
    assert!(matches!(refusal, Refusal::OutOfReach { .. }), "{refusal}");
}
