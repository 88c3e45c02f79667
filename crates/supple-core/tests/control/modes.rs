//! Every mode asked for everything: the table of transitions.

use crate::support::configs::{four, seven, three};
use crate::support::rig::{Rig, bent, probe_at, ramp};
use std::collections::BTreeSet;
use supple_core::config::Gains;
use supple_core::controller::{Fault, Mode, Refusal, Request};
use supple_core::trajectory::Fourier;
use supple_core::{Config, Input};

const MODES: [Mode; 8] = [
    Mode::Idle,
    Mode::GravityHold,
    Mode::Move,
    Mode::Track,
    Mode::Probe,
    Mode::Fault,
    Mode::Excite,
    Mode::Breakaway,
];

/// What is asked for, before it is known where the arm is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Wish {
    Idle,
    GravityHold,
    Move,
    Track,
    Probe,
    Excite,
    Breakaway,
    Gains,
    Reset,
}

const WISHES: [Wish; 9] = [
    Wish::Idle,
    Wish::GravityHold,
    Wish::Move,
    Wish::Track,
    Wish::Probe,
    Wish::Excite,
    Wish::Breakaway,
    Wish::Gains,
    Wish::Reset,
];

fn request<const N: usize>(rig: &Rig<N>, wish: Wish) -> Request<N> {
    match wish {
        Wish::Idle => Request::Idle,
        Wish::GravityHold => Request::GravityHold,
        Wish::Move => Request::Move {
            target_rad: rig.q,
            duration_s: 1.0,
        },
        Wish::Track => rig.stay(),
        Wish::Probe => Request::Track(probe_at(&rig.tip())),
        Wish::Excite => Request::Excite(Fourier::at_rest(rig.q, 1.0)),
        Wish::Breakaway => Request::Breakaway(ramp()),
        Wish::Gains => Request::Gains {
            gains: Gains::isotropic(10.0, 2.0),
            ramp_s: 0.1,
        },
        Wish::Reset => Request::Reset,
    }
}

/// Mode after `wish` in `mode`; `None` where it is refused.
fn table(mode: Mode, wish: Wish) -> Option<Mode> {
    match (mode, wish) {
        (_, Wish::Gains) => Some(mode),
        // A fault is left by a reset alone; this one leaves for gravity hold.
        (Mode::Fault, Wish::Reset) => Some(Mode::GravityHold),
        // Letting go of the arm needs no reset; the fault stays.
        (Mode::Fault, Wish::Idle) => Some(Mode::Fault),
        (Mode::Fault, _) | (_, Wish::Reset) => None,
        (_, Wish::Idle) => Some(Mode::Idle),
        (_, Wish::GravityHold) => Some(Mode::GravityHold),
        (Mode::Idle, _) => None,
        (_, Wish::Move) => Some(Mode::Move),
        (_, Wish::Track) => Some(Mode::Track),
        (_, Wish::Probe) => Some(Mode::Probe),
        (_, Wish::Excite) => Some(Mode::Excite),
        (_, Wish::Breakaway) => Some(Mode::Breakaway),
    }
}

fn every_mode_asked_for_everything<const N: usize>(config: Config<N>) {
    for mode in MODES {
        let mut there = Rig::new(config, bent());
        there.bring_to(mode);
        for wish in WISHES {
            let mut rig = there.clone();
            let before = rig.state.fault();
            let output = rig.ask(request(&rig, wish));
            match table(mode, wish) {
                Some(expected) => {
                    assert_eq!(output.refusal, None, "{wish:?} in {mode:?}");
                    assert_eq!(output.mode, expected, "{wish:?} in {mode:?}");
                    if wish != Wish::Gains {
                        assert_eq!(output.mode_time_s, 0.0, "{wish:?} in {mode:?}");
                    }
                }
                None => {
                    let refused = Some(Refusal::Mode { mode });
                    assert_eq!(output.refusal, refused, "{wish:?} in {mode:?}");
                    assert_eq!(output.mode, mode, "{wish:?} in {mode:?}");
                    assert_eq!(output.fault, before, "{wish:?} in {mode:?}");
                }
            }
            // It stays there on its own.
            let later = rig.cycles(50);
            assert_eq!(later.mode, output.mode, "{wish:?} in {mode:?}");
            assert_eq!(later.fault, output.fault, "{wish:?} in {mode:?}");
        }
    }
}

#[test]
fn of_3_joints() {
    every_mode_asked_for_everything(three());
}

#[test]
fn of_4_joints() {
    every_mode_asked_for_everything(four());
}

#[test]
fn of_7_joints() {
    every_mode_asked_for_everything(seven());
}

#[test]
fn any_mode_faults_and_idle_stays_limp() {
    for mode in MODES {
        let mut rig = Rig::new(four(), bent());
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
        let reset = rig.ask(Request::Reset);
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
fn an_operator_can_let_go_in_a_fault() {
    let mut rig = Rig::new(four(), bent());
    rig.bring_to(Mode::Fault);
    let fault = rig.state.fault();
    rig.ask(Request::Idle);
    let output = rig.rest();
    assert_eq!((output.mode, output.fault), (Mode::Fault, fault));
    assert_eq!(output.torque_nm.norm(), 0.0);
    assert_eq!(output.fallback_torque_nm.norm(), 0.0);
    assert_eq!(rig.ask(Request::Reset).mode, Mode::Idle);
}

#[test]
fn a_probing_cycle_is_probe_and_any_other_trajectory_is_track() {
    let mut rig = Rig::holding(four(), bent());
    let output = rig.accept(Request::Track(probe_at(&rig.tip())));
    assert_eq!(output.mode, Mode::Probe);
    let output = rig.accept(rig.stay());
    assert_eq!(output.mode, Mode::Track);
}

#[test]
fn time_in_a_mode_is_counted_from_its_entry() {
    let mut rig = Rig::holding(four(), bent());
    let mut output = rig.accept(rig.stay());
    for k in 0..100 {
        let expected = f64::from(k) * 1e-3;
        assert!((output.mode_time_s - expected).abs() < 1e-12);
        output = rig.cycle();
    }
    // The same request again starts the trajectory again.
    assert_eq!(rig.accept(rig.stay()).mode_time_s, 0.0);
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
