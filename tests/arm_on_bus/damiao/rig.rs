//! Test rig in one process: emulated motors, the plant loop with their drive, and the controller.

use crate::link::InProcessLink;
use supple_bus::FaultInjector;
use supple_bus::virtual_time::DirectBus;
use supple_can::drives::damiao::{DamiaoError, DamiaoLoop, start_up, with_drive};
use supple_core::controller::{Mode, Request};
use supple_core::dynamics::tip_pose;
use supple_core::nalgebra::Vector3;
use supple_core::trajectory::Sinusoid;
use supple_core::{Controller, Trajectory, Vector};
use supple_damiao::Status;
use supple_drive::{CycleConfig, Drives, Stage};
use supple_emu::damiao::{DamiaoArm, DamiaoConfig, Misbehaviour};
use supple_model::Description;
use supple_plant::PlantConfig;

pub const MS: u64 = 1_000_000;

pub type TestBus<const N: usize> = FaultInjector<DirectBus<DamiaoArm<N>>>;

pub struct Rig<const N: usize> {
    pub plant: DamiaoLoop<N, TestBus<N>, InProcessLink<N>>,
    pub description: Description,
    pub period_ns: u64,
    /// Stages in order, each once.
    pub stages: Vec<Stage>,
    /// Joint without a motor, whose speed is not checked.
    pub without_motor: Option<usize>,
    /// Maximum joint speed \[rad/s\]; the fields below have its joint, its stage, and the minimum height of the tip \[m\].
    pub max_speed_rad_per_s: f64,
    pub fastest: Option<(usize, Stage)>,
    pub min_tip_m: f64,
}

/// Creates emulated motors of an arm at standstill.
pub fn arm<const N: usize>(
    description: &Description,
    change: impl FnOnce(&mut DamiaoConfig),
    start_rad: Option<Vector<N>>,
    misbehaviours: &[&str],
) -> DamiaoArm<N> {
    let mut config = DamiaoConfig::expected(description.bus().unwrap());
    change(&mut config);
    let plant = PlantConfig::<N>::from_description(description).unwrap();
    let start_rad = start_rad.unwrap_or(description.home::<N>().unwrap());
    let stow_rad = Vector::from_column_slice(description.stow_rad().unwrap());
    let zone_rad = description.settings().limits.soft_zone_rad;
    let mut arm = DamiaoArm::new(config, plant, start_rad, Some((stow_rad, zone_rad)), 0).unwrap();
    let misbehaviours: Vec<Misbehaviour> = misbehaviours
        .iter()
        .map(|text| text.parse().unwrap())
        .collect();
    arm.misbehave(&misbehaviours).unwrap();
    arm
}

impl<const N: usize> Rig<N> {
    /// Creates an arm after start-up, with disabled motors.
    pub fn try_new(
        description: Description,
        change: impl FnOnce(&mut DamiaoConfig),
        start_rad: Option<Vector<N>>,
        misbehaviours: &[&str],
    ) -> Result<Rig<N>, DamiaoError> {
        let arm = arm(&description, change, start_rad, misbehaviours);
        let mut bus = FaultInjector::new(DirectBus(arm), 1);
        let motors = start_up::<N, _>(&mut bus, &description, &|| false)?;
        let config = description.config::<N>().unwrap();
        let period_ns = (config.period_s * 1e9).round() as u64;
        let cycle_config = CycleConfig {
            period_ns,
            answer_ns: 0,
        };
        let link = InProcessLink::new(Controller::new(config).unwrap());
        let plant = with_drive(bus, link, motors, &description, &config, cycle_config)?;
        Ok(Rig {
            plant,
            description,
            period_ns,
            stages: vec![Stage::Resting],
            without_motor: None,
            max_speed_rad_per_s: 0.0,
            fastest: None,
            min_tip_m: f64::INFINITY,
        })
    }

    pub fn new(name: &str, misbehaviours: &[&str]) -> Rig<N> {
        let description = Description::asset(name).unwrap();
        Rig::try_new(description, |_| (), None, misbehaviours).unwrap()
    }

    /// Creates an arm after start-up in this pose, with disabled motors.
    pub fn new_at(name: &str, start_rad: Vector<N>, misbehaviours: &[&str]) -> Rig<N> {
        let description = Description::asset(name).unwrap();
        Rig::try_new(description, |_| (), Some(start_rad), misbehaviours).unwrap()
    }

