//! Creates the messages of a step, for logs and for live viewers.

use crate::error::LogError;
use crate::messages::{
    CycleTiming, Header, JointState, PlantTruth, Stamp, TransformStamped, WrenchStamped,
};
use crate::record::RecordWords;
use crate::scan::{Channel, Schema};
use crate::schema;
use serde::Serialize;
use std::sync::Arc;
use supple_core::Pose;
use supple_core::controller::CycleRecord;
use supple_core::math::Vector3;
use supple_model::Description;

/// Steps between two messages on `/tf`.
pub(crate) const TF_EVERY: u64 = 20;
/// Frame at the tip with the axes of the base, in which viewers draw the wrenches.
const WRENCH_FRAME: &str = "tip_base_axes";

/// Data of a step besides the controller's input and output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extras<const N: usize> {
    /// Number of the step since the controller started, if steps may be lost between the
    /// controller and the log. `None`: the writer counts the steps, because none is lost.
    pub step: Option<u64>,
    /// Measured tip force, base axes \[N\], if the controller does not receive it.
    /// `None`: the force in the controller's input.
    pub tip_force_n: Option<Vector3<f64>>,
    /// Start and duration of the cycle.
    pub timing: Option<CycleTiming>,
    /// True state of a simulated plant.
    pub truth: Option<PlantTruth<N>>,
}

/// A channel of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Topic {
    ControllerState,
    JointStates,
    WrenchExt,
    WrenchObserved,
    Tf,
    RobotDescription,
    CycleTiming,
    PlantTruth,
    ArmEvents,
}

impl Topic {
    /// Number of channels.
    pub const COUNT: usize = 9;

    /// Returns the topic, package and type.
    fn names(self) -> (&'static str, &'static str, &'static str) {
        match self {
            Topic::ControllerState => ("/controller_state", "supple_msgs", "ControllerState"),
            Topic::JointStates => ("/joint_states", "sensor_msgs", "JointState"),
            Topic::WrenchExt => ("/wrench_ext", "geometry_msgs", "WrenchStamped"),
            Topic::WrenchObserved => ("/wrench_observed", "geometry_msgs", "WrenchStamped"),
            Topic::Tf => ("/tf", "tf2_msgs", "TFMessage"),
            Topic::RobotDescription => ("/robot_description", "std_msgs", "String"),
            Topic::CycleTiming => ("/cycle_timing", "supple_msgs", "CycleTiming"),
            Topic::PlantTruth => ("/plant_truth", "supple_msgs", "PlantTruth"),
            Topic::ArmEvents => ("/arm_events", "std_msgs", "String"),
        }
    }

    /// Returns name, encoding and message definition of the channel, for an arm with `dof` joints.
    ///
    /// # Errors
    /// An error if a type is not defined.
    pub fn channel(self, dof: usize) -> Result<Channel, String> {
        let (topic, package, name) = self.names();
        let schema = Schema {
            name: format!("{package}/msg/{name}"),
            encoding: "ros2msg".into(),
            text: schema::text(&format!("{package}/{name}"), dof)?.into_bytes(),
        };
        Ok(Channel {
            topic: topic.into(),
            message_encoding: "cdr".into(),
            schema: Arc::new(schema),
        })
    }
}

/// Receiver of messages: a log or a live viewer.
pub(crate) trait MessageSink {
    /// Returns the buffer for the words of a record.
    fn words(&mut self) -> &mut Vec<u64>;

    /// Receives a message of step number `step`.
    ///
    /// # Errors
    /// An error if the message cannot be encoded or written.
    fn put<T: Serialize>(
        &mut self,
        channel: Topic,
        step: u64,
        time_ns: u64,
        value: &T,
    ) -> Result<(), LogError>;
}

/// Passes the messages of a step to `channels`, with the transforms of the links if `with_tf` is set; `base` is the base link.
///
/// # Errors
/// As [`MessageSink::put`].
pub(crate) fn emit<const N: usize>(
    channels: &mut impl MessageSink,
    (description, base): (&Description, &str),
    time_ns: u64,
    record: &CycleRecord<N>,
    extras: &Extras<N>,
    with_tf: bool,
) -> Result<(), LogError> {
    let step = record.step;
    let stamp = Stamp::from_ns(time_ns);
    let in_frame = |frame_id| Header { stamp, frame_id };
    let header = in_frame(base);

    let mut words = std::mem::take(channels.words());
    words.resize(CycleRecord::<N>::words(N), 0);
    record.pack(&mut words);
    let message = RecordWords {
        words: &words,
        joints: N,
    };
    let written = channels.put(Topic::ControllerState, step, time_ns, &(header, message));
    *channels.words() = words;
    written?;
    let joints = JointState {
        header,
        name: description.joint_names(),
        position: record.position_rad.as_slice(),
        velocity: record.velocity_rad_per_s.as_slice(),
        effort: record.torque_nm.as_slice(),
    };
    channels.put(Topic::JointStates, step, time_ns, &joints)?;
    let wrench = |force: [f64; 3]| WrenchStamped {
        header: in_frame(WRENCH_FRAME),
        force,
        torque: [0.0; 3],
    };
    let input_force = record.has_tip_force.then_some(record.tip_force_n);
    if let Some(force) = extras.tip_force_n.map(Into::into).or(input_force) {
        channels.put(Topic::WrenchExt, step, time_ns, &wrench(force))?;
    }
    if record.has_reference {
        let force = wrench(record.external_force_n);
        channels.put(Topic::WrenchObserved, step, time_ns, &force)?;
    }
    if let Some(timing) = &extras.timing {
        channels.put(Topic::CycleTiming, step, time_ns, &(header, step, timing))?;
    }
    if let Some(truth) = &extras.truth {
        channels.put(Topic::PlantTruth, step, time_ns, &(header, truth))?;
    }
    if with_tf {
        let transforms = description.transforms(record.position_rad.as_slice())?;
        let transforms = transforms.iter().map(|t| {
            let header = in_frame(t.parent);
            TransformStamped::new(header, t.child, &t.parent_from_child)
        });
        let tip = Pose::from_translation(record.tip_position_m.into());
        let tip = TransformStamped::new(header, WRENCH_FRAME, &tip);
        let transforms: Vec<_> = transforms.chain([tip]).collect();
        channels.put(Topic::Tf, step, time_ns, &transforms)?;
    }
    Ok(())
}

/// Returns the link that no joint moves.
pub(crate) fn base_frame(description: &Description, home_rad: &[f64]) -> Result<String, LogError> {
    let transforms = description.transforms(home_rad)?;
    let is_child = |name: &str| transforms.iter().any(|t| t.child == name);
    let base = transforms.iter().find(|t| !is_child(t.parent));
    Ok(base.map_or_else(|| "base".to_owned(), |t| t.parent.to_owned()))
}
