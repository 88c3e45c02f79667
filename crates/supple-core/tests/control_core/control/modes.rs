//! Every request in every mode: the table of transitions.

use crate::support::configs::{four, seven, seven_active, three};
use crate::support::rig::{Rig, bent, bent_wrist, probe_at, ramp};
use std::collections::BTreeSet;
use supple_core::config::{Gains, JointGains, Role, RotationalGains};
use supple_core::controller::{Fault, LearningSwitch, Mode, Refusal, Request, SetPoint};
use supple_core::math::Vector3;
use supple_core::trajectory::Fourier;
use supple_core::{Config, Input, Vector};

const MODES: [Mode; 11] = [
    Mode::Idle,
    Mode::GravityHold,
    Mode::Move,
    Mode::Track,
    Mode::Probe,
    Mode::Fault,
    Mode::Excite,
    Mode::Breakaway,
    Mode::Float,
    Mode::JointImpedance,
    Mode::TrackPose,
];

/// Kind of a request, independent of the arm's pose.
#[derive(Clone, Copy, Debug, PartialEq)]
enum RequestKind {
    Idle,
    GravityHold,
    Move,
    Track,
    Probe,
    Excite,
    Breakaway,
    Float,
    JointImpedance,
    TrackPose,
    Gains,
    JointGains,
    RotationalGains,
    Learning,
    SetPoint,
    Reset,
}

const REQUEST_KINDS: [RequestKind; 16] = [
    RequestKind::Idle,
    RequestKind::GravityHold,
    RequestKind::Move,
    RequestKind::Track,
    RequestKind::Probe,
    RequestKind::Excite,
    RequestKind::Breakaway,
    RequestKind::Float,
    RequestKind::JointImpedance,
    RequestKind::TrackPose,
    RequestKind::Gains,
    RequestKind::JointGains,
    RequestKind::RotationalGains,
    RequestKind::Learning,
    RequestKind::SetPoint,
    RequestKind::Reset,
];

fn request<const N: usize>(rig: &Rig<N>, requested: RequestKind) -> Request<N> {
    match requested {
        RequestKind::Idle => Request::Idle,
        RequestKind::GravityHold => Request::GravityHold,
        RequestKind::Move => Request::Move {
            target_rad: rig.q,
            duration_s: 1.0,
        },
        RequestKind::Track => rig.hold_tip_request(),
        RequestKind::Probe => Request::Track(probe_at(&rig.tip())),
        RequestKind::Excite => Request::Excite(Fourier::at_rest(rig.q, 1.0)),
        RequestKind::Breakaway => Request::Breakaway(ramp()),
        RequestKind::Float => Request::Float,
        RequestKind::JointImpedance => rig.joint_impedance_request(),
        RequestKind::TrackPose => rig.turn(0.2),
        RequestKind::RotationalGains => Request::RotationalGains {
            gains: RotationalGains::isotropic(0.8, 0.015),
            ramp_s: 0.1,
        },
        RequestKind::JointGains => Request::JointGains {
            gains: JointGains {
                stiffness_nm_per_rad: Vector::repeat(7.0),
                damping_nm_s_per_rad: Vector::repeat(0.02),
            },
            ramp_s: 0.1,
        },
        RequestKind::Gains => Request::Gains {
            gains: Gains::isotropic(10.0, 2.0),
            ramp_s: 0.1,
        },
        RequestKind::Learning => Request::Learning(LearningSwitch::On),
        RequestKind::SetPoint => Request::SetPoint(SetPoint {
            position_m: rig.tip(),
            velocity_m_per_s: Vector3::zeros(),
            acceleration_m_per_s2: Vector3::zeros(),
            at_cycle: rig.cycle + 20,
        }),
        RequestKind::Reset => Request::Reset,
    }
}

/// Requests that are executed in every mode.
fn keeps_mode(requested: RequestKind) -> bool {
    matches!(
        requested,
        RequestKind::Gains
            | RequestKind::JointGains
            | RequestKind::RotationalGains
            | RequestKind::Learning
    )
}

/// Mode after `requested` in `mode`; `None` if refused.
fn table(mode: Mode, requested: RequestKind) -> Option<Mode> {
    match (mode, requested) {
        (_, requested) if keeps_mode(requested) => Some(mode),
        // Set-points move a held tip; they begin no motion in any other mode.
        (Mode::Track, RequestKind::SetPoint) => Some(Mode::Track),
        (_, RequestKind::SetPoint) => None,
        // Only a reset leaves a fault; this one leads to gravity hold.
        (Mode::Fault, RequestKind::Reset) => Some(Mode::GravityHold),
        // Idle needs no reset; the fault stays latched.
        (Mode::Fault, RequestKind::Idle) => Some(Mode::Fault),
        (Mode::Fault, _) | (_, RequestKind::Reset) => None,
        (_, RequestKind::Idle) => Some(Mode::Idle),
        (_, RequestKind::GravityHold) => Some(Mode::GravityHold),
        (Mode::Idle, _) => None,
        (_, RequestKind::Move) => Some(Mode::Move),
        (_, RequestKind::Track) => Some(Mode::Track),
        (_, RequestKind::Probe) => Some(Mode::Probe),
        (_, RequestKind::Excite) => Some(Mode::Excite),
        (_, RequestKind::Breakaway) => Some(Mode::Breakaway),
        (_, RequestKind::Float) => Some(Mode::Float),
        (_, RequestKind::JointImpedance) => Some(Mode::JointImpedance),
        (_, RequestKind::TrackPose) => Some(Mode::TrackPose),
        (_, requested) => panic!("{requested:?} keeps the mode"),
    }
}

