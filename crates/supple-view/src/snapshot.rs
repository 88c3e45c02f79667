//! A snapshot of the system: the latest cycle, with the greatest error, force and times since the previous snapshot and
//! any contact, so that none of these falls between two.

use crate::remedy::remedy;
use serde::Serialize;
use supple_core::codes::{fault_name, refusal_kind};
use supple_core::controller::CycleRecord;
use supple_core::math::Vector;

/// What is known of a cycle besides its record.
#[derive(Clone, Copy, Debug, Default)]
pub struct CycleExtras {
    /// Time of the measurement, on any clock \[s\].
    pub time_s: f64,
    /// Period since the previous cycle, latency from the measurement to the start of the step, duration of the step \[us\].
    pub timing_us: Option<[f64; 3]>,
    /// From the state to its answer \[us\]; 0 if unknown.
    pub round_trip_us: f64,
    /// Cycles without an answer since the start.
    pub missed: u64,
    /// The plant holds the arm or lays it down itself.
    pub held: bool,
}

/// A fault in words.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FaultText {
    /// Its name.
    pub name: &'static str,
    /// What happened.
    pub text: String,
    /// What to do about it.
    pub remedy: &'static str,
}

/// State of the system at one time, as the page receives it. Joints in order; positions in base axes.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Snapshot {
    /// Time of the measurement \[s\].
    pub time_s: f64,
    /// Cycle number.
    pub cycle: u64,
    /// Mode of the controller.
    pub mode: &'static str,
    /// The drives apply torques: the controller's, or those with which they hold the arm and lay it down.
    pub drives_active: bool,
    /// Joint angles \[rad\].
    pub joints_rad: Vec<f32>,
    /// Tip \[m\].
    pub tip_m: [f32; 3],
    /// Its reference \[m\].
    pub reference_m: Option<[f32; 3]>,
    /// Greatest distance of the tip from its reference \[m\].
    pub tip_error_m: Option<f32>,
    /// Force on the tip: measured, otherwise observed; the greatest since the previous snapshot \[N\].
    pub force_n: [f32; 3],
    /// That force was measured by a sensor.
    pub force_is_measured: bool,
    /// Contact was latched in a cycle since the previous snapshot.
    pub in_contact: bool,
    /// Joint torques \[N m\].
    pub torque_nm: Vec<f32>,
    /// Each term of the torque, as `terms` of the page's description lists them, for each joint \[N m\].
    pub terms_nm: Vec<Vec<f32>>,
    /// Stiffness now in effect \[N/m\].
    pub stiffness_n_per_m: [f32; 3],
    /// Damping now in effect \[N s/m\].
    pub damping_n_s_per_m: [f32; 3],
    /// Greatest period, delay and duration of a step \[us\].
    pub timing_us: Option<[f32; 3]>,
    /// Greatest time from a state to its answer \[us\].
    pub round_trip_us: f32,
    /// Cycles without an answer since the start.
    pub missed: u64,
    /// The latched fault.
    pub fault: Option<FaultText>,
    /// The last refusal since the previous snapshot.
    pub refusal: Option<String>,
    /// Learning is on.
    pub learning: bool,
}

/// Collects cycles until a snapshot is due.
#[derive(Debug)]
pub struct SnapshotBuilder<const N: usize> {
    last: Option<(CycleRecord<N>, CycleExtras)>,
    tip_error_m: Option<f64>,
    /// The greatest force, its size, and whether a sensor measured it \[N\].
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

    /// The snapshot of the cycles since the last one; `None` without any.
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

    /// A record of zeros: every word of a record is a number, a count or a flag.
    fn record() -> CycleRecord<3> {
        CycleRecord::unpack(&[0; CycleRecord::<3>::words(3)], 3)
    }

    #[test]
    fn a_peak_between_two_pictures_is_in_the_later_one() {
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
        // The positions are those of the latest cycle, and nothing is left over for the next snapshot.
        assert_eq!(snapshot.reference_m, Some([0.002, 0.0, 0.0]));
        assert_eq!(builder.take(), None);
    }

    #[test]
    fn a_fault_comes_with_its_remedy() {
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
