//! Each injection has its documented effect on a plant from its start time on, and no effect before.

use crate::common::wam4_in;
use supple_core::controller::Mode;
use supple_core::dynamics::gravity;
use supple_core::{Arm, Vector};
use supple_model::Description;
use supple_plant::{ControllerView, Injection, InjectionError, Injector, Plant, PlantConfig};

const HOME_RAD: [f64; 4] = [0.1, -1.8, 0.2, 2.6];
const SPEED: [f64; 4] = [0.3, -0.2, 0.4, 0.25];
const PERIOD_S: f64 = 2e-3;
const TRACKS: ControllerView = ControllerView {
    active: true,
    mode: Some(Mode::Track),
};

struct Bench {
    plant: Plant<4>,
    injector: Injector<4>,
}

impl Bench {
    fn of(
        config: PlantConfig<4>,
        speed: [f64; 4],
        specs: &[&str],
    ) -> Result<Bench, InjectionError> {
        let injections: Result<Vec<Injection>, _> = specs.iter().map(|spec| spec.parse()).collect();
        let mut plant = Plant::new(config, HOME_RAD.into(), speed.into()).expect("valid");
        let injector = Injector::new(&injections?, &mut plant, PERIOD_S)?;
        Ok(Bench { plant, injector })
    }

    /// An arm without friction and gravity that coasts; its cycle is the control cycle.
    fn coasting(specs: &[&str]) -> Bench {
        let mut config = PlantConfig::ideal(wam4_in([0.0; 3].into()));
        config.cycle_s = PERIOD_S;
        Bench::of(config, SPEED, specs).expect("valid")
    }

    fn cycle(&mut self, sight: ControllerView, torque_nm: [f64; 4]) -> [f64; 4] {
        let torque_nm = torque_nm.into();
        self.injector
            .cycle(&mut self.plant, sight, &torque_nm, [false; 4]);
        (*self.injector.position_rad()).into()
    }

    fn true_rad(&self) -> [f64; 4] {
        self.plant.truth().position_rad.into()
    }
}

#[test]
fn without_injections_a_plant_is_bit_identical() {
    let description = Description::asset("wam4").expect("built in");
    let config = PlantConfig::<4>::from_description(&description).expect("valid");
    let mut bench = Bench::of(config.clone(), SPEED, &[]).expect("valid");
    let mut plain = Plant::new(config, HOME_RAD.into(), SPEED.into()).expect("valid");
    for cycle in 0..50 {
        let torque_nm = [1.0, -2.0, 0.5, f64::from(cycle) * 0.01];
        plain.cycle(&torque_nm.into());
        let said = bench.cycle(TRACKS, torque_nm);
        assert_eq!(said, <[f64; 4]>::from(plain.measurement().position_rad));
        assert_eq!(bench.plant.truth(), plain.truth());
    }
}

#[test]
fn a_stuck_encoder_keeps_its_angle_from_its_start_time_on() {
    let mut bench = Bench::coasting(&["encoder-stuck:joint=2,when=track,after-s=0.02"]);
    let (idle, held) = (
        ControllerView {
            active: false,
            mode: Some(Mode::Track),
        },
        ControllerView {
            active: true,
            mode: Some(Mode::GravityHold),
        },
    );
    // It does not start without active drives or in another mode.
    for sight in [[idle; 10], [held; 10]].concat() {
        assert_eq!(bench.cycle(sight, [0.0; 4]), bench.true_rad());
    }
    let mut before = bench.true_rad();
    for cycle in 0..40 {
        let said = bench.cycle(TRACKS, [0.0; 4]);
        // 0.02 s are 10 cycles.
        let stuck = cycle >= 10;
        let now = bench.true_rad();
        assert_eq!(said[2], if stuck { before[2] } else { now[2] }, "{cycle}");
        assert_eq!((said[0], said[1], said[3]), (now[0], now[1], now[3]));
        assert_eq!(bench.injector.begun(), usize::from(stuck));
        if !stuck {
            before = now;
        }
    }
    assert!((bench.true_rad()[2] - before[2]).abs() > 0.01, "it moved");
}

