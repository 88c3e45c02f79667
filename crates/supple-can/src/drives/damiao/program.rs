//! A run with Damiao motors.

use super::Motor;
use super::drive::{Damiao, budget};
use super::error::DamiaoError;
use super::start_up::{differing_torque_constants, rates, start_up};
use crate::options::{Options, print_budget};
use crate::run::{Startup, run_arm};
use std::path::PathBuf;
use supple_bus::{Bus, BusError};
use supple_can_frame::BitRates;
use supple_core::{Config, Vector};
use supple_drive::{Counters, CycleConfig, Link, PlantLoop, SharedMemoryLink, StowConfig};
use supple_ipc::Domain;
use supple_model::{Description, MotorConstants, with_dof};
use supple_realtime::{Stop, diagnostics};

/// Speed of the joints while the arm is laid down \[rad/s\].
const STOW_SPEED_RAD_PER_S: f64 = 0.4;
/// Time for which the arm is held before it is laid down \[s\].
const HOLD_S: f64 = 0.5;
/// Share of the stiffness of the move mode that lays the arm down: its friction must not stop it half way.
const STOW_STIFFNESS_SHARE: f64 = 0.25;

/// How an arm with these motors is held and laid down.
///
/// # Errors
/// If the description does not fit `N` joints.
pub fn stow_config<const N: usize>(
    description: &Description,
    config: &Config<N>,
) -> Result<StowConfig<N>, DamiaoError> {
    let bus = description.bus().ok_or_else(|| DamiaoError::NoMotors {
        arm: description.name().to_owned(),
    })?;
    let stow_rad = description
        .stow_rad()
        .map(|angles| Vector::from_fn(|joint, _| angles.get(joint).copied().unwrap_or_default()));
    Ok(StowConfig {
        stow_rad,
        damping_nm_s_per_rad: Vector::from_fn(|joint, _| {
            bus.motors[joint].hold_damping_nm_s_per_rad
        }),
        stiffness_nm_per_rad: config.move_gains.stiffness_nm_per_rad * STOW_STIFFNESS_SHARE,
        speed_rad_per_s: STOW_SPEED_RAD_PER_S,
        hold_s: HOLD_S,
    })
}

/// The plant loop of an arm with these motors.
pub type DamiaoLoop<const N: usize, B, L> = PlantLoop<N, Damiao<N, B>, L>;

/// The plant loop of an arm whose motors have completed start-up.
///
/// # Errors
/// [`DamiaoError::Rate`] if the period is too short for the bus.
pub fn with_drive<const N: usize, B: Bus, L: Link<N>>(
    bus: B,
    link: L,
    motors: [super::Motor; N],
    description: &Description,
    config: &Config<N>,
    cycle_config: CycleConfig,
) -> Result<DamiaoLoop<N, B, L>, DamiaoError> {
    let of_bus = description.bus().ok_or_else(|| DamiaoError::NoMotors {
        arm: description.name().to_owned(),
    })?;
    let stow = stow_config(description, config)?;
    let drive = Damiao::new(bus, rates(of_bus), motors, config.period_s);
    let plant = PlantLoop::new(drive, link, config, cycle_config, Some(stow))?;
    Ok(plant)
}

/// Runs an arm until the end of the program; returns the counters if start-up succeeded.
///
/// # Errors
/// [`DamiaoError`] with the mismatch and the remedy.
pub fn run(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Option<Counters>, DamiaoError> {
    with_dof!(description.dof(), N => run_joints::<N>(description, options, stop))?
}

fn run_joints<const N: usize>(
    description: &Description,
    options: &Options,
    stop: &Stop,
) -> Result<Option<Counters>, DamiaoError> {
    let config = description.config::<N>()?;
    let cycle_config = CycleConfig {
        period_ns: (config.period_s * 1e9).round() as u64,
        answer_ns: options.answer_us * 1_000,
    };
    check_rate(description, N, cycle_config, options.budget)?;
    if options.budget {
        return Ok(None);
    }
    let domain = Domain::new(Some(&options.process.prefix))?;
    let mut startup = Motors {
        description,
        config: &config,
        cycle_config,
        motors_file: domain.motors_file(),
    };
    run_arm(&mut startup, &domain, &config, options, stop).map(Some)
}

/// Start-up of the motors.
struct Motors<'a, const N: usize> {
    description: &'a Description,
    config: &'a Config<N>,
    cycle_config: CycleConfig,
    motors_file: PathBuf,
}

