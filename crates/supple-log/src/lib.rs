//! MCAP logs of a controlled arm: write, read, recover.
//!
//! One file contains a complete run: each step of the controller with its input, its output
//! and every torque term, bit for bit; the arm's URDF and TOML and the configuration in force;
//! and the joint states, wrenches and transforms that viewers draw. [`replay()`] runs the same `supple_core::step`
//! over the file again.
//!
//! Messages are ROS 2 CDR with `ros2msg` schemas, chunks are compressed with lz4. The writer writes a log under
//! `<name>.part` and renames it when it is complete; after a crash, [`recover`] makes the complete part readable.
//! The same steps give the same bytes, because this crate reads no clock.
//!
//! Do not write from a control thread: a write may wait for the disk.
//!
//! | channel | type | rate |
//! |---|---|---|
//! | `/controller_state` | `supple_msgs/msg/ControllerState` | every step |
//! | `/joint_states` | `sensor_msgs/msg/JointState` | every step |
//! | `/wrench_ext` | `geometry_msgs/msg/WrenchStamped` | every step with a measured tip force |
//! | `/wrench_observed` | `geometry_msgs/msg/WrenchStamped` | every step with a tip trajectory |
//! | `/tf` | `tf2_msgs/msg/TFMessage` | every 20th step |
//! | `/robot_description` | `std_msgs/msg/String` | once |
//! | `/cycle_timing` | `supple_msgs/msg/CycleTiming` | every step that was timed |
//! | `/plant_truth` | `supple_msgs/msg/PlantTruth` | every step of a simulated plant |
//! | `/arm_events` | `std_msgs/msg/String` | when a button is pressed or the drives change their mode |

#![forbid(unsafe_code)]

pub mod cdr;
mod config;
mod definition;
mod emit;
mod error;
mod export;
mod file;
mod info;
mod live;
mod messages;
mod parse;
mod reader;
mod record;
mod recover;
mod replay;
mod scan;
mod schema;
mod table;
mod toml_types;
mod values;
mod writer;

pub use emit::Extras;
pub use error::LogError;
pub use export::export_csv;
pub use file::LogSummary;
pub use info::{AttachmentInfo, ChannelInfo, FaultInfo, Info, ModeChange, info};
pub use live::{LiveChannel, LiveEncoder, LiveMessage};
pub use messages::{CycleTiming, PlantTruth};
pub use reader::{LogMetadata, Messages, Reader, TimedMessage};
pub use recover::{Recovery, recover, refuse_overwriting};
pub use replay::{Difference, Replay, replay};
pub use writer::{RunInfo, Writer};

pub use supple_core::controller::CycleRecord;