/// Motors 1 and 2 drive joints 1 and 2 together.
#[test]
fn a_stuck_motor_encoder_makes_the_angles_of_the_joints_that_it_drives_wrong() {
    let mut bench = described(&["motor-encoder-stuck:motor=1,at-s=0.02"]);
    let to_joints = bench.plant.config().actuators.joint_from_motor;
    let to_motors = to_joints.try_inverse().expect("regular");
    let mut start_rad = Vector::zeros();
    for cycle in 0..40 {
        let measured = to_motors * Vector::from(bench.cycle(TRACKS, [0.0, 2.0, 0.5, 1.0]));
        let now = to_motors * bench.plant.measurement().position_rad;
        if cycle < 10 {
            start_rad = now;
        }
        let stuck = |motor| motor == 1 && cycle >= 10;
        for motor in 0..4 {
            let expected = if stuck(motor) { start_rad } else { now };
            assert!((measured[motor] - expected[motor]).abs() < 1e-9, "{cycle}");
        }
    }
    let turned = to_motors * bench.plant.measurement().position_rad - start_rad;
    assert!(turned[1].abs() > 0.1, "it moved");
}

/// The time counts from the first start of the mode, even if the mode has ended by then.
#[test]
fn only_the_first_start_of_a_mode_counts() {
    let mut bench = Bench::coasting(&["encoder-stuck:when=move,after-s=0.02"]);
    let sight = |mode| ControllerView {
        active: true,
        mode: Some(mode),
    };
    bench.cycle(sight(Mode::Move), [0.0; 4]);
    for _ in 0..9 {
        bench.cycle(sight(Mode::Track), [0.0; 4]);
        assert_eq!(bench.injector.begun(), 0);
    }
    bench.cycle(sight(Mode::Track), [0.0; 4]);
    assert_eq!(bench.injector.begun(), 1);
}

#[test]
fn a_late_encoder_lags_by_its_number_of_cycles_and_does_not_jump() {
    let mut bench = Bench::coasting(&["encoder-late:cycles=5,at-s=0.02"]);
    let mut history = vec![bench.true_rad()];
    for cycle in 1..=40 {
        let said = bench.cycle(TRACKS, [0.0; 4]);
        history.push(bench.true_rad());
        // From the reading at the end of the 11th cycle on.
        let expected = match cycle {
            0..=10 => cycle,
            _ => (cycle - 5).max(11),
        };
        assert_eq!(said, history[expected], "cycle {cycle}");
    }
}

/// Delays are counted in control cycles even if the cycle of the plant is shorter.
#[test]
fn a_delay_is_counted_in_control_cycles() {
    let mut config = PlantConfig::ideal(wam4_in([0.0; 3].into()));
    config.cycle_s = 2e-4;
    let mut bench = Bench::of(config, SPEED, &["encoder-late:cycles=2"]).expect("valid");
    let mut history = vec![bench.true_rad()];
    for cycle in 1..=60 {
        let said = bench.cycle(TRACKS, [0.0; 4]);
        history.push(bench.true_rad());
        assert_eq!(said, history[usize::saturating_sub(cycle, 20)]);
    }
}

#[test]
fn an_encoder_of_the_wrong_sign_counts_backwards_from_its_angle_at_the_start() {
    let mut bench = Bench::coasting(&["encoder-sign:joint=1,at-s=0.01"]);
    let mut start = 0.0;
    for cycle in 0..30 {
        let said = bench.cycle(TRACKS, [0.0; 4])[1];
        let now = bench.true_rad()[1];
        if cycle < 5 {
            start = now;
            assert_eq!(said, now);
        } else {
            assert!((said - start + (now - start)).abs() < 1e-12, "{cycle}");
        }
    }
    assert!((bench.true_rad()[1] - start).abs() > 0.005);
}

#[test]
fn offset_and_nan_affect_the_first_reading() {
    let mut bench = Bench::coasting(&[
        "encoder-offset:joint=3,offset-rad=0.25",
        "encoder-nan:joint=0,at-s=0",
    ]);
    assert_eq!(bench.injector.position_rad()[3], HOME_RAD[3] + 0.25);
    assert_eq!(bench.injector.position_rad()[0], HOME_RAD[0]);
    let said = bench.cycle(TRACKS, [0.0; 4]);
    assert_eq!(said[3], bench.true_rad()[3] + 0.25);
    assert!(said[0].is_nan() && said[1] == bench.true_rad()[1]);
}

