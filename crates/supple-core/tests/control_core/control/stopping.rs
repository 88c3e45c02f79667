//! The safe action stops motion: on random arms, in random poses and modes, at any speed, with
//! delayed torques, and with defects of encoders, motors, load or gravity that the model does
//! not contain.
//!
//! Criteria, fixed before the first run: once a fault is latched, the arm either brakes (the drives
//! get no torque) or has a kinetic energy that falls from 0.2 s on and a tip slower than 0.25 m/s
//! after 0.5 s; until then its energy never exceeds the initial energy plus the work of gravity and
//! of torques already on the way.

use crate::support::property::{Outcome, check};
use crate::support::rig::probe_at;
use proptest::prelude::*;
use std::collections::VecDeque;
use supple_core::config::{
    ApparentInertia, Collision, FrictionVelocity, Gains, JointGains, JointNames, Law, Limits,
    PlausibilityLimits, PoseLaw, Role, Workspace,
};
use supple_core::controller::{Breakaway, Fault, Mode, Request, SafeAction, State, step};
use supple_core::dynamics::{aba, gravity, jacobian, kinetic_energy, tip_pose};
use supple_core::learned::LearnedTerms;
use supple_core::math::Vector3;
use supple_core::trajectory::{Fourier, Line, Rotation, Trajectory};
use supple_core::{
    Arm, Body, Config, Controller, Friction, Input, Joint, Matrix, Output, Pose, RippleTable,
    Vector,
};

const PERIOD_S: f64 = 1e-3;

/// Defect of the arm.
#[derive(Clone, Copy, Debug)]
enum Defect {
    /// No defect: the fault is a measurement that is not finite.
    Nothing,
    /// The encoder value of a joint does not change.
    Stuck(usize),
    /// The encoder of a joint has the wrong sign.
    Sign(usize),
    /// All encoders are delayed by 20 cycles.
    Late,
    /// The motor of a joint produces no torque.
    Dead(usize),
    /// The torque of a joint has the wrong sign.
    Reversed(usize),
    /// Gravity has the opposite sign.
    UpsideDown,
    /// A mass at the tip \[kg\].
    Load(f64),
}

#[derive(Clone, Debug)]
struct Case {
    /// Link lengths \[m\] and masses \[kg\], axes by number.
    links: Vec<(f64, f64, u8)>,
    armature_kg_m2: f64,
    pose: Vec<f64>,
    bump_rad_per_s: Vec<f64>,
    mode: u8,
    defect: Defect,
    delay: usize,
}

fn case(joints: usize) -> impl Strategy<Value = Case> {
    let link = (0.1..0.5, 0.5..5.0, 0..3_u8);
    let defect = prop_oneof![
        2 => Just(Defect::Nothing),
        1 => (0..joints).prop_map(Defect::Stuck),
        1 => (0..joints).prop_map(Defect::Sign),
        1 => Just(Defect::Late),
        1 => (0..joints).prop_map(Defect::Dead),
        1 => (0..joints).prop_map(Defect::Reversed),
        1 => Just(Defect::UpsideDown),
        1 => (0.2..2.0).prop_map(Defect::Load),
    ];
    (
        prop::collection::vec(link, joints),
        0.02..0.3,
        prop::collection::vec(-1.8..1.8, joints),
        prop::collection::vec(-4.0..4.0, joints),
        1..11_u8,
        defect,
        0..3_usize,
    )
        .prop_map(
            |(links, armature_kg_m2, pose, bump_rad_per_s, mode, defect, delay)| Case {
                links,
                armature_kg_m2,
                pose,
                bump_rad_per_s,
                mode,
                defect,
                delay,
            },
        )
}