impl<const N: usize> Motors<'_, N> {
    /// Stores what the registers state, for a calibration. The arm runs without this file, too.
    fn store(&self, motors: &[Motor; N]) {
        let described = self.description.bus().into_iter();
        let described = described.flat_map(|bus| bus.motors.iter());
        let constants = described.zip(motors).map(|(described, motor)| {
            let registers = &motor.torque_registers;
            MotorConstants {
                joint: described.joint.clone(),
                model: described.model.clone(),
                kt_nm_per_a: registers.kt_nm_per_a,
                pole_pairs: registers.pole_pairs,
                flux_wb: registers.flux_wb,
                gear_ratio: registers.gear_ratio,
                torque_constant_nm_per_a: registers.torque_constant_nm_per_a(),
            }
        });
        if let Err(error) = MotorConstants::write(&self.motors_file, constants.collect()) {
            diagnostics::post(format_args!("supple-can: warning: {error}"));
        }
    }
}

impl<const N: usize> Startup<N> for Motors<'_, N> {
    type Drive = Damiao<N, Box<dyn Bus>>;
    type Ready = [Motor; N];
    type Error = DamiaoError;

    fn prepare(
        &mut self,
        bus: &mut Box<dyn Bus>,
        _: bool,
        stop: &Stop,
    ) -> Result<[Motor; N], DamiaoError> {
        let stop_requested = || stop.shutdown_requested();
        let motors = start_up::<N, _>(bus, self.description, &stop_requested)?;
        report_torque_constants(&motors, self.description);
        self.store(&motors);
        diagnostics::post(format_args!(
            "supple-can: {N} motors ready; the arm has no brakes: support it, or let it lie, until gravity hold"
        ));
        Ok(motors)
    }

    fn may_recover(error: &DamiaoError) -> bool {
        matches!(
            error,
            DamiaoError::Refused { .. }
                | DamiaoError::BusFault(_)
                | DamiaoError::Bus(BusError::Full)
        )
    }

    fn plant_loop(
        &self,
        bus: Box<dyn Bus>,
        link: SharedMemoryLink,
        motors: [Motor; N],
        first: bool,
    ) -> Result<DamiaoLoop<N, Box<dyn Bus>, SharedMemoryLink>, DamiaoError> {
        let mut plant = with_drive(
            bus,
            link,
            motors,
            self.description,
            self.config,
            self.cycle_config,
        )?;
        if !first {
            plant.drive_mut().latch();
        }
        Ok(plant)
    }

    fn into_bus(drive: Self::Drive) -> Box<dyn Bus> {
        drive.into_bus()
    }
}

/// Posts the torque constants of the motors, and a warning for each motor that differs from others of its model.
fn report_torque_constants<const N: usize>(motors: &[Motor; N], description: &Description) {
    let Some(bus) = description.bus() else {
        return;
    };
    let constants: Vec<String> = motors
        .iter()
        .map(|motor| format!("{:.3}", motor.torque_registers.torque_constant_nm_per_a()))
        .collect();
    diagnostics::post(format_args!(
        "supple-can: torque constants by the motors' registers: {} N m/A",
        constants.join(", ")
    ));
    for (joint, first) in differing_torque_constants(motors, bus) {
        let names = [joint, first].map(|index| bus.motors[index].joint.as_str());
        let [own, other] =
            [joint, first].map(|index| motors[index].torque_registers.torque_constant_nm_per_a());
        diagnostics::post(format_args!(
            "supple-can: warning: by its registers the {} of {} has {own:.3} N m/A, that of {} {other:.3}: check its calibration with \
             `supple motors`; a weight of known mass shows its true torque",
            bus.motors[joint].model, names[0], names[1]
        ));
    }
}

/// Checks the rate before the bus is opened; prints its arithmetic if `shown`.
fn check_rate(
    description: &Description,
    joints: usize,
    cycle_config: CycleConfig,
    shown: bool,
) -> Result<(), DamiaoError> {
    let bus = description.bus().ok_or_else(|| DamiaoError::NoMotors {
        arm: description.name().to_owned(),
    })?;
    let budget = budget(rates(bus), joints);
    let budget = budget.off_bus_time("the controller's answer", cycle_config.answer_ns);
    if shown {
        print_budget(&budget.display(cycle_config.period_ns));
        let other = match rates(bus).has_fd() {
            true => BitRates::CLASSIC_1M,
            false => BitRates::FD_1M_5M,
        };
        let other = super::budget(other, joints);
        let other = other.off_bus_time("the controller's answer", cycle_config.answer_ns);
        print_budget(&"\nWith the motors set to the other format:");
        print_budget(&other.display(cycle_config.period_ns));
    }
    Ok(budget.check(cycle_config.period_ns)?)
}
