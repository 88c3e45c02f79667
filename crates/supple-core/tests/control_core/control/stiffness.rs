//! The loss of a sensor or a connection never makes the arm stiffer: compares the slope of the
//! torque over the angles before and after each loss.

use crate::support::configs::{four, held, three, unlimited};
use crate::support::plant::{Plant, push};
use crate::support::random::{Draws, Random};
use crate::support::rig::{Rig, bent};
use crate::support::size;
use supple_core::config::{ApparentInertia, Gains, Role};
use supple_core::controller::{Mode, Request};
use supple_core::dynamics::jacobian;
use supple_core::linalg::symmetric_eigenvalues;
use supple_core::math::{Matrix3, Vector3};
use supple_core::{Config, Input, Matrix, Vector};

/// Small compared with the arm's motion, large compared with rounding \[rad\].
const STEP_RAD: f64 = 1e-4;

/// `-d(tau - G)/dq` at rest: the stiffness of the controller. The gravity torque balances the
/// weight and does not count.
fn stiffness<const N: usize>(rig: &Rig<N>) -> Matrix<N, N> {
    let settled = |q: Vector<N>| {
        let mut rig = rig.clone();
        rig.q = q;
        let output = rig.rest();
        output.torque_nm - output.torques.gravity
    };
    let mut slope = Matrix::<N, N>::zeros();
    for i in 0..N {
        let mut step = Vector::zeros();
        step[i] = STEP_RAD;
        let difference = settled(rig.q + step) - settled(rig.q - step);
        slope.set_column(i, &(-difference / (2.0 * STEP_RAD)));
    }
    (slope + slope.transpose()) * 0.5
}

/// Maximum increase in stiffness from `before` to `after`: in many directions of the active joints, and of
/// each held joint alone. Entries between active and held joints are omitted: a held joint moves the tip, so
/// that the law's torque changes on the active joints, but not the reverse.
fn max_increase(roles: &[Role; 4], before: &Matrix<4, 4>, after: &Matrix<4, 4>) -> f64 {
    let increase = after - before;
    let held = |i: usize| roles[i] != Role::Active;
    let mut max = f64::MIN;
    for i in (0..4).filter(|i| held(*i)) {
        max = max.max(increase[(i, i)]);
    }
    let mut random = Random::new(1);
    for _ in 0..2000 {
        let direction = random.joints::<4>(1.0);
        let direction = Vector::<4>::from_fn(|i, _| if held(i) { 0.0 } else { direction[i] });
        let direction = direction / direction.norm();
        max = max.max(direction.dot(&(increase * direction)));
    }
    max
}

