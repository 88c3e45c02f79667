//! A log as pictures, evenly spaced, for the page's time slider.

use crate::error::ViewError;
use crate::frame::{Beside, Frame, Reducer};
use std::path::Path;
use supple_log::{CycleTiming, LogError, Reader, Timed};
use supple_model::{Description, with_dof};

/// Most pictures of a log; a longer one has fewer pictures a second.
const MAX_FRAMES: usize = 4000;
/// Least time between two pictures \[s\].
const MIN_INTERVAL_S: f64 = 0.02;

/// A log to show.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The arm.
    pub description: Description,
    /// Name of the experiment.
    pub experiment: String,
    /// The pictures; their time is counted from the first cycle.
    pub frames: Vec<Frame>,
    /// Time between two pictures \[s\].
    pub interval_s: f64,
    /// The log stops before its end.
    pub incomplete: bool,
}

/// Reads a log.
///
/// # Errors
/// [`ViewError::Log`] if it is no log with at least one cycle.
pub fn read(file: &Path) -> Result<Replay, ViewError> {
    let reader = Reader::open(file)?;
    let description = reader.description()?;
    let read = with_dof!(description.dof(), N => frames::<N>(&reader))?;
    let (frames, interval_s, incomplete) = read?;
    Ok(Replay {
        experiment: reader.about().experiment.clone(),
        description,
        frames,
        interval_s,
        incomplete,
    })
}

fn frames<const N: usize>(reader: &Reader) -> Result<(Vec<Frame>, f64, bool), LogError> {
    let mut timings = reader.timings()?;
    let mut timing: Option<Timed<CycleTiming>> = None;
    let (mut frames, mut interval_s) = (Vec::new(), MIN_INTERVAL_S);
    let mut reducer = Reducer::<N>::default();
    let (mut start_ns, mut next_s) = (None, 0.0);
    let mut incomplete = false;
    for record in reader.records::<N>()? {
        let record = match record {
            Ok(record) => record,
            Err(LogError::Incomplete { .. }) => {
                incomplete = true;
                break;
            }
            Err(error) => return Err(error),
        };
        while timing.as_ref().is_none_or(|t| t.time_ns < record.time_ns) {
            match timings.next() {
                Some(Ok(next)) => timing = Some(next),
                _ => break,
            }
        }
        let start_ns = *start_ns.get_or_insert(record.time_ns);
        let time_s = record.time_ns.saturating_sub(start_ns) as f64 / 1e9;
        let this = timing.as_ref().filter(|t| t.time_ns == record.time_ns);
        let microseconds = |ns: u64| ns as f64 / 1e3;
        let beside = Beside {
            time_s,
            timing_us: this.map(|t| {
                [t.value.period_ns, t.value.latency_ns, t.value.step_ns].map(microseconds)
            }),
            ..Beside::default()
        };
        reducer.add(&record.value, beside);
        if time_s >= next_s {
            frames.extend(reducer.take());
            next_s = time_s + interval_s - 1e-6;
            if frames.len() > MAX_FRAMES {
                frames = halved(frames);
                interval_s *= 2.0;
            }
        }
    }
    frames.extend(reducer.take());
    Ok((frames, interval_s, incomplete))
}

/// Every second picture, with the peaks of the one before it.
fn halved(frames: Vec<Frame>) -> Vec<Frame> {
    let mut frames = frames.into_iter();
    let mut kept = Vec::new();
    while let Some(first) = frames.next() {
        let Some(mut second) = frames.next() else {
            kept.push(first);
            break;
        };
        second.tip_error_m = match (first.tip_error_m, second.tip_error_m) {
            (Some(a), Some(b)) => Some(a.max(b)),
            (a, b) => a.or(b),
        };
        let size = |force: [f32; 3]| force.iter().map(|part| part * part).sum::<f32>();
        if size(first.force_n) > size(second.force_n) {
            second.force_n = first.force_n;
        }
        second.timing_us = match (first.timing_us, second.timing_us) {
            (Some(a), Some(b)) => Some(core::array::from_fn(|i| a[i].max(b[i]))),
            (a, b) => a.or(b),
        };
        second.refusal = second.refusal.or(first.refusal);
        kept.push(second);
    }
    kept
}
