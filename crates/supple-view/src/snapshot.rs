//! A snapshot of the system: the latest cycle, with the maximum of error, force and times since the previous snapshot, and
//! whether any cycle since then had contact, so that no peak is lost between two snapshots.

use crate::remedy::remedy;
use serde::Serialize;
use supple_core::codes::{fault_name, refusal_kind};
use supple_core::controller::CycleRecord;
use supple_core::math::Vector;

/// Data of a cycle that its record does not contain.
#[derive(Clone, Copy, Debug, Default)]
pub struct CycleExtras {
    /// Time of the measurement, on any clock \[s\].
    pub time_s: f64,
    /// Period since the previous cycle, latency from the measurement to the start of the step, duration of the step \[us\].
    pub timing_us: Option<[f64; 3]>,
    /// Time from the state to its answer \[us\]; 0 if unknown.
    pub round_trip_us: f64,
    /// Number of cycles without an answer since the start.
    pub missed: u64,
    /// Whether the plant holds the arm or lays it down.
    pub held: bool,
}

/// A fault as text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FaultText {
    /// Name of the fault.
    pub name: &'static str,
    /// Description of the fault.
    pub text: String,
    /// Remedy.
    pub remedy: &'static str,
}

/// State of the system at one time, as the page receives it. Lists have one entry per joint; positions are in base axes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Snapshot {
    /// Time of the measurement \[s\].
    pub time_s: f64,
    /// Cycle number.
    pub cycle: u64,
    /// Mode of the controller.
    pub mode: &'static str,
    /// Whether the drives apply torques, either of the controller or of the plant that holds the arm or lays it down.
    pub drives_active: bool,
    /// Joint angles \[rad\].
    pub joints_rad: Vec<f32>,
    /// Position of the tip \[m\].
    pub tip_m: [f32; 3],
    /// Reference position of the tip \[m\].
    pub reference_m: Option<[f32; 3]>,
    /// Maximum distance of the tip from its reference since the previous snapshot \[m\].
    pub tip_error_m: Option<f32>,
    /// Maximum force on the tip since the previous snapshot \[N\]: measured, or observed if there is no sensor.
    pub force_n: [f32; 3],
    /// Whether a sensor measured this force.
    pub force_is_measured: bool,
    /// Whether contact was latched in any cycle since the previous snapshot.
    pub in_contact: bool,
    /// Joint torques \[N m\].
    pub torque_nm: Vec<f32>,
    /// Each term of the torque, as `terms` of the page's description lists them, for each joint \[N m\].
    pub terms_nm: Vec<Vec<f32>>,
    /// Present stiffness \[N/m\].
    pub stiffness_n_per_m: [f32; 3],
    /// Present damping \[N s/m\].
    pub damping_n_s_per_m: [f32; 3],
    /// Maximum period, latency and duration of a step since the previous snapshot \[us\].
    pub timing_us: Option<[f32; 3]>,
    /// Maximum time from a state to its answer since the previous snapshot \[us\].
    pub round_trip_us: f32,
    /// Number of cycles without an answer since the start.
    pub missed: u64,
    /// The latched fault.
    pub fault: Option<FaultText>,
    /// The last refusal since the previous snapshot.
    pub refusal: Option<String>,
    /// Whether learning is on.
    pub learning: bool,
}

/// Collects cycles until a snapshot is due.
#[derive(Debug)]
pub struct SnapshotBuilder<const N: usize> {
    last: Option<(CycleRecord<N>, CycleExtras)>,
    tip_error_m: Option<f64>,
    /// Magnitude and components of the maximum force \[N\], and whether a sensor measured it.
    force: (f64, [f64; 3], bool),
    in_contact: bool,
    timing_us: Option<[f64; 3]>,
    round_trip_us: f64,
    refusal: Option<String>,
}

impl<const N: usize> Default for SnapshotBuilder<N> {
    fn default() -> Self {
        SnapshotBuilder {
            last: None,
            tip_error_m: None,
            force: (-1.0, [0.0; 3], false),
            in_contact: false,
            timing_us: None,
            round_trip_us: 0.0,
            refusal: None,
        }
    }
}

