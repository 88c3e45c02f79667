//! Messages between the processes of one system, over shared memory on one machine.
//!
//! | service | message | writer | readers |
//! |---|---|---|---|
//! | `arm_state` | [`ArmState`](message::ArmState) | the plant: `supple-sim` or `supple-can` | the controller |
//! | `torque_command` | [`TorqueCommand`](message::TorqueCommand) | the controller: `supple-rt` | the plant |
//! | `wake_request` | [`WakeRequest`](message::WakeRequest) | the plant | the controller |
//! | `telemetry` | [`Telemetry`](message::Telemetry) | the controller | up to 8 |
//! | `operator_request` | [`OperatorRequest`](message::OperatorRequest) | up to 8 operators | the controller |
//! | `operator_reply` | [`OperatorReply`](message::OperatorReply) | the controller | up to 8 |
//!
//! The services are iceoryx2 publish-subscribe services. Each service has exactly one writer, except `operator_request`,
//! whose messages the controller checks before it acts on them. A writer holds a file lock and puts a random id into each
//! message; readers of states and commands discard messages with another id. Of the 8 telemetry readers and the 8
//! operators, 5 are general clients and 3 slots are reserved for the programs that run the system. Idle requests use a
//! separate socket ([`request_idle`]) and need no slot. Publishing and receiving allocate no memory; all memory
//! is allocated at the start. Only one user can access a system, and a prefix separates it from other systems, see
//! [`Domain`]. A process with another version of the messages is refused ([`IpcError::Version`]).
//!
//! ```
//! use core::time::Duration;
//! use supple_ipc::message::{ArmState, Drives, PlantReport};
//! use supple_ipc::{ControllerLink, Domain, PlantLink};
//!
//! let folder = tempfile::tempdir()?;
//! let domain = Domain::in_folder(&folder.path().join("run"), "example")?;
//! let (plant, controller) = (PlantLink::new(&domain)?, ControllerLink::new(&domain)?);
//! let position_rad = [Some(0.0), Some(-1.8), Some(0.0), None];
//! let report = PlantReport::default();
//! let state = ArmState::new(0, 0, &position_rad, None, Drives::Active, report);
//! plant.publish(&state)?;
//! let received = controller.wait(Duration::from_secs(1))?;
//! assert_eq!(received, Some(state));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

#![forbid(unsafe_code)]

mod cleanup;
mod client_slot;
mod domain;
mod error;
mod home_pose_confirmation;
mod idle;
mod join;
mod link;
mod membership;
pub mod message;
mod operator_link;
mod port;
mod shared_memory;
mod wake;
mod writer_identity;

pub use domain::{DEFAULT_PREFIX, Domain, PREFIX_VARIABLE};
pub use error::IpcError;
pub use home_pose_confirmation::HomePoseConfirmation;
pub use idle::{
    IdleAnswer, IdleServer, idle_reply, idle_socket, idle_socket_is_open, request_idle,
};
pub use link::{ControllerLink, PlantLink, ReceivedAnswer, WakeEvent};
pub use operator_link::{
    CommandSlot, OperatorClient, OperatorServer, TELEMETRY_DEPTH, TelemetryReader,
};
pub use port::Backpressure;
