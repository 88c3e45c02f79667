//! A cycle of `supple-can` allocates nothing: with active motors, with every poll, while it loses replies and
//! frames, and on the way down. The emulated arm in the same thread is not counted.

#[path = "../support/counting.rs"]
mod counting;
#[path = "../arm_on_bus/link.rs"]
mod link;

use counting::{counted, uncounted};
use link::Controlled;
use supple_bus::virtual_time::Direct;
use supple_bus::{Bus, BusError, Event, FaultInjector, FaultKind, FaultRule, Traffic};
use supple_can::guard::Stage;
use supple_can::{Cycle, Rhythm, StartUp, start_up};
use supple_core::Controller;
use supple_core::controller::Request;
use supple_emu::{Emulator, EmulatorConfig, Press};
use supple_model::Description;
use supple_plant::PlantConfig;
use supple_puck::CanFrame;
use supple_puck::safety::SafetyLimits;

const MS: u64 = 1_000_000;

struct Uncounted(Direct<Emulator<4>>);

impl Bus for Uncounted {
    fn now_ns(&self) -> u64 {
        self.0.now_ns()
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), BusError> {
        uncounted(|| self.0.send(frame))
    }

    fn receive_until(&mut self, until_ns: u64) -> Result<Option<Event>, BusError> {
        uncounted(|| self.0.receive_until(until_ns))
    }
}

type Service = Cycle<4, FaultInjector<Uncounted>, Controlled<4>>;

fn press(cycle: &mut Service, press: Press) {
    cycle.bus_mut().inner_mut().0.0.press(press);
}

fn in_service() -> Service {
    let description = Description::asset("wam4").unwrap();
    let plant = PlantConfig::<4>::from_description(&description).unwrap();
    let home_rad = description.home::<4>().unwrap();
    let mut arm = Emulator::new(EmulatorConfig::wam(4), plant, home_rad, 0).unwrap();
    arm.press(Press::Idle);
    let mut bus = FaultInjector::new(Uncounted(Direct(arm)), 1);
    let wishes = StartUp {
        zero_at_rad: Some(home_rad),
        limits: SafetyLimits::default(),
        tare: false,
    };
    let ready = start_up(&mut bus, &description, &wishes, &|| false, &mut |_| ()).unwrap();
    let config = description.config::<4>().unwrap();
    let rhythm = Rhythm {
        period_ns: MS,
        answer_ns: MS / 20,
    };
    let link = Controlled::new(Controller::new(config).unwrap());
    Cycle::new(bus, link, ready, &config, rhythm).unwrap()
}

fn run(cycle: &mut Service, cycles: usize) {
    for _ in 0..cycles {
        cycle.run().unwrap();
    }
}

#[test]
fn the_counter_counts() {
    let boxed = || drop(std::hint::black_box(Box::new(1)));
    assert_eq!(counted(boxed), 2);
    assert_eq!(counted(|| uncounted(boxed)), 0);
    assert_eq!(counted(|| {}), 0);
}

#[test]
fn a_thousand_cycles_allocate_nothing() {
    let mut cycle = in_service();
    cycle.link_mut().request = Some(Request::GravityHold);
    run(&mut cycle, 50);
    press(&mut cycle, Press::Activate);
    run(&mut cycle, 50);
    assert_eq!(cycle.guard().stage(), Stage::Active);
    assert_eq!(counted(|| run(&mut cycle, 1000)), 0);
    assert_eq!(cycle.guard().stage(), Stage::Active);
}

#[test]
fn nor_do_cycles_that_lose_things() {
    let mut cycle = in_service();
    cycle.link_mut().request = Some(Request::GravityHold);
    run(&mut cycle, 50);
    press(&mut cycle, Press::Activate);
    run(&mut cycle, 50);
    let lost = FaultRule::always(Traffic::Received, FaultKind::Loss).with_probability(0.01);
    cycle.bus_mut().add(lost);
    assert_eq!(counted(|| run(&mut cycle, 100)), 0);
    let silent = FaultRule::always(Traffic::Sent, FaultKind::SilentLoss);
    cycle.bus_mut().add(silent.only(|id| id.raw() == 0x401));
    cycle.link_mut().dead = true;
    assert_eq!(counted(|| run(&mut cycle, 300)), 0);
    assert_eq!(cycle.guard().stage(), Stage::Resting);
    assert!(cycle.counters().tx_lost > 0);
}
