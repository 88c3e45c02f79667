//! What the processes of one system say to each other, in shared memory on one machine.
//!
//! | service | message | writer | readers |
//! |---|---|---|---|
//! | `arm_state` | [`ArmState`](message::ArmState) | the plant: `supple-sim` or `supple-can` | the controller |
//! | `torque_command` | [`TorqueCommand`](message::TorqueCommand) | the controller: `supple-rt` | the plant |
//! | `plant_asleep` | [`PlantAsleep`](message::PlantAsleep) | the plant | the controller |
//! | `telemetry` | [`Telemetry`](message::Telemetry) | the controller | up to 8 |
//! | `operator_request` | [`OperatorRequest`](message::OperatorRequest) | up to 8 operators | the controller |
//! | `operator_reply` | [`OperatorReply`](message::OperatorReply) | the controller | up to 8 |
//!
//! The services are iceoryx2's. Each has one writer, requests apart: they command nothing and are checked by the
//! controller. A writer holds a lock, and its messages carry the number that it drew: readers of states and commands
//! drop those of others. Of the readers and operators, 5 may be such as look or ask for something; 3 places are kept for
//! what keeps a system running. A request for idle has a way of its own ([`ask_for_idle`]), which needs no place.
//! Publishing and receiving allocate nothing; all memory is given at the start. Everything is for
//! one user alone and apart from other systems by a prefix, see [`Domain`]; a peer of another version is
//! refused ([`IpcError::Version`]).
//!
//! ```
//! use core::time::Duration;
//! use supple_ipc::message::{ArmState, Drives, PlantReport};
//! use supple_ipc::{ControllerLink, Domain, PlantLink};
//!
//! let folder = tempfile::tempdir()?;
//! let domain = Domain::within(&folder.path().join("run"), "example")?;
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

mod bell;
mod domain;
mod error;
mod idle;
mod last_out;
mod link;
pub mod message;
mod outside;
mod place;
mod port;
mod shared_memory;
mod turn;
mod writer_identity;

pub use domain::{DEFAULT_PREFIX, Domain, PREFIX_VARIABLE};
pub use error::IpcError;
pub use idle::{IdleAnswer, IdleServer, ask_for_idle, idle_reply};
pub use link::{ControllerLink, Heard, PlantLink, Woken};
pub use outside::{Operator, OutsideLink, TELEMETRY_DEPTH, TelemetryReader, pause};
pub use port::Full;