#[test]
fn every_second_reply_is_lost() {
    let mut bench = Bench::coasting(&["reply-lost:every=2,joint=1", "reply-lost:every=3,joint=2"]);
    for cycle in 1..=12 {
        let replies = bench.injector.replies();
        let there = replies.map(|reply| reply.is_some());
        assert_eq!(
            there,
            [true, cycle % 2 != 0, cycle % 3 != 0, true],
            "{cycle}"
        );
        bench.cycle(TRACKS, [0.0; 4]);
    }
}

fn described(specs: &[&str]) -> Bench {
    let description = Description::asset("wam4").expect("built in");
    let mut config = PlantConfig::<4>::from_description(&description).expect("valid");
    config.cycle_s = PERIOD_S;
    config.actuators.ripple.clear();
    config.actuators.motor_torque_quantum_nm = Vector::zeros();
    config.actuators.torque_delay_cycles = 0;
    Bench::of(config, SPEED, specs).expect("valid")
}

/// Motors 1 and 2 share joints 1 and 2.
#[test]
fn a_dead_motor_produces_no_torque_and_does_not_brake() {
    let mut bench = described(&["motor-dead:motor=1"]);
    let to_joints = bench.plant.config().actuators.joint_from_motor;
    let torque_nm = Vector::from([3.0, -4.0, 1.0, 2.0]);
    let at_motors = |bench: &Bench| to_joints.transpose() * bench.plant.truth().motor_torque_nm;
    let sight = |active| ControllerView { active, mode: None };
    bench
        .injector
        .cycle(&mut bench.plant, sight(true), &torque_nm, [false; 4]);
    let commanded = to_joints.transpose() * torque_nm;
    for (motor, (is, was)) in at_motors(&bench).iter().zip(commanded.iter()).enumerate() {
        let expected = if motor == 1 { 0.0 } else { *was };
        assert!((is - expected).abs() < 1e-12, "motor {motor}: {is} {was}");
    }
    bench
        .injector
        .cycle(&mut bench.plant, sight(false), &Vector::zeros(), [true; 4]);
    for (motor, torque) in at_motors(&bench).iter().enumerate() {
        assert_eq!(torque.abs() < 1e-12, motor == 1, "motor {motor}: {torque}");
    }
    assert!(bench.injector.is_dead(1) && !bench.injector.is_dead(0));
}

#[test]
fn a_torque_of_the_wrong_sign_acts_only_on_its_joint() {
    let mut bench = described(&["torque-sign:joint=2"]);
    bench.cycle(TRACKS, [3.0, -4.0, 1.0, 2.0]);
    let acts = bench.plant.truth().motor_torque_nm;
    assert!(
        (acts - Vector::from([3.0, -4.0, -1.0, 2.0])).amax() < 1e-12,
        "{acts}"
    );
}

#[test]
fn a_late_torque_acts_after_its_number_of_cycles() {
    let mut bench = Bench::coasting(&["torque-late:cycles=3,at-s=0.01"]);
    for cycle in 0..20_i32 {
        let torque = f64::from(cycle);
        bench.cycle(TRACKS, [torque, 0.0, 0.0, 0.0]);
        let expected = if cycle < 5 { cycle } else { (cycle - 3).max(5) };
        assert_eq!(
            bench.plant.truth().motor_torque_nm[0],
            f64::from(expected),
            "{cycle}"
        );
    }
}

