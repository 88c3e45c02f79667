//! Writing a log, a step at a time.

use crate::cdr;
use crate::error::LogError;
use crate::file::{LogFile, SOFTWARE, Written};
use crate::messages::{
    CycleTiming, Header, JointState, PlantTruth, Stamp, TransformStamped, WrenchStamped,
};
use crate::record::RecordWords;
use crate::scan::{Channel, Schema};
use crate::schema;
use mcap::records::MessageHeader;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use supple_core::controller::CycleRecord;
use supple_core::math::Vector3;
use supple_core::{Config, Input, Output, Pose};
use supple_model::Description;

/// Steps between two messages on `/tf`.
const TF_EVERY: u64 = 20;
/// Frame at the tip with the axes of the base: the wrenches are drawn there.
const WRENCH_FRAME: &str = "tip_base_axes";

/// What a log says of its run besides the arm.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RunInfo {
    /// Name of the experiment.
    pub experiment: String,
    /// Seed of everything random in it.
    pub seed: Option<u64>,
    /// When it began \[ns\]: since the epoch, or 0 in virtual time.
    pub start_ns: u64,
    /// Whatever else belongs to it, by name.
    pub notes: BTreeMap<String, String>,
}

/// What there is of a step besides the controller's input and output.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Extras<const N: usize> {
    /// Number of the step since the controller started, where steps may be lost between the
    /// controller and the log. Default: every step is written, the writer counts.
    pub step: Option<u64>,
    /// What the force sensor measured, base axes \[N\], if the controller does not receive it.
    /// Default: the force in the controller's input.
    pub tip_force_n: Option<Vector3<f64>>,
    /// When the cycle began and how long it took.
    pub timing: Option<CycleTiming>,
    /// What was really so, where the plant is simulated.
    pub truth: Option<PlantTruth<N>>,
}

#[derive(Clone, Copy)]
enum Topic {
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
    const COUNT: usize = 9;

    /// Topic, package and type.
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
}

/// Writes a log. Dropped without [`Writer::finish`] it leaves `<name>.part`, never a file of the name.
///
/// A write allocates nothing once buffers have grown, except on `/tf` and where a request, a fault or a
/// refusal is there; it may wait for the disk.
pub struct Writer<const N: usize> {
    channels: Channels,
    description: Description,
    base: String,
    next_step: u64,
    written: u64,
    events: u64,
}

impl<const N: usize> Writer<N> {
    /// Begins the log `path`, written as `<path>.part` until it is finished.
    ///
    /// `config` is the configuration in force, which may differ from that of `description`.
    ///
    /// # Errors
    /// [`LogError::Create`], [`LogError::Busy`] or [`LogError::Write`]; [`LogError::Model`] where the
    /// description has not `N` joints.
    pub fn create(
        path: impl AsRef<Path>,
        description: &Description,
        config: &Config<N>,
        run: &RunInfo,
    ) -> Result<Self, LogError> {
        let home = description.home::<N>()?;
        let base = base_frame(description, home.as_slice())?;
        let mut file = LogFile::create(path.as_ref(), ".part")?;
        let controller =
            crate::config::to_toml(config).map_err(|error| file.unwritable(error.to_string()))?;
        file.metadata("supple", about(description, run))?;
        if !run.notes.is_empty() {
            file.metadata("notes", run.notes.clone())?;
        }
        let start_ns = run.start_ns;
        let mut attach =
            |name, media_type, text: &str| file.attach(name, media_type, start_ns, text.as_bytes());
        attach("arm.urdf", "application/xml", description.urdf())?;
        attach("arm.toml", "application/toml", description.toml())?;
        attach("controller.toml", "application/toml", &controller)?;
        let mut channels = Channels {
            file,
            ids: [None; Topic::COUNT],
            dof: N,
            buffer: Vec::new(),
            words: Vec::new(),
        };
        channels.put(Topic::RobotDescription, 0, start_ns, &description.urdf())?;
        Ok(Writer {
            channels,
            description: description.clone(),
            base,
            next_step: 0,
            written: 0,
            events: 0,
        })
    }

    /// One step. `time_ns` is the time of the measurement: since the epoch, or since the start in
    /// virtual time.
    ///
    /// # Errors
    /// [`LogError::Write`]; everything after it fails too.
    pub fn write(
        &mut self,
        time_ns: u64,
        input: &Input<N>,
        output: &Output<N>,
        extras: &Extras<N>,
    ) -> Result<(), LogError> {
        let step = extras.step.unwrap_or(self.next_step);
        self.write_record(time_ns, &CycleRecord::new(step, input, output), extras)
    }

