//! Tests of `supple-can` with the emulated arm on a CAN interface of the kernel, at 1 kHz: wake-up, torque mode, a
//! thousand cycles, error frames, silent loss. `./ci.sh socketcan` runs it in a virtual machine that has such an
//! interface and whose clock counts instructions, so that it runs at 1 kHz at any speed of the host; elsewhere
//! `SUPPLE_CAN_INTERFACE` names an interface.

mod arm;
#[path = "../support/counting.rs"]
mod counting;
#[path = "../arm_on_bus/link.rs"]
mod link;
mod realtime;

use realtime::{HOST_PRIORITY, realtime};

use arm::Arm;
use link::InProcessLink;
use supple_bus::{BusFault, FaultInjector, FaultKind, FaultRule, SocketCan, TrafficDirection};
use supple_can::{BarrettLoop, StartupConfig, start_up};
use supple_core::Controller;
use supple_core::controller::Request;
use supple_drive::{CycleConfig, LossReason, Stage};
use supple_emu::ButtonPress;
use supple_model::Description;
use supple_puck::safety::SafetyLimits;
use supple_puck::status::MotorMode;

const PERIOD_NS: u64 = 1_000_000;
const ANSWER_NS: u64 = 50_000;
/// Number of cycles within which every safe action is complete: 20 ms.
const SAFE: usize = 20;
/// Number of cycles until a button press has reached the motors and the host: 50 ms.
const PRESSED: usize = 50;

type Service = BarrettLoop<4, FaultInjector<SocketCan>, InProcessLink<4>>;

fn run(cycle: &mut Service, cycles: usize) {
    for _ in 0..cycles {
        cycle.run().unwrap();
    }
}

/// Runs start-up as the program does; the motors are then idle.
fn in_service(interface: &str) -> Service {
    let description = Description::asset("wam4").unwrap();
    let config = description.config::<4>().unwrap();
    let mut bus = FaultInjector::new(SocketCan::open(interface).unwrap(), 1);
    let startup_config = StartupConfig {
        zero_at_rad: Some(description.home::<4>().unwrap()),
        confirmation: None,
        limits: SafetyLimits::default(),
        tare: false,
    };
    let mut progress_so_far = Vec::new();
    let ready = start_up(
        &mut bus,
        &description,
        &startup_config,
        &|| false,
        &mut |progress| {
            progress_so_far.push(progress);
        },
    );
    let ready = ready.unwrap_or_else(|error| panic!("{error}, after {progress_so_far:?}"));
    let link = InProcessLink::new(Controller::new(config).unwrap());
    let cycle_config = CycleConfig {
        period_ns: PERIOD_NS,
        answer_ns: ANSWER_NS,
    };
    supple_can::new_plant_loop(bus, link, ready, &config, cycle_config).unwrap()
}

fn activate(cycle: &mut Service, arm: &Arm) {
    arm.press(ButtonPress::Idle);
    run(cycle, PRESSED);
    arm.press(ButtonPress::Activate);
    run(cycle, PRESSED);
    assert_eq!(cycle.guard().stage(), Stage::Active);
    assert!(arm.motors_in(MotorMode::Torque));
}

#[test]
fn an_arm_on_a_kernel_can_interface_runs_and_is_set_to_idle_after_every_loss() {
    let Ok(interface) = std::env::var("SUPPLE_CAN_INTERFACE") else {
        eprintln!("skipped: SUPPLE_CAN_INTERFACE is not set; ./ci.sh socketcan provides one");
        return;
    };
    let arm = Arm::start(&interface);
    arm.press(ButtonPress::Idle);
    realtime(HOST_PRIORITY);
    let mut cycle = in_service(&interface);
    cycle.link_mut().request = Some(Request::GravityHold);
    activate(&mut cycle, &arm);

    let (before, before_rad) = (*cycle.counters(), arm.position_rad());
    let allocations = counting::count_allocations(|| run(&mut cycle, 1000));
    assert_eq!(allocations, 0);
    let counters = *cycle.counters();
    eprintln!("{counters:?}");
    assert_eq!(cycle.guard().stage(), Stage::Active);
    assert_eq!(counters.cycles - before.cycles, 1000);
    assert_eq!(counters.tx_lost, before.tx_lost);
    assert_eq!(counters.replies_lost, before.replies_lost);
    assert_eq!(counters.missed, before.missed);
    let after_rad = arm.position_rad();
    assert!((after_rad - before_rad).amax() < 2e-3, "the weight is held");
    let report = cycle.link_mut().report.unwrap();
    for (measured, truth) in report.position_rad.iter().zip(after_rad.iter()) {
        assert!((measured.unwrap() - truth).abs() < 2e-4);
    }

    // Errors that the CAN controller reports and recovers from have no effect.
    for fault in [
        BusFault::ArbitrationLost,
        BusFault::Warning,
        BusFault::Passive,
        BusFault::Protocol,
        BusFault::Overrun,
    ] {
        arm.fault(fault);
        run(&mut cycle, SAFE);
        assert_eq!(cycle.guard().stage(), Stage::Active, "{fault}");
    }
    assert_eq!(cycle.counters().overruns, 1);
    arm.fault(BusFault::BusOff);
    run(&mut cycle, SAFE);
    assert_eq!(cycle.guard().last_loss().unwrap().0, LossReason::BusOff);
    assert!(arm.motors_in(MotorMode::Idle));

    // Torque frames that are silently lost: detected in the cycle, switched to idle soon after.
    arm.fault(BusFault::Restarted);
    activate(&mut cycle, &arm);
    let lost = cycle.counters().tx_lost;
    let rule = FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss);
    cycle
        .drive_mut()
        .bus_mut()
        .add(rule.only(|id| id.raw() == 0x401));
    run(&mut cycle, 1);
    assert_eq!(cycle.counters().tx_lost, lost + 1);
    run(&mut cycle, SAFE);
    assert_eq!(
        cycle.guard().last_loss().unwrap().0,
        LossReason::NotTransmitted
    );
    assert!(arm.motors_in(MotorMode::Idle));

    // The controller stops answering.
    cycle.drive_mut().bus_mut().clear();
    activate(&mut cycle, &arm);
    cycle.link_mut().dead = true;
    run(&mut cycle, SAFE);
    assert_eq!(cycle.guard().last_loss().unwrap().0, LossReason::NoAnswer);
    assert!(arm.motors_in(MotorMode::Idle));
}
