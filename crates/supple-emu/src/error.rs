//! Why an arm cannot be emulated.

use supple_bus::BusError;
use supple_model::ModelError;
use supple_plant::{InjectionError, PlantError, TraceError};
use supple_realtime::StopError;

/// What an emulator cannot be built from, or run on.
#[derive(Debug, thiserror::Error)]
pub enum EmulatorError {
    /// Not a WAM.
    #[error("the arm has {found} moving joints, pucks are emulated for 4 or 7: give wam4 or wam7")]
    Joints {
        /// Joints found.
        found: usize,
    },
    /// Pucks and joints differ in number.
    #[error("{found} pucks are configured for {expected} joints: give one for each")]
    Pucks {
        /// Pucks found.
        found: usize,
        /// Joints.
        expected: usize,
    },
    /// No list of property ids.
    #[error(
        "node {node} has firmware {version}, property ids are known from version 32: give a newer one"
    )]
    Firmware {
        /// Node number.
        node: usize,
        /// Version found.
        version: i32,
    },
    /// The motor-to-joint matrix has no inverse.
    #[error("joint_from_motor is singular: correct [motors] in the arm's TOML")]
    Transmission,
    /// The plant refuses its configuration.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The description of the arm.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The bus.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// A button press that cannot be read.
    #[error(
        "press `{text}`: expected BUTTON@SECONDS or BUTTON@held+SECONDS with one of idle, activate, e-stop, \
         release, and at most 1e6 s"
    )]
    Press {
        /// What was given.
        text: String,
    },
    /// A fault to be put into the arm.
    #[error("--inject: {0}")]
    Injection(#[from] InjectionError),
    /// A file of the trace.
    #[error(transparent)]
    Trace(#[from] TraceError),
    /// A CAN interface in virtual time.
    #[error("a CAN interface keeps its own time: leave out --virtual-time, or give unix:FOLDER")]
    VirtualInterface,
    /// Signals.
    #[error(transparent)]
    Stop(#[from] StopError),
}

impl EmulatorError {
    /// Exit code, as the command line has them: 2 wrong use, 3 a wrong arm, 6 a file, 10 the bus, 1 the
    /// system.
    pub fn code(&self) -> u8 {
        match self {
            EmulatorError::Press { .. }
            | EmulatorError::Injection(_)
            | EmulatorError::VirtualInterface => 2,
            EmulatorError::Joints { .. }
            | EmulatorError::Pucks { .. }
            | EmulatorError::Firmware { .. }
            | EmulatorError::Transmission
            | EmulatorError::Plant(_)
            | EmulatorError::Model(_) => 3,
            EmulatorError::Trace(_) => 6,
            EmulatorError::Bus(_) => 10,
            EmulatorError::Stop(_) => 1,
        }
    }
}
