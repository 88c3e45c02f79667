//! Test rig in one process: the emulated arm, the cycle of `supple-can` and the controller.

use crate::link::InProcessLink;
use supple_bus::FaultInjector;
use supple_bus::virtual_time::{DirectBus, EmulatedNodes};
use supple_can::{BarrettLoop, CanError, Ready, StartupConfig, start_up};
use supple_core::controller::Request;
use supple_core::{Controller, Vector};
use supple_drive::{Action, CycleConfig, Stage};
use supple_emu::{ButtonPress, Emulator, EmulatorConfig};
use supple_model::Description;
use supple_plant::PlantConfig;
use supple_puck::safety::{SafetyLimits, SpeedLimit};
use supple_puck::status::MotorMode;

pub const MS: u64 = 1_000_000;
pub const PERIOD_NS: u64 = MS;
pub const ANSWER_NS: u64 = MS / 20;

pub type TestBus<const N: usize> = FaultInjector<DirectBus<Emulator<N>>>;

pub fn description(joints: usize) -> Description {
    Description::asset(if joints == 4 { "wam4" } else { "wam7" }).unwrap()
}

pub fn emulator<const N: usize>(config: EmulatorConfig, pose: Vector<N>) -> Emulator<N> {
    let plant = PlantConfig::from_description(&description(N)).unwrap();
    Emulator::new(config, plant, pose, 0).unwrap()
}

pub fn bus<const N: usize>(emulator: Emulator<N>) -> TestBus<N> {
    seeded_bus(emulator, 1)
}

fn seeded_bus<const N: usize>(emulator: Emulator<N>, seed: u64) -> TestBus<N> {
    FaultInjector::new(DirectBus(emulator), seed)
}

/// Start-up configuration of an arm in its home pose (`--zero-at-home`).
pub fn startup_config<const N: usize>() -> StartupConfig<N> {
    StartupConfig {
        zero_at_rad: Some(description(N).home::<N>().unwrap()),
        confirmation: None,
        limits: SafetyLimits {
            speed_fault: SpeedLimit::from_m_per_s(2.0).ok(),
            ..SafetyLimits::default()
        },
        tare: false,
    }
}

pub fn try_start<const N: usize>(
    bus: &mut TestBus<N>,
    startup_config: &StartupConfig<N>,
) -> Result<Ready<N>, CanError> {
    start_up(bus, &description(N), startup_config, &|| false, &mut |_| ())
}

pub struct Rig<const N: usize> {
    pub cycle: BarrettLoop<N, TestBus<N>, InProcessLink<N>>,
    /// Torque of each motor at the end of every cycle \[N m\], with the bus time \[ns\].
    pub history: Vec<(u64, Vector<N>)>,
}

impl<const N: usize> Rig<N> {
    /// Creates an arm after start-up, with idle motors.
    pub fn new() -> Rig<N> {
        Rig::seeded(1)
    }

    /// Creates an arm as [`Rig::new`] does, with a seed for the fault injector.
    pub fn seeded(seed: u64) -> Rig<N> {
        Rig::set_up(description(N).home::<N>().unwrap(), PERIOD_NS, seed)
    }

    /// Creates an arm as [`Rig::new`] does, in another pose and with another period.
    pub fn at(pose: Vector<N>, period_ns: u64) -> Rig<N> {
        Rig::set_up(pose, period_ns, 1)
    }

    fn set_up(pose: Vector<N>, period_ns: u64, seed: u64) -> Rig<N> {
        let mut emulator = emulator(EmulatorConfig::wam(N), pose);
        emulator.press(ButtonPress::Idle);
        let mut bus = seeded_bus(emulator, seed);
        let startup_config = StartupConfig {
            zero_at_rad: Some(pose),
            confirmation: None,
            ..startup_config()
        };
        let ready = try_start(&mut bus, &startup_config).unwrap();
        let mut config = description(N).config::<N>().unwrap();
        config.period_s = period_ns as f64 * 1e-9;
        let link = InProcessLink::new(Controller::new(config).unwrap());
        let cycle_config = CycleConfig {
            period_ns,
            answer_ns: ANSWER_NS,
        };
        let cycle = supple_can::new_plant_loop(bus, link, ready, &config, cycle_config).unwrap();
        Rig {
            cycle,
            history: Vec::new(),
        }
    }

    /// Creates an arm in gravity hold with the motors in torque mode.
    pub fn holding() -> Rig<N> {
        let mut rig = Rig::new();
        rig.activate();
        rig
    }

    pub fn activate(&mut self) {
        self.request(Request::GravityHold);
        self.run(50);
        self.emulator_mut().press(ButtonPress::Activate);
        self.run(50);
        assert_eq!(self.cycle.guard().stage(), Stage::Active);
        assert!(self.motors_in(MotorMode::Torque));
    }

    pub fn emulator(&self) -> &Emulator<N> {
        &self.cycle.drive().bus().inner().0
    }

    pub fn emulator_mut(&mut self) -> &mut Emulator<N> {
        &mut self.cycle.drive_mut().bus_mut().inner_mut().0
    }

    pub fn now_ns(&self) -> u64 {
        self.emulator().now_ns()
    }

    /// Sends a request with the next arm state.
    pub fn request(&mut self, request: Request<N>) {
        self.cycle.link_mut().request = Some(request);
    }

    pub fn step(&mut self) -> Action {
        let action = self.cycle.run().unwrap();
        let torque_nm = self.emulator().motor_torque_nm();
        self.history.push((self.now_ns(), torque_nm));
        action
    }

    pub fn run(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.step();
        }
    }

    pub fn motors_in(&self, mode: MotorMode) -> bool {
        self.emulator()
            .pucks()
            .iter()
            .all(|puck| puck.mode() == mode)
    }
}