fn arm<const N: usize>(case: &Case, gravity_z: f64) -> Arm<N> {
    let joints: [Joint; N] = core::array::from_fn(|i| {
        let (length, mass_kg, axis) = case.links[i];
        let before = if i == 0 { 0.0 } else { case.links[i - 1].0 };
        // The first joint rotates about the vertical, the others about the axes of the case.
        let axis = if i == 0 { 2 } else { usize::from(axis) };
        let (thin, long) = (2e-3 * mass_kg, mass_kg * length * length / 12.0 + 1e-3);
        Joint {
            parent_from_link: Pose::from_xyz_rpy([0.0, 0.0, before], [0.0; 3]),
            axis: Vector3::ith(axis, 1.0),
            body: Body {
                mass_kg,
                com_m: Vector3::new(0.02, 0.0, 0.5 * length),
                inertia_kg_m2: supple_core::math::Matrix3::from_diagonal(&Vector3::new(
                    long, long, thin,
                )),
            },
            armature_kg_m2: case.armature_kg_m2,
        }
    });
    let tip = Pose::from_xyz_rpy([0.0, 0.0, case.links[N - 1].0], [0.0; 3]);
    Arm::new(&joints, tip, None, Vector3::new(0.0, 0.0, gravity_z)).expect("a physical arm")
}

/// Realistic limits for such an arm: motors that carry three times its weight.
fn config<const N: usize>(case: &Case) -> Config<N> {
    let arm = arm::<N>(case, -9.81);
    let all = Vector::<N>::repeat;
    let mut weight = Vector::<N>::zeros();
    for k in 0..64_u32 {
        let angle = |i: usize| f64::from((k * 37 + 101 * i as u32) % 63) * 0.1 - 3.1;
        let pose = Vector::from_fn(|i, _| angle(i));
        weight = weight.sup(&gravity(&arm, &pose).abs());
    }
    let torque_nm = weight * 3.0 + all(5.0);
    Config {
        arm,
        friction: [Friction::NONE; N],
        roles: [Role::Active; N],
        joint_from_motor: Matrix::identity(),
        ripple: [RippleTable::NONE; N],
        learned: LearnedTerms::zero(),
        compliance_rad_per_nm: Vector::zeros(),
        period_s: PERIOD_S,
        estimator_rad_per_s: 300.0,
        law: Law {
            gains: Gains::isotropic(50.0, 2.0),
            inertia: ApparentInertia::Own,
            friction_velocity: FrictionVelocity::Reference,
            measured_stribeck: false,
            presliding_share: 1.0,
            inertial_feedforward: true,
            nullspace_damping_nm_s_per_rad: 1.0,
        },
        latch: crate::support::configs::latch(),
        move_gains: JointGains {
            stiffness_nm_per_rad: all(100.0),
            damping_nm_s_per_rad: all(3.0),
        },
        joint_gains: JointGains {
            stiffness_nm_per_rad: all(5.0),
            damping_nm_s_per_rad: all(0.5),
        },
        pose: PoseLaw::default(),
        float_friction_share: 0.5,
        hold_pose: false,
        hold_damping_nm_s_per_rad: all(0.5),
        handover_s: 0.1,
        limits: Limits {
            position_lower_rad: all(-30.0),
            position_upper_rad: all(30.0),
            soft_zone_rad: 0.1,
            soft_stiffness_nm_per_rad: all(100.0),
            soft_damping_nm_s_per_rad: all(2.0),
            joint_speed_rad_per_s: all(2.0),
            tip_speed_m_per_s: 1.0,
            tip_acceleration_m_per_s2: 10.0,
            joint_acceleration_rad_per_s2: all(50.0),
            joint_jerk_rad_per_s3: all(5000.0),
            tracking_error_m: 0.25,
            joint_tracking_error_rad: 0.2,
            joint_torque_nm: torque_nm,
            motor_torque_nm: torque_nm,
            torque_rate_nm_per_s: all(1000.0),
            stale_cycles: 1,
            start_error_m: 0.05,
            stiffness_n_per_m: 1000.0,
            damping_n_s_per_m: 100.0,
        },
        collision: Collision {
            joint_torque_nm: torque_nm * 0.3,
            tip_force_n: 60.0,
            move_joint_torque_nm: torque_nm * 0.15,
            move_tip_force_n: 30.0,
        },
        plausible: PlausibilityLimits {
            lost_replies: 3,
            stuck_rad: 0.1,
            stiction_factor: 1.0,
            against_share: 0.05,
            load_n: 8.0,
        },
        workspace: Workspace::UNBOUNDED,
        joint_names: JointNames::NONE,
    }
}