fn every_mode_asked_for_everything<const N: usize>(config: Config<N>, pose: Vector<N>) {
    let active = config.roles.iter().filter(|role| **role == Role::Active);
    let has_pose = active.count() >= 6;
    for mode in MODES {
        if mode == Mode::TrackPose && !has_pose {
            continue;
        }
        let mut there = Rig::new(config, pose);
        there.bring_to(mode);
        for requested in REQUEST_KINDS {
            let mut rig = there.clone();
            let before = rig.state.fault();
            let output = rig.request(request(&rig, requested));
            if requested == RequestKind::TrackPose && !has_pose && table(mode, requested).is_some()
            {
                match output.refusal {
                    Some(Refusal::Value { limit, .. }) => assert_eq!(limit, 6.0),
                    other => panic!("{other:?}"),
                }
                assert_eq!(output.mode, mode);
                continue;
            }
            match table(mode, requested) {
                Some(expected) => {
                    assert_eq!(output.refusal, None, "{requested:?} in {mode:?}");
                    assert_eq!(output.mode, expected, "{requested:?} in {mode:?}");
                    if !keeps_mode(requested) && requested != RequestKind::SetPoint {
                        assert_eq!(output.mode_time_s, 0.0, "{requested:?} in {mode:?}");
                    }
                }
                None => {
                    let refused = Some(Refusal::Mode { mode });
                    assert_eq!(output.refusal, refused, "{requested:?} in {mode:?}");
                    assert_eq!(output.mode, mode, "{requested:?} in {mode:?}");
                    assert_eq!(output.fault, before, "{requested:?} in {mode:?}");
                }
            }
            // The mode does not change without a request.
            let later = rig.cycles(50);
            assert_eq!(later.mode, output.mode, "{requested:?} in {mode:?}");
            assert_eq!(later.fault, output.fault, "{requested:?} in {mode:?}");
        }
    }
}

#[test]
fn of_3_joints() {
    every_mode_asked_for_everything(three(), bent());
}

#[test]
fn of_4_joints() {
    every_mode_asked_for_everything(four(), bent());
}

#[test]
fn of_7_joints() {
    every_mode_asked_for_everything(seven(), bent());
}

#[test]
fn of_7_active_joints() {
    every_mode_asked_for_everything(seven_active(), bent_wrist());
}

#[test]
fn any_mode_faults_and_idle_stays_without_torque() {
    for mode in MODES {
        let mut rig = Rig::new(seven_active(), bent_wrist());
        rig.bring_to(mode);
        let first = rig.state.fault();
        let output = rig.step(&Input {
            cycle: 0,
            ..rig.input()
        });
        assert_eq!(output.mode, Mode::Fault, "from {mode:?}");
        if first.is_none() {
            let fault = output.fault.expect("a fault");
            assert!(matches!(fault, Fault::StateOutOfOrder { .. }), "{fault}");
        } else {
            assert_eq!(output.fault, first);
        }
        let later = rig.rest();
        if mode == Mode::Idle {
            assert_eq!(later.torque_nm.norm(), 0.0, "a fault energised the arm");
            assert_eq!(later.fallback_torque_nm.norm(), 0.0);
        } else {
            assert!(
                later.torque_nm.norm() > 1.0,
                "the arm is held after {mode:?}"
            );
        }
        let reset = rig.request(Request::Reset);
        assert_eq!((reset.refusal, reset.fault), (None, None));
        let expected = if mode == Mode::Idle {
            Mode::Idle
        } else {
            Mode::GravityHold
        };
        assert_eq!(reset.mode, expected, "reset after {mode:?}");
    }
}

#[test]
fn idle_can_be_requested_in_a_fault() {
    let mut rig = Rig::new(four(), bent());
    rig.bring_to(Mode::Fault);
    let fault = rig.state.fault();
    rig.request(Request::Idle);
    let output = rig.rest();
    assert_eq!((output.mode, output.fault), (Mode::Fault, fault));
    assert_eq!(output.torque_nm.norm(), 0.0);
    assert_eq!(output.fallback_torque_nm.norm(), 0.0);
    assert_eq!(rig.request(Request::Reset).mode, Mode::Idle);
}

#[test]
fn a_probing_cycle_is_probe_and_any_other_trajectory_is_track() {
    let mut rig = Rig::holding(four(), bent());
    let output = rig.accept(Request::Track(probe_at(&rig.tip())));
    assert_eq!(output.mode, Mode::Probe);
    let output = rig.accept(rig.hold_tip_request());
    assert_eq!(output.mode, Mode::Track);
}

#[test]
fn time_in_a_mode_is_counted_from_its_entry() {
    let mut rig = Rig::holding(four(), bent());
    let mut output = rig.accept(rig.hold_tip_request());
    for k in 0..100 {
        let expected = f64::from(k) * 1e-3;
        assert!((output.mode_time_s - expected).abs() < 1e-12);
        output = rig.cycle();
    }
    // The same request restarts the trajectory.
    assert_eq!(rig.accept(rig.hold_tip_request()).mode_time_s, 0.0);
}

#[test]
fn a_new_state_is_idle_and_has_no_fault() {
    let rig = Rig::new(four(), bent());
    assert_eq!((rig.state.mode(), rig.state.fault()), (Mode::Idle, None));
}

#[test]
fn names_are_distinct() {
    let names: BTreeSet<_> = MODES.iter().map(|mode| mode.name()).collect();
    assert_eq!(names.len(), MODES.len());
}
