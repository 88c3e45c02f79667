//! Converts a log to evenly spaced snapshots for the time slider of the page.

use crate::error::ViewError;
use crate::snapshot::{CycleExtras, Snapshot, SnapshotBuilder};
use std::path::Path;
use supple_log::{CycleTiming, LogError, Reader, TimedMessage};
use supple_model::{Description, with_dof};

/// Maximum number of snapshots of a log; a longer log has fewer snapshots per second.
const MAX_SNAPSHOTS: usize = 4000;
/// Minimum time between two snapshots \[s\].
const MIN_INTERVAL_S: f64 = 0.02;

/// A log to show.
#[derive(Clone, Debug)]
pub struct Replay {
    /// The arm.
    pub description: Description,
    /// Name of the experiment.
    pub experiment: String,
    /// The snapshots, with times since the first cycle.
    pub snapshots: Vec<Snapshot>,
    /// Time between two snapshots \[s\].
    pub interval_s: f64,
    /// Whether the log is truncated.
    pub incomplete: bool,
}

/// Reads a log.
///
/// # Errors
/// [`ViewError::Log`] if the file is not a log with at least one cycle.
pub fn read(file: &Path) -> Result<Replay, ViewError> {
    let reader = Reader::open(file)?;
    let description = reader.description()?;
    let read = with_dof!(description.dof(), N => snapshots::<N>(&reader))?;
    let (snapshots, interval_s, incomplete) = read?;
    Ok(Replay {
        experiment: reader.metadata().experiment.clone(),
        description,
        snapshots,
        interval_s,
        incomplete,
    })
}

fn snapshots<const N: usize>(reader: &Reader) -> Result<(Vec<Snapshot>, f64, bool), LogError> {
    let mut timings = reader.timings()?;
    let mut timing: Option<TimedMessage<CycleTiming>> = None;
    let (mut snapshots, mut interval_s) = (Vec::new(), MIN_INTERVAL_S);
    let mut builder = SnapshotBuilder::<N>::default();
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
        let extras = CycleExtras {
            time_s,
            timing_us: this.map(|t| {
                [t.value.period_ns, t.value.latency_ns, t.value.step_ns].map(microseconds)
            }),
            ..CycleExtras::default()
        };
        builder.add(&record.value, extras);
        if time_s >= next_s {
            snapshots.extend(builder.take());
            next_s = time_s + interval_s - 1e-6;
            if snapshots.len() > MAX_SNAPSHOTS {
                snapshots = halved(snapshots);
                interval_s *= 2.0;
            }
        }
    }
    snapshots.extend(builder.take());
    Ok((snapshots, interval_s, incomplete))
}

/// Keeps every second snapshot, which gets the peaks of the one before it.
fn halved(snapshots: Vec<Snapshot>) -> Vec<Snapshot> {
    let mut snapshots = snapshots.into_iter();
    let mut kept = Vec::new();
    while let Some(first) = snapshots.next() {
        let Some(mut second) = snapshots.next() else {
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
