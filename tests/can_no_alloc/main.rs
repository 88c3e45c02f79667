//! Tests that a cycle of `supple-can` allocates no memory: with active motors, with every poll, with lost replies and frames,
//! and during shutdown. Allocations of the emulated arm in the same thread are not counted.

#[path = "../support/counting.rs"]
mod counting;
#[path = "../arm_on_bus/link.rs"]
mod link;

use counting::{count_allocations, without_counting};
use link::InProcessLink;
use supple_bus::virtual_time::DirectBus;
use supple_bus::{Bus, BusError, Event, FaultInjector, FaultKind, FaultRule, TrafficDirection};
use supple_can::{BarrettLoop, StartupConfig, start_up};
use supple_can_frame::CanFrame;
use supple_core::Controller;
use supple_core::controller::Request;
use supple_drive::{CycleConfig, Stage};
use supple_emu::{ButtonPress, Emulator, EmulatorConfig};
use supple_model::Description;
use supple_plant::PlantConfig;
use supple_puck::safety::SafetyLimits;

const MS: u64 = 1_000_000;

struct Uncounted(DirectBus<Emulator<4>>);

impl Bus for Uncounted {
    fn now_ns(&self) -> u64 {
        self.0.now_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        without_counting(|| self.0.send(frame))
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        without_counting(|| self.0.receive_until(until_ns))
    }
}

type Service = BarrettLoop<4, FaultInjector<Uncounted>, InProcessLink<4>>;

fn press(cycle: &mut Service, press: ButtonPress) {
    cycle.drive_mut().bus_mut().inner_mut().0.0.press(press);
}

fn in_service() -> Service {
    let description = Description::asset("wam4").unwrap();
    let plant = PlantConfig::<4>::from_description(&description).unwrap();
    let home_rad = description.home::<4>().unwrap();
    let mut arm = Emulator::new(EmulatorConfig::wam(4), plant, home_rad, 0).unwrap();
    arm.press(ButtonPress::Idle);
    let mut bus = FaultInjector::new(Uncounted(DirectBus(arm)), 1);
    let startup_config = StartupConfig {
        zero_at_rad: Some(home_rad),
        confirmation: None,
        limits: SafetyLimits::default(),
        tare: false,
    };
    let ready = start_up(
        &mut bus,
        &description,
        &startup_config,
        &|| false,
        &mut |_| (),
    )
    .unwrap();
    let config = description.config::<4>().unwrap();
    let cycle_config = CycleConfig {
        period_ns: MS,
        answer_ns: MS / 20,
    };
    let link = InProcessLink::new(Controller::new(config).unwrap());
    supple_can::new_plant_loop(bus, link, ready, &config, cycle_config).unwrap()
}

fn run(cycle: &mut Service, cycles: usize) {
    for _ in 0..cycles {
        cycle.run().unwrap();
    }
}

#[test]
fn the_counter_counts_allocations() {
    let boxed = || drop(std::hint::black_box(Box::new(1)));
    assert_eq!(count_allocations(boxed), 2);
    assert_eq!(count_allocations(|| without_counting(boxed)), 0);
    assert_eq!(count_allocations(|| {}), 0);
}

#[test]
fn a_thousand_cycles_allocate_nothing() {
    let mut cycle = in_service();
    cycle.link_mut().request = Some(Request::GravityHold);
    run(&mut cycle, 50);
    press(&mut cycle, ButtonPress::Activate);
    run(&mut cycle, 50);
    assert_eq!(cycle.guard().stage(), Stage::Active);
    assert_eq!(count_allocations(|| run(&mut cycle, 1000)), 0);
    assert_eq!(cycle.guard().stage(), Stage::Active);
}

#[test]
fn cycles_with_lost_frames_allocate_nothing() {
    let mut cycle = in_service();
    cycle.link_mut().request = Some(Request::GravityHold);
    run(&mut cycle, 50);
    press(&mut cycle, ButtonPress::Activate);
    run(&mut cycle, 50);
    let lost =
        FaultRule::always(TrafficDirection::Received, FaultKind::Loss).with_probability(0.01);
    cycle.drive_mut().bus_mut().add(lost);
    assert_eq!(count_allocations(|| run(&mut cycle, 100)), 0);
    let silent = FaultRule::always(TrafficDirection::Sent, FaultKind::SilentLoss);
    cycle
        .drive_mut()
        .bus_mut()
        .add(silent.only(|id| id.raw() == 0x401));
    cycle.link_mut().dead = true;
    assert_eq!(count_allocations(|| run(&mut cycle, 300)), 0);
    assert_eq!(cycle.guard().stage(), Stage::Resting);
    assert!(cycle.counters().tx_lost > 0);
}