impl<const N: usize> SnapshotBuilder<N> {
    /// Adds a cycle.
    pub fn add(&mut self, record: &CycleRecord<N>, extras: CycleExtras) {
        let greater = |old: Option<f64>, new: f64| old.map_or(new, |old| old.max(new));
        if let Some(error_m) = record.tip_error_m() {
            self.tip_error_m = Some(greater(self.tip_error_m, error_m));
        }
        let force_n = force_of(record);
        let size_n = force_n.iter().map(|part| part * part).sum::<f64>().sqrt();
        if size_n > self.force.0 {
            self.force = (size_n, force_n, record.has_tip_force);
        }
        self.in_contact |= record.in_contact;
        if let Some(new) = extras.timing_us {
            let old = self.timing_us.unwrap_or(new);
            self.timing_us = Some(core::array::from_fn(|i| old[i].max(new[i])));
        }
        self.round_trip_us = self.round_trip_us.max(extras.round_trip_us);
        if record.refusal != refusal_kind::NONE {
            self.refusal = Some(record.refusal_text.to_string());
        }
        self.last = Some((*record, extras));
    }

    /// Returns the snapshot of the cycles since the previous snapshot; `None` if there are no cycles.
    pub fn take(&mut self) -> Option<Snapshot> {
        let SnapshotBuilder {
            last,
            tip_error_m,
            force: (_, force_n, force_is_measured),
            in_contact,
            timing_us,
            round_trip_us,
            refusal,
        } = core::mem::take(self);
        let (record, extras) = last?;
        Some(Snapshot {
            time_s: extras.time_s,
            cycle: record.cycle,
            mode: record.mode().map_or("unknown", |mode| mode.name()),
            drives_active: record.drives_active || extras.held,
            joints_rad: joints(&record.position_rad),
            tip_m: narrow(record.tip_position_m),
            reference_m: record
                .has_reference
                .then(|| narrow(record.reference_position_m)),
            tip_error_m: tip_error_m.map(|error_m| error_m as f32),
            force_n: narrow(force_n),
            force_is_measured,
            in_contact,
            torque_nm: joints(&record.torque_nm),
            terms_nm: record
                .torques
                .named()
                .iter()
                .map(|(_, term)| joints(term))
                .collect(),
            stiffness_n_per_m: narrow(record.stiffness_n_per_m),
            damping_n_s_per_m: narrow(record.damping_n_s_per_m),
            timing_us: timing_us.map(narrow),
            round_trip_us: round_trip_us as f32,
            missed: extras.missed,
            fault: fault_name(record.fault).map(|name| FaultText {
                name,
                text: record.fault_text.to_string(),
                remedy: remedy(record.fault),
            }),
            refusal,
            learning: record.learning,
        })
    }
}

fn force_of<const N: usize>(record: &CycleRecord<N>) -> [f64; 3] {
    match record.has_tip_force {
        true => record.tip_force_n,
        false => record.external_force_n,
    }
}

fn narrow(values: [f64; 3]) -> [f32; 3] {
    values.map(|value| value as f32)
}

fn joints<const N: usize>(values: &Vector<N>) -> Vec<f32> {
    values.iter().map(|value| *value as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a record of zeros, which is valid because every word of a record is a number, a count or a flag.
    fn record() -> CycleRecord<3> {
        CycleRecord::unpack(&[0; CycleRecord::<3>::words(3)], 3)
    }

    #[test]
    fn a_peak_between_two_snapshots_is_in_the_later_one() {
        let mut builder = SnapshotBuilder::default();
        for (error_m, force_n, step_us) in
            [(0.001, 1.0, 20.0), (0.009, -30.0, 90.0), (0.002, 2.0, 10.0)]
        {
            let mut record = record();
            record.has_reference = true;
            record.reference_position_m = [error_m, 0.0, 0.0];
            record.external_force_n = [0.0, 0.0, force_n];
            record.in_contact = force_n == -30.0;
            let extras = CycleExtras {
                timing_us: Some([1000.0, 5.0, step_us]),
                ..CycleExtras::default()
            };
            builder.add(&record, extras);
        }
        let snapshot = builder.take().expect("a snapshot");
        assert!((snapshot.tip_error_m.expect("a reference") - 0.009).abs() < 1e-7);
        assert_eq!(snapshot.force_n, [0.0, 0.0, -30.0]);
        assert!(snapshot.in_contact);
        assert_eq!(snapshot.timing_us, Some([1000.0, 5.0, 90.0]));
        // The positions are those of the latest cycle, and the peaks are reset for the next snapshot.
        assert_eq!(snapshot.reference_m, Some([0.002, 0.0, 0.0]));
        assert_eq!(builder.take(), None);
    }

    #[test]
    fn a_fault_contains_its_remedy() {
        let mut record = record();
        record.fault = supple_core::codes::fault_kind::TIP_SPEED;
        let mut builder = SnapshotBuilder::default();
        builder.add(&record, CycleExtras::default());
        let fault = builder.take().expect("a snapshot").fault.expect("a fault");
        assert_eq!(
            (fault.name, fault.remedy),
            ("tip_speed", remedy(record.fault))
        );
    }
}
