//! Errors of the emulator.

use supple_bus::BusError;
use supple_model::ModelError;
use supple_plant::{InjectionError, PlantError, SimulationArgsError, TraceError};
use supple_process::Failure;

/// Errors in the configuration or operation of an emulator.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// The arm has neither 4 nor 7 movable joints.
    #[error(
        "the arm has {found} movable joints and no [bus]: the emulator has pucks for a WAM with 4 or 7 joints, and Damiao motors \
         for an arm with [bus] in its TOML; any other arm can be simulated, `supple up --plant sim`"
    )]
    Joints {
        /// Joints found.
        found: usize,
    },
    /// The numbers of pucks and joints differ.
    #[error("{found} pucks are configured for {expected} joints: configure one puck per joint")]
    Pucks {
        /// Pucks found.
        found: usize,
        /// Joints.
        expected: usize,
    },
    /// The property ids of this firmware version are unknown.
    #[error(
        "node {node} is configured with firmware {version}: property ids are known from version 32 on; \
         configure 32 or later"
    )]
    Firmware {
        /// Node number.
        node: usize,
        /// Version found.
        version: i32,
    },
    /// Motors of a type that drives each joint directly do not.
    #[error("motors of this bus drive each joint directly: remove joint_from_motor of [motors]")]
    NotDirect,
    /// A motor that the arm does not have.
    #[error("--misbehave: motor {found} does not exist, the arm has {motors}")]
    Motor {
        /// Motor given, counted from 1.
        found: usize,
        /// Number of motors.
        motors: usize,
    },
    /// An option that applies to other motors.
    #[error("{option} does not apply to the motors of this arm: leave it out")]
    NotForThisArm {
        /// The option.
        option: &'static str,
    },
    /// The arm has no `[bus]`, or no pose without torque.
    #[error("{arm} has no {section}: add it to the arm's TOML")]
    Missing {
        /// Name of the arm.
        arm: String,
        /// What is missing.
        section: &'static str,
    },
    /// The motor-to-joint matrix has no inverse.
    #[error("joint_from_motor is singular: correct [motors] in the arm's TOML")]
    Transmission,
    /// The plant rejects its configuration.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// Invalid options of the plant.
    #[error(transparent)]
    Options(#[from] SimulationArgsError),
    /// Error in the description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// Error of the bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// An invalid button press.
    #[error(
        "press `{text}`: expected BUTTON@SECONDS or BUTTON@held+SECONDS (since gravity hold began) with one of idle, \
         activate, e-stop, release, and at most 1e6 s"
    )]
    Press {
        /// Text given.
        text: String,
    },
    /// An invalid fault to inject.
    #[error("--inject: {0}")]
    Injection(#[from] InjectionError),
    /// Error in writing the trace file.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// A CAN interface was combined with virtual time.
    #[error(
        "a CAN interface runs in real time: omit --virtual-time, or use a bus over sockets, unix:FOLDER"
    )]
    VirtualInterface,
}

impl EmulatorError {
    /// Exit code, as for the command line: 2 for wrong use, 3 for a wrong arm, 6 for a file, 10 for the bus.
    pub fn code(&self) -> u8 {
        match self {
            EmulatorError::Press { .. }
            | EmulatorError::Motor { .. }
            | EmulatorError::NotForThisArm { .. }
            | EmulatorError::Injection(_)
            | EmulatorError::VirtualInterface => 2,
            EmulatorError::Joints { .. }
            | EmulatorError::Pucks { .. }
            | EmulatorError::Firmware { .. }
            | EmulatorError::Transmission
            | EmulatorError::NotDirect
            | EmulatorError::Missing { .. }
            | EmulatorError::Plant(_)
            | EmulatorError::Options(_)
            | EmulatorError::Model(_) => 3,
            EmulatorError::Trace(_) => 6,
            EmulatorError::Bus(_) => 10,
        }
    }
}

impl From<EmulatorError> for Failure {
    fn from(error: EmulatorError) -> Failure {
        Failure::new(error.code(), error)
    }
}