    /// One step that is a record already, such as another process has sent; `extras.step` has no say.
    ///
    /// # Errors
    /// As [`Writer::write`].
    pub fn write_record(
        &mut self,
        time_ns: u64,
        record: &CycleRecord<N>,
        extras: &Extras<N>,
    ) -> Result<(), LogError> {
        let step = record.step;
        self.next_step = step.saturating_add(1);
        let channels = &mut self.channels;
        channels.file.close_chunk_if_due(time_ns)?;
        let stamp = Stamp::from_ns(time_ns);
        let in_frame = |frame_id| Header { stamp, frame_id };
        let header = in_frame(&self.base);

        let mut words = std::mem::take(&mut channels.words);
        words.resize(CycleRecord::<N>::words(N), 0);
        record.pack(&mut words);
        let message = RecordWords {
            words: &words,
            joints: N,
        };
        let written = channels.put(Topic::ControllerState, step, time_ns, &(header, message));
        channels.words = words;
        written?;
        let joints = JointState {
            header,
            name: self.description.joint_names(),
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
        if self.written.is_multiple_of(TF_EVERY) {
            let transforms = self
                .description
                .transforms(record.position_rad.as_slice())?;
            let transforms = transforms.iter().map(|t| {
                let header = in_frame(t.parent);
                TransformStamped::new(header, t.child, &t.parent_from_child)
            });
            let tip = Pose::from_translation(record.tip_position_m.into());
            let tip = TransformStamped::new(header, WRENCH_FRAME, &tip);
            let transforms: Vec<_> = transforms.chain([tip]).collect();
            channels.put(Topic::Tf, step, time_ns, &transforms)?;
        }
        self.written += 1;
        Ok(())
    }

    /// What happened to the arm besides, such as a button of its pendant, with its time as in
    /// [`Writer::write`]. It may be written late: the file has it at this place, with its own time.
    ///
    /// # Errors
    /// [`LogError::Write`].
    pub fn event(&mut self, time_ns: u64, text: &str) -> Result<(), LogError> {
        self.channels.file.close_chunk_if_due(time_ns)?;
        self.events += 1;
        let number = self.events - 1;
        self.channels.put(Topic::ArmEvents, number, time_ns, &text)
    }

    /// Writes the index, waits for the disk and gives the file its name; an older file of that name is
    /// replaced.
    ///
    /// # Errors
    /// [`LogError::Write`]; the file then keeps its `.part`.
    pub fn finish(self) -> Result<Written, LogError> {
        self.channels.file.finish()
    }
}

struct Channels {
    file: LogFile,
    ids: [Option<u16>; Topic::COUNT],
    dof: usize,
    buffer: Vec<u8>,
    /// Words of a record, while it is written.
    words: Vec<u64>,
}

impl Channels {
    fn put<T: Serialize>(
        &mut self,
        channel: Topic,
        step: u64,
        time_ns: u64,
        value: &T,
    ) -> Result<(), LogError> {
        let channel_id = match self.ids[channel as usize] {
            Some(id) => id,
            None => self.open(channel)?,
        };
        cdr::encode(value, &mut self.buffer).map_err(|error| self.file.unwritable(error))?;
        let header = MessageHeader {
            channel_id,
            sequence: step as u32,
            log_time: time_ns,
            publish_time: time_ns,
        };
        self.file.message(&header, &self.buffer)
    }

    fn open(&mut self, channel: Topic) -> Result<u16, LogError> {
        let (topic, package, name) = channel.names();
        let text = schema::text(&format!("{package}/{name}"), self.dof);
        let text = text.map_err(|message| self.file.unwritable(message))?;
        let schema = Schema {
            name: format!("{package}/msg/{name}"),
            encoding: "ros2msg".into(),
            text: text.into_bytes(),
        };
        let id = self.file.channel(&Channel {
            topic: topic.into(),
            message_encoding: "cdr".into(),
            schema: Arc::new(schema),
        })?;
        self.ids[channel as usize] = Some(id);
        Ok(id)
    }
}

/// The link that no joint moves.
fn base_frame(description: &Description, home_rad: &[f64]) -> Result<String, LogError> {
    let transforms = description.transforms(home_rad)?;
    let is_child = |name: &str| transforms.iter().any(|t| t.child == name);
    let base = transforms.iter().find(|t| !is_child(t.parent));
    Ok(base.map_or_else(|| "base".to_owned(), |t| t.parent.to_owned()))
}

fn about(description: &Description, run: &RunInfo) -> BTreeMap<String, String> {
    let mut about = BTreeMap::from([
        ("software".to_owned(), SOFTWARE.to_owned()),
        ("arm".to_owned(), description.name().to_owned()),
        ("joints".to_owned(), description.joint_names().join(" ")),
        ("experiment".to_owned(), run.experiment.clone()),
        ("start_ns".to_owned(), run.start_ns.to_string()),
    ]);
    if let Some(seed) = run.seed {
        about.insert("seed".to_owned(), seed.to_string());
    }
    about
}
