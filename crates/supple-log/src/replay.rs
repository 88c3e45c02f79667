//! Replay: runs the controller over a log again, and compares its outputs bit for bit.
//!
//! Configuration, inputs and outputs come from the log itself. Every logged output, with
//! every torque term, is compared bit for bit; timing and the true state of the plant are not outputs of the controller
//! and are not compared.

use crate::cdr;
use crate::error::LogError;
use crate::messages::{Header, Stamp};
use crate::reader::Reader;
use crate::record::RecordWords;
use crate::{definition, schema, table::Table};
use serde::Serialize;
use std::fmt;
use std::path::{Path, PathBuf};
use supple_core::controller::CycleRecord;
use supple_core::{Controller, State, step};
use supple_model::with_dof;

/// Type of a step's message.
const RECORD: &str = "supple_msgs/ControllerState";

/// Result of a replay.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Replay {
    /// Log.
    pub file: PathBuf,
    /// Number of replayed steps.
    pub steps: u64,
    /// Number of steps whose output differs from the logged one in any bit.
    pub different_steps: u64,
    /// First difference.
    pub first_difference: Option<Difference>,
}

/// A difference between a logged and a replayed output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Difference {
    /// Step of the controller.
    pub step: u64,
    /// Time of the step \[ns\].
    pub time_ns: u64,
    /// First field that differs, as `supple log export` names it.
    pub field: String,
    /// Value in the log.
    pub logged: String,
    /// Value in the replay.
    pub replayed: String,
}

/// Runs the controller over a log again.
///
/// # Errors
/// [`LogError::Gap`] if steps are missing, because the state after them is unknown;
/// [`LogError::Incomplete`] if the file is truncated; [`LogError::Format`] if it contains a configuration
/// or a request that this version does not have.
pub fn replay(path: &Path) -> Result<Replay, LogError> {
    let reader = Reader::open(path)?;
    with_dof!(reader.metadata().joints.len(), N => run::<N>(&reader))?
}

fn run<const N: usize>(reader: &Reader) -> Result<Replay, LogError> {
    let file = reader.path();
    let broken = |message: String| LogError::Format {
        file: file.display().to_string(),
        message,
    };
    let controller = Controller::new(reader.config::<N>()?)
        .map_err(|error| broken(format!("controller.toml: {error}")))?;
    let mut state = State::new(&controller);
    let mut replay = Replay {
        file: file.to_owned(),
        steps: 0,
        different_steps: 0,
        first_difference: None,
    };
    let present = reader.present()?;
    for read in reader.records::<N>()? {
        let read = read?;
        let (time_ns, logged) = (read.time_ns, read.value);
        if logged.step != replay.steps {
            return Err(LogError::Gap {
                file: file.display().to_string(),
                expected: replay.steps,
                found: logged.step,
            });
        }
        let input = logged
            .input()
            .map_err(|message| broken(format!("step {}: {message}", logged.step)))?;
        let output = step(&controller, &mut state, &input);
        let mut again = CycleRecord::new(logged.step, &input, &output);
        // Messages may change between versions, so only the numbers in them are compared.
        if again.fault == logged.fault {
            again.fault_text = logged.fault_text;
        }
        if again.refusal == logged.refusal {
            again.refusal_text = logged.refusal_text;
        }
        let (logged_words, mut again_words) = (packed(&logged), packed(&again));
        if let Some(present) = &present {
            present.restore_absent(&logged_words, &mut again_words);
        }
        replay.steps += 1;
        let encoded = |words: &[u64]| encoded(time_ns, words, N);
        let (logged, again) = (encoded(&logged_words), encoded(&again_words));
        let (logged, again) = (logged.map_err(broken)?, again.map_err(broken)?);
        if logged != again {
            replay.different_steps += 1;
            if replay.first_difference.is_none() {
                let found = difference::<N>(&reader.metadata().joints, &logged, &again);
                let [field, logged, replayed] = found.map_err(broken)?;
                replay.first_difference = Some(Difference {
                    step: replay.steps - 1,
                    time_ns,
                    field,
                    logged,
                    replayed,
                });
            }
        }
    }
    Ok(replay)
}

fn packed<const N: usize>(record: &CycleRecord<N>) -> Vec<u64> {
    let mut words = vec![0; CycleRecord::<N>::words(N)];
    record.pack(&mut words);
    words
}

/// Encodes a record as a message; two messages are equal if and only if the records are equal bit for bit.
fn encoded(time_ns: u64, words: &[u64], joints: usize) -> Result<Vec<u8>, String> {
    let header = Header {
        stamp: Stamp::from_ns(time_ns),
        frame_id: "",
    };
    let mut bytes = Vec::new();
    let message = RecordWords { words, joints };
    cdr::encode(&(header, message), &mut bytes).map_err(|error| error.to_string())?;
    Ok(bytes)
}

fn difference<const N: usize>(
    joints: &[String],
    logged: &[u8],
    replayed: &[u8],
) -> Result<[String; 3], String> {
    let definitions = definition::parse(RECORD, &schema::text(RECORD, N)?)?;
    let table = Table::new(&definitions, logged, joints)?;
    let found = table.difference(logged, replayed)?;
    found.ok_or_else(|| "two messages differ in no field".to_owned())
}

impl fmt::Display for Replay {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (file, steps) = (self.file.display(), self.steps);
        match &self.first_difference {
            None => write!(
                f,
                "{file}: {steps} steps replayed, the same to the last bit"
            ),
            Some(first) => write!(
                f,
                "{file}: {} of {steps} steps differ, first step {} at {} ns in {}: {} in the log, {} now",
                self.different_steps,
                first.step,
                first.time_ns,
                first.field,
                first.logged,
                first.replayed
            ),
        }
    }
}