/// The simulated arm with its delays and defects.
struct SimulatedArm<const N: usize> {
    arm: Arm<N>,
    /// Dry friction, and viscous friction at 1 rad/s, that the controller does not model: 1 % of
    /// the torque limit each, half of the WAM's \[N m\].
    friction_nm: Vector<N>,
    q: Vector<N>,
    qd: Vector<N>,
    /// Past encoder angles, the newest last.
    measured: VecDeque<Vector<N>>,
    /// Delayed torques.
    late: VecDeque<Vector<N>>,
    defect: Option<Defect>,
    /// Angles at the onset of the defect.
    at_rad: Vector<N>,
}

impl<const N: usize> SimulatedArm<N> {
    fn encoders(&mut self) -> Vector<N> {
        let mut angles = self.q;
        match self.defect {
            Some(Defect::Stuck(joint)) => angles[joint] = self.at_rad[joint],
            Some(Defect::Sign(joint)) => angles[joint] = 2.0 * self.at_rad[joint] - angles[joint],
            _ => {}
        }
        self.measured.push_back(angles);
        if self.measured.len() > 21 {
            self.measured.pop_front();
        }
        match self.defect {
            Some(Defect::Late) => self.measured[0],
            _ => angles,
        }
    }

    fn advance(&mut self, torque_nm: &Vector<N>) {
        self.late.push_back(*torque_nm);
        let mut torque = self.late.pop_front().expect("one a cycle");
        if let Some(Defect::Dead(joint)) = self.defect {
            torque[joint] = 0.0;
        }
        if let Some(Defect::Reversed(joint)) = self.defect {
            torque[joint] = -torque[joint];
        }
        let load = match self.defect {
            Some(Defect::Load(mass_kg)) => Vector3::new(0.0, 0.0, -9.81 * mass_kg),
            _ => Vector3::zeros(),
        };
        let slope = |q: &Vector<N>, qd: &Vector<N>| {
            let outside = jacobian(&self.arm, q).fixed_rows::<3>(0).tr_mul(&load);
            let friction =
                Vector::from_fn(|i, _| self.friction_nm[i] * ((qd[i] / 0.02).tanh() + qd[i]));
            aba(&self.arm, q, qd, &(torque + outside - friction))
        };
        // Midpoint rule with a step of a quarter of a cycle.
        for _ in 0..4 {
            let h = 0.25 * PERIOD_S;
            let (q, qd) = (self.q, self.qd);
            let k = slope(&q, &qd);
            let (q2, qd2) = (q + qd * (0.5 * h), qd + k * (0.5 * h));
            self.q += qd2 * h;
            self.qd += slope(&q2, &qd2) * h;
        }
    }

    fn energy_j(&self) -> f64 {
        kinetic_energy(&self.arm, &self.q, &self.qd)
    }

    fn tip_m_per_s(&self) -> f64 {
        (jacobian(&self.arm, &self.q).fixed_rows::<3>(0) * self.qd).norm()
    }
}

fn request<const N: usize>(case: &Case, config: &Config<N>, q: &Vector<N>) -> Request<N> {
    match case.mode {
        1 => Request::GravityHold,
        2 => Request::Track(Trajectory::Hold(tip_pose(&config.arm, q).translation)),
        5 => Request::Float,
        6 => Request::JointImpedance {
            target_rad: q.map(|angle| angle + 0.2),
            duration_s: 1.0,
        },
        7 if N >= 6 => Request::TrackPose {
            trajectory: Trajectory::Hold(tip_pose(&config.arm, q).translation),
            rotation: Rotation {
                axis: Vector3::new(0.0, 0.6, 0.8),
                angle_rad: 0.2,
                duration_s: 1.0,
            },
        },
        4 => Request::Track(Trajectory::Line(Line {
            from_m: tip_pose(&config.arm, q).translation,
            to_m: tip_pose(&config.arm, q).translation + Vector3::new(-0.03, 0.02, 0.04),
            duration_s: 0.5,
        })),
        8 => {
            let mut series = Fourier::at_rest(*q, 4.0);
            series.sine_rad[0] = Vector::repeat(0.1);
            series.duration_s = 2.0;
            Request::Excite(series)
        }
        9 => Request::Breakaway(Breakaway {
            joint: N - 1,
            rate_nm_per_s: 2.0,
            stop_rad: 0.1,
            limit_nm: 4.0,
        }),
        10 => Request::Track(probe_at(&tip_pose(&config.arm, q).translation)),
        _ => Request::Move {
            target_rad: q.map(|angle| angle + 0.2),
            duration_s: 1.0,
        },
    }
}

