//! The controller holds an arm, follows a sinusoid, changes its gains and loses an encoder reply.

use crate::arm::{arm, friction};
use crate::digest::Digest;
use crate::print::{PERIOD_S, print, refused};
use core::fmt::{self, Write};
use supple_core::config::{
    ApparentInertia, Collision, ContactLatch, FrictionVelocity, Gains, JointGains, JointNames, Law,
    Limits, PlausibilityLimits, PoseLaw, Role, Workspace,
};
use supple_core::controller::{Controller, Input, Output, Request, State, step};
use supple_core::learned::LearnedTerms;
use supple_core::math::{Matrix3, Vector3, sqrt};
use supple_core::ripple::Harmonic;
use supple_core::trajectory::{Sinusoid, Trajectory};
use supple_core::{Arm, Config, Matrix, RippleTable, Vector, dynamics};

const STEPS: u64 = 1000;
const LOST_REPLY: u64 = 700;
/// Encoder counts per revolution of a joint.
const COUNTS: f64 = 16_384.0;

pub fn report<const N: usize>(out: &mut impl Write) -> fmt::Result {
    let arm = refused(arm::<N>(), out)?;
    let controller = refused(Controller::new(config(arm)), out)?;
    let friction = friction();
    let mut state = State::new(&controller);
    let mut q = start();
    let mut qd = Vector::<N>::zeros();
    let mut digest = Digest::new();
    for cycle in 0..STEPS {
        let input = Input {
            cycle,
            position_rad: core::array::from_fn(|i| {
                (cycle != LOST_REPLY || i != 1).then(|| quantised(q[i]))
            }),
            tip_force_n: Some(Vector3::new(0.1, -0.2, 0.3)),
            drives_active: true,
            request: request(&arm, cycle),
        };
        let output = step(&controller, &mut state, &input);
        every_number(&mut digest, &output);
        let tau = output.torque_nm - qd.map(|v| friction.torque_nm(v));
        qd += dynamics::aba(&arm, &q, &qd, &tau) * PERIOD_S;
        q += qd * PERIOD_S;
        if cycle + 1 == STEPS {
            print_state(out, &output)?;
        }
    }
    let digest = digest.value();
    writeln!(out, "control of {N} joints, {STEPS} steps: {digest:016x}")
}

fn print_state<const N: usize>(out: &mut impl Write, output: &Output<N>) -> fmt::Result {
    print(out, "torque_nm", &output.torque_nm)?;
    let mode = output.mode.name();
    let fault = output.fault.map_or("none", |fault| fault.name());
    write!(out, "mode {mode}, fault {fault}")?;
    if let Some(reference) = output.reference {
        let error = reference.position - output.tip_position_m;
        write!(out, ", error {:.6} m", sqrt(error.dot(&error)))?;
    }
    writeln!(out)
}

fn start<const N: usize>() -> Vector<N> {
    Vector::from_fn(|i, _| [0.2, 0.8, 0.3, 0.9][i % 4])
}

fn quantised(angle_rad: f64) -> f64 {
    let count_rad = core::f64::consts::TAU / COUNTS;
    (angle_rad / count_rad) as i32 as f64 * count_rad
}

fn request<const N: usize>(arm: &Arm<N>, cycle: u64) -> Option<Request<N>> {
    match cycle {
        0 => Some(Request::GravityHold),
        100 => Some(Request::Track(Trajectory::Sinusoid(Sinusoid {
            centre_m: dynamics::tip_pose(arm, &start()).translation,
            amplitude_m: Vector3::new(0.02, -0.03, 0.01),
            angular_frequency_rad_per_s: 3.0,
            ramp_s: 0.2,
        }))),
        400 => Some(Request::Gains {
            gains: Gains::isotropic(25.0, 8.0),
            ramp_s: 0.1,
        }),
        _ => None,
    }
}

