//! Draws a random case from a seed: task, fault and time.

use super::arm::{Arm, between, pick};
use super::tasks::{self, Task};
use supple_core::Vector;
use supple_core::controller::Request;
use supple_plant::{Injection, InjectionKind, PlantConfig, Trigger};
use supple_random::Random;

/// Fraction of the cases in which the simulated arm has the effects of a real arm, here and in the following constants: another
/// request follows, and a second fault occurs.
const REALISTIC_SHARE: f64 = 0.3;
const HANDOVER_SHARE: f64 = 0.25;
const SECOND_SHARE: f64 = 0.1;
/// Time of the task's request, and range of the time of the fault, from active drives \[s\].
const TASK_S: f64 = 0.5;
const FAULT_S: (f64, f64) = (0.6, 3.0);
/// Range of the time for which the drives stay idle \[s\].
const IDLE_S: (f64, f64) = (0.03, 1.0);
/// Time for which the arm is observed after the fault \[s\].
const OBSERVED_S: f64 = 2.0;

/// A random case.
pub(super) struct Case<const N: usize> {
    pub(super) task: Task,
    /// Name of the request that replaces the request of the task, if any.
    pub(super) handover: Option<&'static str>,
    pub(super) realistic: bool,
    pub(super) plant: PlantConfig<N>,
    pub(super) start_rad: Vector<N>,
    /// Requests, with their times from the first cycle \[s\].
    pub(super) requests: Vec<(f64, Request<N>)>,
    pub(super) injections: Vec<Injection>,
    pub(super) duration_s: f64,
}

/// Draws the case of a seed; `None` if the arm cannot perform the drawn task.
pub(super) fn case<const N: usize>(arm: &Arm<N>, seed: u64) -> Option<Case<N>> {
    let random = &mut Random::new(seed);
    let realistic = random.uniform() < REALISTIC_SHARE;
    let plan = tasks::draw(arm, random)?;
    let mut requests = vec![(0.0, Request::GravityHold)];
    requests.extend(
        plan.requests
            .into_iter()
            .map(|(at_s, request)| (TASK_S + at_s, request)),
    );
    let mut fault_s = between(random, FAULT_S.0, FAULT_S.1);
    let mut handover = None;
    if random.uniform() < HANDOVER_SHARE {
        let at_s = between(random, FAULT_S.0, FAULT_S.1);
        let (name, request) = match random.index(4) {
            0 => ("gravity_hold", Request::GravityHold),
            1 => ("float", Request::Float),
            2 => ("idle", Request::Idle),
            _ => {
                let target_rad = plan.start_rad;
                let duration_s = 4.0;
                let request = Request::JointImpedance {
                    target_rad,
                    duration_s,
                };
                ("joint_impedance", request)
            }
        };
        handover = Some(name);
        requests.retain(|(time_s, _)| *time_s < at_s);
        requests.push((at_s, request));
        if name == "idle" {
            let held_s = at_s + between(random, IDLE_S.0, IDLE_S.1);
            requests.push((held_s, Request::GravityHold));
        }
        // The fault is mostly soon after the request, during the handover of the torque.
        if random.uniform() < 0.7 {
            fault_s = at_s + between(random, -0.02, 0.25);
        }
    }
    let fault_s = rounded(fault_s, 1e-3);
    let trigger = Trigger::Active { at_s: fault_s };
    let mut injections = vec![Injection {
        kind: fault(arm, random),
        trigger,
    }];
    if random.uniform() < SECOND_SHARE {
        let at_s = rounded(fault_s + between(random, 0.0, 0.3), 1e-3);
        injections.push(Injection {
            kind: fault(arm, random),
            trigger: Trigger::Active { at_s },
        });
    }
    let mut plant = match realistic {
        true => arm.realistic.clone(),
        false => arm.ideal.clone(),
    };
    plant.seed = seed;
    Some(Case {
        task: plan.task,
        handover,
        realistic,
        plant,
        start_rad: plan.start_rad,
        requests,
        injections,
        duration_s: fault_s + OBSERVED_S,
    })
}

/// Draws a fault of an encoder, a motor, the bus or the load.
fn fault<const N: usize>(arm: &Arm<N>, random: &mut Random) -> InjectionKind {
    use InjectionKind as Kind;
    let index = random.index(N);
    loop {
        // In a fifth of the draws, the fault affects all joints.
        let joint = random.index(N);
        let one = arm.has_own_motor(joint).then_some(joint);
        let (joint, of_some) = match random.uniform() < 0.2 {
            true => (None, true),
            false => (one, one.is_some()),
        };
        let kind = match random.index(12) {
            0 | 1 => Kind::MotorEncoderStuck { motor: index },
            2 if of_some => Kind::EncoderStuck { joint },
            3 if of_some => Kind::EncoderLate {
                joint,
                cycles: *pick(random, &[2, 5, 10, 20, 50, 100]),
            },
            4 if of_some => Kind::EncoderSign { joint },
            5 if of_some => Kind::EncoderOffset {
                joint,
                offset_rad: rounded(
                    signed(random, 1.0) * *pick(random, &[0.003, 0.01, 0.02, 0.2]),
                    1e-4,
                ),
            },
            6 => Kind::ReplyLost {
                joint,
                every: *pick(random, &[2, 5, 8, 9, 10, 20]),
            },
            7 => Kind::MotorDead { motor: index },
            8 => Kind::TorqueSign { joint: index },
            9 => Kind::GravityReversed,
            10 => Kind::TorqueLate {
                cycles: *pick(random, &[2, 5, 10, 20, 50]),
            },
            11 => match random.uniform() < 0.5 {
                true => Kind::Payload {
                    mass_kg: rounded(between(random, 0.3, 3.0), 0.01),
                },
                false => Kind::Bump {
                    joint: index,
                    speed_rad_per_s: rounded(signed(random, 3.0), 0.01),
                },
            },
            _ => continue,
        };
        return kind;
    }
}

/// Draws a number between a tenth of `most` and `most`, with either sign.
fn signed(random: &mut Random, most: f64) -> f64 {
    let size = between(random, 0.1 * most, most);
    size * random.signed().signum()
}

/// Rounds to the nearest multiple of `1 / round(1 / step)`, so that the printed number is short.
fn rounded(value: f64, step: f64) -> f64 {
    let per_step = (1.0 / step).round();
    (value * per_step).round() / per_step
}
