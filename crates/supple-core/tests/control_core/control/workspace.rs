//! Borders and zones of the tip: forces that push the tip back, faults that end the motion, and refused paths.

use crate::support::configs::four;
use crate::support::plant::{Plant, push};
use crate::support::property::{check, vector3};
use crate::support::rig::{Rig, bent};
use proptest::prelude::*;
use supple_core::config::{Border, Collision, Config, Gains, Workspace, Zone};
use supple_core::controller::{Fault, Mode, Refusal, Request};
use supple_core::math::Vector3;
use supple_core::trajectory::{Line, Trajectory};
use supple_core::workspace::MAX_BORDERS_OR_ZONES;

fn tip() -> Vector3<f64> {
    Rig::new(four(), bent()).tip()
}

/// A workspace with this border, which pushes with 400 N/m and 20 N s/m over 50 mm.
pub(super) fn bordered(border: Border) -> Workspace {
    let mut borders = [None; MAX_BORDERS_OR_ZONES];
    borders[0] = Some(border);
    Workspace {
        borders,
        margin_m: 0.05,
        stiffness_n_per_m: 400.0,
        damping_n_s_per_m: 20.0,
        ..Workspace::UNBOUNDED
    }
}

/// A zone around the tip.
fn zoned(tip_speed_m_per_s: f64, tip_force_n: f64) -> Workspace {
    let mut zones = [None; MAX_BORDERS_OR_ZONES];
    zones[0] = Some(Zone {
        lower_m: tip() - Vector3::repeat(0.5),
        upper_m: tip() + Vector3::repeat(0.5),
        tip_speed_m_per_s,
        tip_force_n,
    });
    Workspace {
        zones,
        ..Workspace::UNBOUNDED
    }
}

/// The arm with this workspace and no other effective limits.
fn only(workspace: Workspace) -> Config<4> {
    let mut config = four();
    config.collision = Collision::disabled();
    config.plausible.load_n = f64::MAX;
    config.workspace = workspace;
    config
}

/// A box that the tip must not enter, at the distance `gap_m` from the tip along an axis.
fn box_before(gap_m: f64, axis: usize, sign: f64) -> Border {
    let mut towards = Vector3::zeros();
    towards[axis] = sign;
    let centre = tip() + towards * (gap_m + 0.1);
    Border::KeepOut {
        lower_m: centre - Vector3::repeat(0.1),
        upper_m: centre + Vector3::repeat(0.1),
    }
}

/// The force of a border's margin is the force of a spring, and of a damper against motion towards the border, along the normal;
/// outside of the margin it is zero. The distance to a box is measured along the axis on which the point is furthest.
#[test]
fn the_margin_is_a_spring_and_a_damper_towards_the_border() {
    type Case = ([Vector3<f64>; 3], f64);
    let cases = ([vector3(0.5), vector3(2.0), vector3(0.3)], 0.05..0.3);
    check(2000, cases, |([point, velocity, centre], size): Case| {
        let (lower_m, upper_m) = (centre.add_scalar(-size), centre.add_scalar(size));
        let workspace = bordered(Border::KeepOut { lower_m, upper_m });
        let gaps = (point - centre).abs().add_scalar(-size);
        let axis = gaps.imax();
        let away = (point[axis] - centre[axis]).signum();
        let depth_m = (0.05 - gaps[axis]).clamp(0.0, 0.05);
        let closing = (-velocity[axis] * away).max(0.0);
        let mut expected = Vector3::zeros();
        expected[axis] = away * (400.0 * depth_m + 20.0 * depth_m / 0.05 * closing);
        let found = workspace.soft_force(&point, &velocity, &[0.0; MAX_BORDERS_OR_ZONES]);
        prop_assert!((found - expected).norm() < 1e-9, "{found} {expected}");
        prop_assert_eq!(
            workspace.violated_border(&point).is_some(),
            gaps[axis] < 0.0
        );
        Ok(())
    });
}

/// A stiffness of 400 N/m holds a push of 12 N within the margin of 50 mm; a push of 30 N moves the tip beyond it, and the fault
/// names the border.
#[test]
fn a_box_repels_the_tip_and_a_tip_inside_it_is_a_fault() {
    for (axis, sign) in [(2, -1.0), (2, 1.0), (0, 1.0)] {
        let config = only(bordered(box_before(0.08, axis, sign)));
        let mut force_n = Vector3::zeros();
        let mut rig = Rig::holding(config, bent());
        let mut plant = Plant::at_rest(config.arm, bent());
        force_n[axis] = 12.0 * sign;
        for _ in 0..4000 {
            let output = rig.drive(&mut plant, None, |arm, q, _| push(arm, q, &force_n));
            assert_eq!(output.fault, None, "axis {axis}");
        }
        let moved_m = (rig.tip() - tip())[axis] * sign;
        assert!((0.03..0.08).contains(&moved_m), "{moved_m} m");
        force_n[axis] = 30.0 * sign;
        let fault = (0..4000).find_map(|_| {
            let output = rig.drive(&mut plant, None, |arm, q, _| push(arm, q, &force_n));
            output.fault
        });
        assert!(
            matches!(fault, Some(Fault::Workspace { border: 0, value_m }) if value_m < 0.01),
            "{fault:?}"
        );
    }
}