fn stops<const N: usize>(case: &Case) -> Outcome {
    let config = config::<N>(case);
    let controller = Controller::new(config).expect("a valid configuration");
    let mut state = State::new(&controller);
    let start = Vector::<N>::from_column_slice(&case.pose);
    let mut simulated = SimulatedArm {
        arm: config.arm,
        friction_nm: config.limits.joint_torque_nm * 0.01,
        q: start,
        qd: Vector::zeros(),
        measured: VecDeque::new(),
        late: VecDeque::from(vec![Vector::zeros(); case.delay]),
        defect: None,
        at_rad: start,
    };
    let bump = Vector::<N>::from_column_slice(&case.bump_rad_per_s);
    let mut cycle = |simulated: &mut SimulatedArm<N>, cycle: u64, request, force| -> Output<N> {
        let angles = simulated.encoders();
        let input = Input {
            cycle,
            position_rad: core::array::from_fn(|i| Some(angles[i])),
            tip_force_n: force,
            drives_active: true,
            request,
        };
        step(&controller, &mut state, &input)
    };
    let mut k = 0;
    // A brake holds the arm until its weight is compensated.
    while k < 150 {
        let ask = (k == 1).then_some(Request::GravityHold);
        let output = cycle(&mut simulated, k, ask, None);
        simulated.late.push_back(output.torque_nm);
        simulated.late.pop_front();
        k += 1;
    }
    while k < 300 {
        let ask = (k == 150).then(|| request(case, &config, &start));
        let output = cycle(&mut simulated, k, ask, None);
        simulated.advance(&output.torque_nm);
        k += 1;
    }
    simulated.qd += bump;
    let mut fault: Option<(u64, f64)> = None;
    let mut last_j = f64::MAX;
    // A stuck encoder of a joint with a low measured speed (below two fifths of its limit) cannot
    // be distinguished from that of a joint at rest.
    let mut seen = Vector::<N>::zeros();
    for since in 0..1200_u64 {
        // The defect occurs while the arm moves.
        if since == u64::from(case.mode) * 10 {
            simulated.defect = Some(case.defect);
            simulated.at_rad = simulated.q;
            if let Defect::UpsideDown = case.defect {
                simulated.arm = arm::<N>(case, 9.81);
            }
        }
        let bad = (matches!(case.defect, Defect::Nothing) && since == 30)
            .then(|| Vector3::repeat(f64::NAN));
        let output = cycle(&mut simulated, k, None, bad);
        simulated.advance(&output.torque_nm);
        k += 1;
        if simulated.defect.is_none() {
            seen = seen.sup(&output.velocity_rad_per_s.abs());
        }
        let hidden = matches!(case.defect, Defect::Stuck(joint) if seen[joint] < 0.8);
        prop_assert!(simulated.qd.iter().all(|v| v.is_finite()));
        if output.torque_off {
            prop_assert_eq!(output.safe_action, Some(SafeAction::Brake));
            return Ok(());
        }
        let energy_j = simulated.energy_j();
        let Some((begun, at_j)) = &mut fault else {
            if output.fault.is_some() {
                fault = Some((since, energy_j));
            }
            continue;
        };
        prop_assert_eq!(output.mode, Mode::Fault);
        let after = since - *begun;
        if after <= 15 {
            *at_j = at_j.max(energy_j);
        }
        prop_assert!(
            energy_j <= 2.5 * *at_j + slack_j(&simulated, &config, case.defect),
            "{energy_j} J {after} ms after a fault at {at_j} J: {:?}, {:?}",
            output.fault,
            case.defect
        );
        if after >= 200 && after % 50 == 0 && !hidden {
            prop_assert!(
                energy_j <= (1.01 * last_j + 2e-3).max(slack_j(&simulated, &config, case.defect)),
                "{energy_j} J after {last_j} J, {after} ms after {:?}, {:?}",
                output.fault,
                case.defect
            );
            last_j = energy_j;
        }
        if after == 500 {
            let tip = simulated.tip_m_per_s();
            prop_assert!(
                hidden || tip < 0.25,
                "tip at {tip} m/s after {:?}",
                output.fault
            );
            return Ok(());
        }
    }
    // A defect without any visible effect need not be detected.
    Ok(())
}