/// Configuration; with more than four joints the third is held and the apparent inertia is chosen.
fn config<const N: usize>(arm: Arm<N>) -> Config<N> {
    let all = Vector::repeat;
    let mut roles = [Role::Active; N];
    let mut inertia = ApparentInertia::Own;
    if N > 4 {
        roles[2] = Role::Held {
            position_rad: 0.3,
            stiffness_nm_per_rad: 50.0,
            damping_nm_s_per_rad: 2.0,
        };
        inertia = ApparentInertia::Chosen(Matrix3::from_diagonal_element(3.0));
    }
    let mut joint_from_motor = Matrix::identity() * 0.05;
    joint_from_motor[(1, 2)] = 0.02;
    joint_from_motor[(2, 1)] = -0.02;
    Config {
        arm,
        friction: [friction(); N],
        roles,
        joint_from_motor,
        ripple: [ripple(); N],
        learned: LearnedTerms::zero(),
        compliance_rad_per_nm: Vector::zeros(),
        period_s: PERIOD_S,
        estimator_rad_per_s: 200.0,
        law: Law {
            gains: Gains::isotropic(50.0, 10.0),
            inertia,
            friction_velocity: FrictionVelocity::Reference,
            measured_stribeck: false,
            presliding_share: 1.0,
            inertial_feedforward: true,
            nullspace_damping_nm_s_per_rad: 0.5,
        },
        latch: ContactLatch {
            fade: true,
            observer_rad_per_s: 100.0,
            threshold_n: 5.0,
            friction_error: 0.1,
            reversal_s: 0.1,
            contact_share: 0.3,
            fade_s: 0.01,
            restore_s: 0.2,
            settle_s: 0.05,
            hold_friction: true,
            false_alarms_per_hour: 1.0,
            release_s: 0.2,
        },
        move_gains: JointGains {
            stiffness_nm_per_rad: all(100.0),
            damping_nm_s_per_rad: all(5.0),
        },
        joint_gains: JointGains {
            stiffness_nm_per_rad: all(5.0),
            damping_nm_s_per_rad: all(0.5),
        },
        pose: PoseLaw::default(),
        float_friction_share: 0.5,
        hold_pose: false,
        hold_damping_nm_s_per_rad: all(1.0),
        handover_s: 0.05,
        limits: Limits {
            position_lower_rad: all(-2.5),
            position_upper_rad: all(2.5),
            soft_zone_rad: 0.1,
            soft_stiffness_nm_per_rad: all(50.0),
            soft_damping_nm_s_per_rad: all(1.0),
            joint_speed_rad_per_s: all(4.0),
            tip_speed_m_per_s: 2.0,
            tip_acceleration_m_per_s2: 20.0,
            joint_acceleration_rad_per_s2: all(100.0),
            joint_jerk_rad_per_s3: all(1e4),
            tracking_error_m: 0.2,
            joint_tracking_error_rad: 0.2,
            joint_torque_nm: all(120.0),
            motor_torque_nm: all(8.0),
            torque_rate_nm_per_s: all(20_000.0),
            stale_cycles: 5,
            start_error_m: 0.1,
            stiffness_n_per_m: 200.0,
            damping_n_s_per_m: 50.0,
        },
        collision: Collision::disabled(),
        plausible: PlausibilityLimits::disabled(),
        workspace: Workspace::UNBOUNDED,
        joint_names: JointNames::NONE,
    }
}

fn ripple() -> RippleTable {
    let line = |harmonic, sine_nm, cosine_nm| Harmonic {
        harmonic,
        sine_nm,
        cosine_nm,
        ..Harmonic::default()
    };
    RippleTable::new(&[line(2, 0.01, -0.02), line(12, 0.005, 0.004)]).unwrap_or_default()
}

fn every_number<const N: usize>(digest: &mut Digest, output: &Output<N>) {
    digest.matrix(&output.torque_nm);
    digest.matrix(&output.fallback_torque_nm);
    for (_, torque) in output.torques.named() {
        digest.matrix(torque);
    }
    digest.matrix(&output.velocity_rad_per_s);
    digest.matrix(&output.tip_position_m);
    digest.matrix(&output.tip_velocity_m_per_s);
    digest.matrix(&output.external_torque_nm);
    digest.matrix(&output.external_force_n);
    digest.number(output.friction_share);
    digest.number(output.min_singular_value_m);
}