/// Checks that an arm held by its model's gravity torque rests without injection, and moves like the arm `truth` with it.
fn held_by_the_model(specs: &[&str], truth: &Arm<4>) {
    let model = wam4_in([0.0, 0.0, -9.81].into());
    let config = PlantConfig::ideal(model);
    let mut bench = Bench::of(config, [0.0; 4], specs).expect("valid");
    let hold = |q: [f64; 4]| gravity(&model, &q.into());
    for _ in 0..20 {
        bench.cycle(TRACKS, hold(bench.true_rad()).into());
        assert!(bench.plant.kinetic_energy_j() < 1e-9, "it is held before");
    }
    let mut alone =
        Plant::new(PlantConfig::ideal(*truth), HOME_RAD.into(), Vector::zeros()).expect("valid");
    for _ in 0..200 {
        let torque_nm = hold(bench.true_rad());
        bench.cycle(TRACKS, torque_nm.into());
        alone.cycle(&torque_nm);
    }
    let moved = alone.truth().position_rad - Vector::from(HOME_RAD);
    assert!(moved.amax() > 0.02, "{moved}");
    let apart = alone.truth().position_rad - bench.plant.truth().position_rad;
    assert!(apart.amax() < 1e-4 * moved.amax(), "{apart} {moved}");
    let (energy, expected) = (bench.plant.kinetic_energy_j(), alone.kinetic_energy_j());
    assert!(energy > 0.01 && (energy - expected).abs() < 1e-3 * expected);
}

#[test]
fn gravity_is_reversed() {
    held_by_the_model(
        &["gravity-reversed:at-s=0.02"],
        &wam4_in([0.0, 0.0, 9.81].into()),
    );
}

#[test]
fn a_payload_adds_its_weight_and_inertia() {
    let mut loaded = Plant::new(
        PlantConfig::ideal(wam4_in([0.0, 0.0, -9.81].into())),
        HOME_RAD.into(),
        Vector::zeros(),
    )
    .expect("valid");
    let before_kg = loaded.config().arm.body(3).mass_kg;
    loaded.add_payload(1.5).expect("valid");
    let arm = loaded.config().arm;
    assert!((arm.body(3).mass_kg - before_kg - 1.5).abs() < 1e-12);
    // The gravity torque grows by that of a point mass at the tip.
    let q = Vector::from(HOME_RAD);
    let more = gravity(&arm, &q) - gravity(&wam4_in([0.0, 0.0, -9.81].into()), &q);
    let lever = supple_core::dynamics::jacobian(&arm, &q);
    for joint in 0..4 {
        assert!((more[joint] - 1.5 * 9.81 * lever[(2, joint)]).abs() < 1e-9);
    }
    held_by_the_model(&["payload:mass-kg=1.5,at-s=0.02"], &arm);
}

#[test]
fn a_bump_changes_the_speed_of_one_joint_by_a_step() {
    let mut bench = Bench::coasting(&["bump:joint=2,speed-rad-per-s=2.5,at-s=0.02"]);
    let mut before = bench.plant.truth().velocity_rad_per_s;
    for cycle in 0..15 {
        bench.cycle(TRACKS, [0.0; 4]);
        let now = bench.plant.truth().velocity_rad_per_s;
        let change = if cycle == 10 { 2.5 } else { 0.0 };
        let apart = now - before - Vector::from([0.0, 0.0, change, 0.0]);
        assert!(apart.amax() < 0.05, "cycle {cycle}: {apart}");
        before = now;
    }
    let energy = bench.plant.kinetic_energy_j();
    assert!(energy > 0.3, "{energy}");
}

#[test]
fn idle_drives_brake_and_are_reenabled() {
    let mut bench = described(&["drives-idle:for-s=0.01,at-s=0.01"]);
    for cycle in 0..20 {
        bench.cycle(TRACKS, [5.0, 0.0, 0.0, 0.0]);
        let torque = bench.plant.truth().motor_torque_nm[0];
        // Cycles of 2 ms: 5 before, 5 idle.
        let idle = (5..10).contains(&cycle);
        assert_eq!(torque < 4.99, idle, "cycle {cycle}: {torque}");
    }
}

#[test]
fn an_unknown_joint_is_rejected() {
    let config = PlantConfig::ideal(wam4_in([0.0; 3].into()));
    let refused = Bench::of(config, [0.0; 4], &["encoder-stuck:joint=4"]).err();
    let words = refused.expect("refused").to_string();
    assert_eq!(
        words,
        "injection encoder-stuck: joint is 4, the arm has 4; count from 0 to 3"
    );
}