/// Energy below which the arm does not count as moving: 1.5 times that of all joints at their
/// moving speed of 0.4 rad/s. A joint without a working encoder falls until its missing gravity
/// torque is a tenth of its torque limit, and for 0.1 s more.
fn slack_j<const N: usize>(simulated: &SimulatedArm<N>, config: &Config<N>, defect: Defect) -> f64 {
    let slow = Vector::<N>::repeat(0.4 * 1.5);
    let unseen_j = match defect {
        Defect::Stuck(joint) => 0.1 * config.limits.joint_torque_nm[joint],
        _ => 0.0,
    };
    kinetic_energy(&simulated.arm, &simulated.q, &slow) + unseen_j
}

/// Number of arms of each size; 10,000 in total.
const CASES: u32 = 3334;

#[test]
fn arms_of_3_joints_stop() {
    check(CASES, case(3), |case| stops::<3>(&case));
}

#[test]
fn arms_of_4_joints_stop() {
    check(CASES, case(4), |case| stops::<4>(&case));
}

#[test]
fn arms_of_7_joints_stop() {
    check(CASES, case(7), |case| stops::<7>(&case));
}

/// A fault at the maximum speeds of the motors without any defect: the energy falls in every 10 ms,
/// with torques delayed by up to three cycles, and the drives do not brake.
#[test]
fn arms_without_defects_stop_without_braking() {
    check(300, case(4), |mut case| {
        case.defect = Defect::Nothing;
        case.mode = 0;
        let config = config::<4>(&case);
        let controller = Controller::new(config).expect("a valid configuration");
        let mut state = State::new(&controller);
        let start = Vector::<4>::from_column_slice(&case.pose);
        // Speeds that the motors can stop within 0.1 s.
        let speed = Vector::<4>::from_column_slice(&case.bump_rad_per_s);
        let momentum = supple_core::dynamics::crba(&config.arm, &start) * speed;
        let room = config.limits.joint_torque_nm - gravity(&config.arm, &start).abs();
        let time_s = momentum.abs().component_div(&room).max();
        let mut simulated = SimulatedArm {
            arm: config.arm,
            friction_nm: Vector::zeros(),
            q: start,
            qd: speed * (0.1 / time_s).min(2.5),
            measured: VecDeque::new(),
            late: VecDeque::from(vec![gravity(&config.arm, &start); case.delay]),
            defect: None,
            at_rad: start,
        };
        let mut energies = Vec::new();
        for k in 0..700 {
            let angles = simulated.encoders();
            let output = step(
                &controller,
                &mut state,
                &Input {
                    cycle: k,
                    position_rad: core::array::from_fn(|i| Some(angles[i])),
                    tip_force_n: None,
                    drives_active: true,
                    request: (k == 0).then_some(Request::GravityHold),
                },
            );
            simulated.advance(&output.torque_nm);
            if matches!(
                output.fault,
                Some(Fault::JointSpeed { .. } | Fault::TipSpeed { .. })
            ) {
                prop_assert!(
                    !output.torque_off,
                    "braked after {k} ms at {} J, {} rad/s, external {} of {} N m",
                    simulated.energy_j(),
                    simulated.qd,
                    output.external_torque_nm,
                    config.collision.joint_torque_nm
                );
                energies.push(simulated.energy_j());
            }
        }
        for pair in energies.chunks(10).skip(5).collect::<Vec<_>>().windows(2) {
            prop_assert!(
                pair[1][0] <= pair[0][0] * 1.02 + 1e-3,
                "{} then {} J",
                pair[0][0],
                pair[1][0]
            );
        }
        Ok(())
    });
}