/// A tip that is beyond a border when the arm is switched on may be moved back, not further.
#[test]
fn a_tip_beyond_a_border_may_move_back() {
    let mut workspace = bordered(box_before(-0.02, 2, -1.0));
    workspace.stiffness_n_per_m = 0.0;
    workspace.damping_n_s_per_m = 0.0;
    let moved_by = |step_rad: f64| {
        let mut rig = Rig::holding(only(workspace), bent());
        let before = rig.tip();
        let fault = (0..200).find_map(|_| {
            rig.q[1] += step_rad;
            rig.cycle().fault
        });
        (fault, (rig.tip() - before).z)
    };
    let (back, further) = (moved_by(-1e-4), moved_by(1e-4));
    let (back, further) = match back.1 > 0.0 {
        true => (back, further),
        false => (further, back),
    };
    assert_eq!(back.0, None);
    assert!(
        matches!(further.0, Some(Fault::Workspace { .. })),
        "{further:?}"
    );
}

/// In a zone the spring force of the law is at most the zone's limit, and a larger external force on the tip ends the motion.
#[test]
fn a_zone_bounds_the_force() {
    let config = only(zoned(f64::MAX, 8.0));
    let mut rig = Rig::holding(config, bent());
    rig.accept(Request::Gains {
        gains: Gains::isotropic(500.0, 20.0),
        ramp_s: 0.0,
    });
    let from_m = rig.tip();
    rig.accept(Request::Track(Trajectory::Line(Line {
        from_m,
        to_m: from_m + Vector3::new(0.0, 0.0, 0.05),
        duration_s: 1.0,
    })));
    // The arm is held still: the spring would pull with 25 N, the zone allows 8.
    let mut pull_n = 0.0_f64;
    for _ in 0..1000 {
        let output = rig.cycle();
        if output.mode != Mode::Track {
            break;
        }
        let jacobian = supple_core::dynamics::jacobian(&config.arm, &rig.q);
        let force = jacobian
            .fixed_rows::<3>(0)
            .transpose()
            .svd(true, true)
            .solve(&output.torques.stiffness, 1e-9)
            .expect("regular");
        pull_n = pull_n.max(force.norm());
    }
    assert!((6.0..8.0 + 1e-6).contains(&pull_n), "{pull_n} N");

    let pushed = |push_n: f64| {
        let mut rig = Rig::holding(config, bent());
        rig.accept(Request::Float);
        let mut plant = Plant::at_rest(config.arm, bent());
        let force_n = Vector3::new(0.0, push_n, 0.0);
        (0..200).find_map(|_| {
            let output = rig.drive(&mut plant, None, |arm, q, _| push(arm, q, &force_n));
            output.fault
        })
    };
    assert_eq!(pushed(6.0), None);
    let fault = pushed(12.0);
    assert!(
        matches!(fault, Some(Fault::ZoneForce { value_n, limit_n }) if limit_n == 8.0 && value_n < 12.5),
        "{fault:?}"
    );
}

/// A tip faster than four fifths of its zone's limit is slowed; a tip faster than the limit is a fault.
#[test]
fn a_zone_bounds_the_speed() {
    let workspace = Workspace {
        damping_n_s_per_m: 20.0,
        ..zoned(0.1, f64::MAX)
    };
    let along = |speed: f64| Vector3::new(0.0, speed, 0.0);
    assert_eq!(
        workspace
            .soft_force(&tip(), &along(0.079), &[0.0; MAX_BORDERS_OR_ZONES])
            .norm(),
        0.0
    );
    let slowed = workspace.soft_force(&tip(), &along(0.09), &[0.0; MAX_BORDERS_OR_ZONES]);
    assert!((slowed - along(-20.0 * 0.01)).norm() < 1e-12, "{slowed}");
    let outside = tip() + Vector3::repeat(0.6);
    assert_eq!(
        workspace
            .soft_force(&outside, &along(0.09), &[0.0; MAX_BORDERS_OR_ZONES])
            .norm(),
        0.0
    );

    let mut rig = Rig::holding(only(workspace), bent());
    let fault = (0..400).find_map(|_| {
        rig.q[0] += 3e-4;
        rig.cycle().fault
    });
    assert!(
        matches!(fault, Some(Fault::ZoneSpeed { limit_m_per_s, .. }) if limit_m_per_s == 0.1),
        "{fault:?}"
    );
}

/// A path into a box is refused with the box's border; a path beside the box is accepted.
#[test]
fn a_path_into_a_box_is_refused() {
    let rig = Rig::holding(only(bordered(box_before(0.08, 2, -1.0))), bent());
    let line = |to_m: Vector3<f64>| {
        let line = Line {
            from_m: tip(),
            to_m,
            duration_s: 4.0,
        };
        let request = Request::Track(Trajectory::Line(line));
        supple_core::controller::check_motion(&rig.controller, &rig.q, &request)
    };
    let down = line(tip() - Vector3::new(0.0, 0.0, 0.1));
    assert!(
        matches!(down, Err(Refusal::Workspace { border: 0, .. })),
        "{down:?}"
    );
    assert_eq!(line(tip() - Vector3::new(0.0, 0.0, 0.07)), Ok(()));
}