    pub fn arm(&self) -> &DamiaoArm<N> {
        &self.plant.drive().bus().inner().0
    }

    pub fn request(&mut self, request: Request<N>) {
        self.plant.link_mut().request = Some(request);
    }

    pub fn tip_m(&self) -> f64 {
        let config = self.description.config::<N>().unwrap();
        tip_pose(&config.arm, &self.arm().truth().position_rad)
            .translation
            .z
    }

    pub fn step(&mut self) {
        self.plant.run().unwrap();
        let stage = self.plant.guard().stage();
        let last = self.stages.last().copied();
        if last.map(|last| core::mem::discriminant(&last)) != Some(core::mem::discriminant(&stage))
        {
            self.stages.push(stage);
        }
        for joint in (0..N).filter(|joint| Some(*joint) != self.without_motor) {
            let speed = self.arm().truth().velocity_rad_per_s[joint].abs();
            if speed > self.max_speed_rad_per_s {
                self.max_speed_rad_per_s = speed;
                self.fastest = Some((joint, stage));
            }
        }
        self.min_tip_m = self.min_tip_m.min(self.tip_m());
    }

    pub fn run(&mut self, cycles: usize) {
        for _ in 0..cycles {
            self.step();
        }
    }

    pub fn run_s(&mut self, duration_s: f64) {
        self.run((duration_s * 1e9 / self.period_ns as f64).round() as usize);
    }

    /// Enters gravity hold with enabled motors, and discards earlier measurements.
    pub fn activate(&mut self) {
        self.run(5);
        self.request(Request::GravityHold);
        self.run_s(0.2);
        assert_eq!(self.plant.drives(), Drives::Active);
        assert_eq!(self.plant.guard().stage(), Stage::Active);
        assert!(self.all(Status::Enabled));
        self.discard_measurements();
    }

    /// Requests gravity hold until the motors are enabled.
    pub fn enable(&mut self) {
        self.run(5);
        self.request(Request::GravityHold);
        for _ in 0..100 {
            if self.plant.guard().stage() == Stage::Active {
                break;
            }
            self.step();
        }
        assert!(self.all(Status::Enabled));
        self.discard_measurements();
    }

    /// Starts a slow move of the elbow, or with `track` a small sinusoid about the pose, and runs it for half a second.
    pub fn begin(&mut self, track: bool) {
        let config = self.description.config::<N>().unwrap();
        let home_rad = self.description.home::<N>().unwrap();
        if track {
            let sinusoid = Sinusoid {
                centre_m: tip_pose(&config.arm, &home_rad).translation,
                amplitude_m: Vector3::new(0.03, 0.0, 0.0),
                ..Sinusoid::paper(1.0)
            };
            self.request(Request::Track(Trajectory::Sinusoid(sinusoid)));
        } else {
            let mut target_rad = home_rad;
            target_rad[3] -= 0.3;
            self.request(Request::Move {
                target_rad,
                duration_s: 3.0,
            });
        }
        // The sinusoid begins slowly.
        self.run_s(if track { 1.5 } else { 0.5 });
        let mode = self.plant.link_mut().output.unwrap().mode;
        assert_eq!(mode, if track { Mode::Track } else { Mode::Move });
        let speed = self.arm().truth().velocity_rad_per_s.amax();
        assert!(speed > 0.02, "nothing moves: {speed} rad/s");
    }

    pub fn discard_measurements(&mut self) {
        self.max_speed_rad_per_s = 0.0;
        self.min_tip_m = f64::INFINITY;
        self.fastest = None;
    }

    pub fn all(&self, status: Status) -> bool {
        self.arm()
            .motors()
            .iter()
            .all(|motor| motor.status() == status)
    }

    /// Returns the names of the stages so far.
    pub fn stage_names(&self) -> Vec<&'static str> {
        let name = |stage: &Stage| match stage {
            Stage::Resting => "resting",
            Stage::Active => "active",
            Stage::Holding(..) => "holding",
            Stage::Stowing(..) => "stowing",
            Stage::Releasing(..) => "releasing",
            Stage::Damping(..) => "damping",
            Stage::Lowering(..) => "lowering",
        };
        self.stages.iter().map(name).collect()
    }
}