/// A loss: its name, and a function that loses inputs of some cycles. Later inputs are complete.
type Loss = (&'static str, fn(&mut Rig<4>));

fn cycle_with(rig: &mut Rig<4>, change: impl Fn(&mut Input<4>)) {
    let mut input = rig.input();
    change(&mut input);
    rig.step(&input);
}

const LOSSES: [Loss; 8] = [
    ("one reply", |rig| {
        cycle_with(rig, |input| input.position_rad[1] = None);
    }),
    ("an encoder", |rig| {
        for _ in 0..3 {
            cycle_with(rig, |input| input.position_rad[1] = None);
        }
    }),
    ("an invalid encoder value", |rig| {
        cycle_with(rig, |input| input.position_rad[0] = Some(f64::NAN));
    }),
    ("all encoders", |rig| {
        for _ in 0..3 {
            cycle_with(rig, |input| input.position_rad = [None; 4]);
        }
    }),
    ("the force sensor", |rig| {
        cycle_with(rig, |input| {
            input.tip_force_n = Some(Vector3::repeat(f64::NAN))
        });
    }),
    ("the states of 50 cycles", |rig| rig.cycle += 50),
    ("the advance of the cycle number", |rig| {
        for _ in 0..10 {
            cycle_with(rig, |input| input.cycle -= 1);
        }
    }),
    ("the plant, which starts anew at cycle 3", |rig| {
        cycle_with(rig, |input| input.cycle = 3);
    }),
];

#[test]
fn no_lost_input_increases_the_stiffness_in_any_mode() {
    let mut config = four();
    unlimited(&mut config);
    for mode in [Mode::Idle, Mode::GravityHold, Mode::Move, Mode::Track] {
        let mut rig = Rig::new(config, bent());
        rig.bring_to(mode);
        let before = stiffness(&rig);
        for (what, lose) in LOSSES {
            let mut rig = rig.clone();
            lose(&mut rig);
            let after = stiffness(&rig);
            let increase = max_increase(&config.roles, &before, &after);
            assert!(
                increase < 1e-3,
                "{increase} N m/rad stiffer in {mode:?} after losing {what}: {before} {after}"
            );
        }
    }
}

/// Idle: none. Gravity hold: the loop of the held shoulder roll. Track: that and `J^T K J`. Move: the loops of all joints.
#[test]
fn stiffness_in_each_mode_is_as_documented() {
    let mut config = four();
    unlimited(&mut config);
    config.friction = crate::support::configs::friction();
    let in_mode = |mode| {
        let mut rig = Rig::new(config, bent());
        rig.bring_to(mode);
        stiffness(&rig)
    };
    let mut roll = Matrix::<4, 4>::zeros();
    roll[(2, 2)] = 600.0;
    assert_eq!(in_mode(Mode::Idle), Matrix::<4, 4>::zeros());
    assert!(size(&(in_mode(Mode::GravityHold) - roll)) < 1e-4);
    let mut j: Matrix<3, 4> = jacobian(&config.arm, &bent())
        .fixed_rows::<3>(0)
        .into_owned();
    j.column_mut(2).fill(0.0);
    let spring = j.transpose() * j * 100.0;
    let found = in_mode(Mode::Track);
    // Only entries of two active joints: the held roll also moves the tip, but the law does not actuate it.
    for (a, b) in [(0, 0), (0, 1), (1, 1), (1, 3), (3, 3), (0, 3)] {
        let error = (found - spring - roll)[(a, b)].abs();
        assert!(error < 1e-3, "entry {a}, {b} is {error} off");
    }
    let moving = in_mode(Mode::Move);
    assert!(size(&(moving - Matrix::<4, 4>::from_diagonal_element(600.0))) < 1e-3);
}

/// A lost reply opens the loop of its joint for a cycle: the torque does not depend on the angle.
#[test]
fn a_lost_reply_opens_the_loop_of_its_joint() {
    let mut config = four();
    unlimited(&mut config);
    let mut rig = Rig::new(config, bent());
    rig.bring_to(Mode::Track);
    let torque = |angle: f64| {
        let mut rig = rig.clone();
        rig.q[1] = angle;
        let mut input = rig.input();
        input.position_rad[1] = None;
        rig.step(&input).torque_nm
    };
    assert_eq!(torque(bent::<4>()[1]), torque(bent::<4>()[1] + 0.1));
}

/// Apparent stiffness in `Track`: external force on the tip per displacement of the tip, once at rest.
fn apparent_stiffness(config: Config<3>, sensor: bool) -> Matrix3<f64> {
    let settled_tip = |push_n: Vector3<f64>| -> Vector3<f64> {
        let mut rig = Rig::holding(config, bent());
        rig.force_n = sensor.then_some(Vector3::zeros());
        rig.accept(rig.hold_tip_request());
        let mut plant = Plant::at_rest(config.arm, bent());
        for k in 0..6000 {
            let pushing_n = push_n * (f64::from(k) / 1000.0).min(1.0);
            rig.force_n = sensor.then_some(pushing_n);
            let output = rig.drive(&mut plant, None, |arm, q, _| push(arm, q, &pushing_n));
            assert_eq!(output.fault, None);
        }
        supple_core::dynamics::tip_pose(&config.arm, &plant.q).translation
    };
    let mut compliance = Matrix3::zeros();
    for axis in 0..3 {
        let mut force = Vector3::zeros();
        force[axis] = 0.5;
        let displacement = settled_tip(force) - settled_tip(-force);
        compliance.set_column(axis, &displacement);
    }
    crate::support::inverse(&compliance)
}

/// The force sensor affects the apparent inertia only, not the stiffness: without it the stiffness
/// is still `K`, for a chosen inertia below the arm's own and for one above it.
#[test]
fn losing_the_force_sensor_keeps_the_stiffness() {
    for mass_kg in [1.5, 10.0] {
        let mut config = three();
        unlimited(&mut config);
        config.law.gains = Gains::isotropic(100.0, 40.0);
        config.law.inertia = ApparentInertia::Chosen(Matrix3::from_diagonal_element(mass_kg));
        let with = apparent_stiffness(config, true);
        let without = apparent_stiffness(config, false);
        let [.., increase] = symmetric_eigenvalues(&(without - with));
        assert!(
            increase < 0.01 * 100.0,
            "{increase} N/m stiffer at {mass_kg} kg"
        );
        let expected = Matrix3::from_diagonal_element(100.0);
        assert!(size(&(with - expected)) < 1.0, "{with}");
    }
}

/// `Mode::Move` holds the active joints in stiff position loops too: a fault opens them.
#[test]
fn a_fault_in_a_move_opens_the_position_loops() {
    let mut config = four();
    unlimited(&mut config);
    assert_eq!(config.roles[2], held(0.0));
    let mut rig = Rig::new(config, bent());
    rig.bring_to(Mode::Move);
    let before = stiffness(&rig);
    rig.cycle += 50;
    rig.cycle();
    let after = stiffness(&rig);
    for (i, role) in config.roles.iter().enumerate() {
        if *role == Role::Active {
            assert!(before[(i, i)] > 500.0 && after[(i, i)].abs() < 1e-3);
        }
    }
    assert_eq!(rig.request(Request::Reset).mode, Mode::GravityHold);
}
