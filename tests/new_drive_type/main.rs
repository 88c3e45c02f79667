//! Tests of a type of drives that is not part of the project and uses only its public interfaces: mjbots moteus with its published
//! codec, on emulated motors. Use of the codec, emulated motors, drive and tests are in this folder.

#[path = "../arm_on_bus/link.rs"]
mod link;

mod drive;
mod emulated;

use drive::{KD_NM_S_PER_RAD, Moteus};
use emulated::EmulatedMoteus;
use link::InProcessLink;
use supple_bus::virtual_time::DirectBus;
use supple_core::controller::Request;
use supple_core::{Controller, Vector};
use supple_drive::{CycleConfig, LossReason, MotorFault, PlantLoop, Stage, StowConfig};
use supple_model::Description;

const PERIOD_NS: u64 = 2_000_000;

type Loop = PlantLoop<4, Moteus<4, DirectBus<EmulatedMoteus>>, InProcessLink<4>>;

fn in_service() -> Loop {
    let description = Description::asset("wam4").unwrap().at_rate(500.0).unwrap();
    let config = description.config::<4>().unwrap();
    let mut bus = DirectBus(EmulatedMoteus::new(&description));
    drive::start_up::<4, _>(&mut bus).unwrap();
    let link = InProcessLink::new(Controller::new(config).unwrap());
    let cycle_config = CycleConfig {
        period_ns: PERIOD_NS,
        answer_ns: 0,
    };
    let stow = StowConfig {
        stow_rad: Some(description.home::<4>().unwrap()),
        damping_nm_s_per_rad: Vector::repeat(KD_NM_S_PER_RAD / 2.0),
        stiffness_nm_per_rad: config.move_gains.stiffness_nm_per_rad * 0.25,
        speed_rad_per_s: 0.4,
        hold_s: 0.1,
    };
    PlantLoop::new(Moteus::new(bus), link, &config, cycle_config, Some(stow)).unwrap()
}

fn run(plant: &mut Loop, cycles: usize) {
    for _ in 0..cycles {
        plant.run().unwrap();
    }
}

fn holding() -> Loop {
    let mut plant = in_service();
    plant.link_mut().request = Some(Request::GravityHold);
    run(&mut plant, 50);
    assert_eq!(plant.guard().stage(), Stage::Active);
    plant
}

#[test]
fn gravity_hold_holds_the_arm() {
    let mut plant = in_service();
    let pose = plant.drive().bus().0.position_rad();
    plant.link_mut().request = Some(Request::GravityHold);
    run(&mut plant, 500);
    assert_eq!(plant.guard().stage(), Stage::Active);
    let moved = (plant.drive().bus().0.position_rad() - pose).amax();
    assert!(moved < 0.01, "{moved} rad");
    assert_eq!(plant.counters().replies_lost, 0);
    assert_eq!(plant.counters().tx_lost, 0);
    assert!(plant.counters().bus_load < 0.8);
}

#[test]
fn a_lost_controller_ends_with_stopped_motors() {
    let mut plant = holding();
    plant.link_mut().dead = true;
    let mut stages = Vec::new();
    for _ in 0..3000 {
        run(&mut plant, 1);
        stages.push(plant.guard().stage());
    }
    stages.dedup();
    assert_eq!(stages.len(), 5, "{stages:?}");
    assert!(matches!(stages[1], Stage::Holding(LossReason::NoAnswer, _)));
    assert!(matches!(stages[2], Stage::Stowing(LossReason::NoAnswer, _)));
    assert_eq!(stages[4], Stage::Resting);
    assert!(plant.drive().bus().0.all_stopped());
}

#[test]
fn a_motor_fault_is_reported_with_its_code() {
    let mut plant = holding();
    plant.drive_mut().bus_mut().0.fail(2, 38);
    run(&mut plant, 2);
    let (reason, _) = plant.guard().last_loss().unwrap();
    assert_eq!(reason, LossReason::Motor(2, MotorFault::Unknown(38)));
    assert!(matches!(plant.guard().stage(), Stage::Holding(..)));
}

/// A wrong register map is refused before any motor gets torque.
#[test]
fn another_register_map_is_refused() {
    let description = Description::asset("wam4").unwrap();
    let mut bus = DirectBus(EmulatedMoteus::new(&description));
    bus.0.register_map = 4;
    let error = drive::start_up::<4, _>(&mut bus).unwrap_err();
    assert!(error.contains("register map 4, expected 5"), "{error}");
}
