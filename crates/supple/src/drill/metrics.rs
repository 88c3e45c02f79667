//! Metrics of a test case, from the simulated arm's trace and the controller's telemetry.

use super::trace::TraceRow;
use serde::Serialize;
use supple_core::codes::fault_name;
use supple_core::controller::Mode;
use supple_ipc::message::{Drives, MAX_DOF, Telemetry};

/// Time after a fault from which the tip must be slow \[ns\].
const STOPPED_NS: u64 = 500_000_000;
/// Time after a fault from which the kinetic energy may not exceed the energy at the fault. Also the time before an event in
/// which the energy of the undisturbed motion is measured \[ns\].
const ENERGY_CHECK_NS: u64 = 200_000_000;
/// Time within which braking motors have their effect \[ns\].
const BRAKING_NS: u64 = 10_000_000;
/// Time within which a safe action takes effect \[ns\].
const SAFE_ACTION_NS: u64 = 20_000_000;
/// Tip speed above which an arm counts as moving \[m/s\].
pub const SLOW_M_PER_S: f64 = 0.25;
/// Force above which contact is assumed \[N\].
const TOUCH_N: f64 = 0.5;
/// End of the first impact; the controller has reacted by then \[ns\].
const IMPACT_NS: u64 = 20_000_000;
/// Interval after the contact over which the pressing force is averaged \[ns\].
const PRESSED_NS: (u64, u64) = (500_000_000, 700_000_000);

/// State of the controller in one cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerSample {
    /// Time on the arm's clock \[ns\].
    pub time_ns: u64,
    /// Cycle of the arm's state.
    pub cycle: u64,
    /// Mode.
    pub mode: Option<Mode>,
    /// Kind of the fault, 0 for none.
    pub fault: u8,
    /// Whether the drives are active.
    pub active: bool,
    /// Estimated joint angles, padded \[rad\].
    pub position_rad: [f64; MAX_DOF],
}

impl ControllerSample {
    /// Reads the sample from telemetry.
    pub fn of(telemetry: &Telemetry) -> ControllerSample {
        ControllerSample {
            time_ns: telemetry.state.stamp_ns,
            cycle: telemetry.state.cycle,
            mode: telemetry.record().mode(),
            fault: telemetry.record().fault,
            active: telemetry.state.drives() == Drives::Active,
            position_rad: telemetry.record().position_rad.into(),
        }
    }
}

/// Metrics of a test case. Times are relative to the event.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct RowMetrics {
    /// Name of the first fault after the event.
    pub fault: Option<&'static str>,
    /// Name of a fault that latched before the event; the test case is then invalid.
    pub fault_before: Option<&'static str>,
    /// Time from the event to the first fault after it \[ms\].
    pub fault_after_ms: Option<f64>,
    /// Time from an injection until it can be observed \[ms\], see [`super::observable`].
    pub observable_after_ms: Option<f64>,
    /// Time from when the injection is observable to the fault; zero if the fault is earlier \[ms\].
    pub detected_after_ms: Option<f64>,
    /// Time from the event until the motors brake \[ms\].
    pub braked_after_ms: Option<f64>,
    /// Last time at which the tip was faster than 0.25 m/s while the motors did not brake; 0 if never \[ms\].
    pub moving_until_ms: f64,
    /// Maximum kinetic energy in the 0.2 s before the event \[J\].
    pub energy_before_j: f64,
    /// Kinetic energy at the fault, or when braking began \[J\].
    pub energy_at_fault_j: Option<f64>,
    /// Maximum kinetic energy from the fault until 10 ms after braking began \[J\], and the duration of this interval \[ms\].
    pub energy_peak: Option<(f64, f64)>,
    /// Maximum kinetic energy from 0.2 s after the fault \[J\].
    pub energy_later_j: Option<f64>,
    /// Maximum tip speed from the start of the task to the event \[m/s\].
    pub tip_before_m_per_s: f64,
    /// Maximum tip speed in the 20 ms after the fault, or after braking began \[m/s\].
    pub tip_at_fault_m_per_s: Option<f64>,
    /// Maximum tip speed after the event \[m/s\].
    pub tip_after_m_per_s: f64,
    /// Maximum tip speed from 0.5 s after the fault, while the motors do not brake \[m/s\].
    pub tip_later_m_per_s: Option<f64>,
    /// Maximum distance of the tip from its position at the event \[m\].
    pub tip_moved_m: f64,
    /// Maximum distance of the tip from its position at the event, until 0.2 s after the fault or after braking began; none without
    /// either \[m\].
    pub stopped_in_m: Option<f64>,
    /// Maximum force in the first 20 ms of the first contact \[N\].
    pub impact_n: f64,
    /// Maximum force after these 20 ms \[N\].
    pub force_n: f64,
    /// Time from the first contact to the fault after it \[ms\].
    pub fault_after_contact_ms: Option<f64>,
    /// Mean force from 0.5 s to 0.7 s after the contact began \[N\].
    pub pressed_n: Option<f64>,
    /// Force with which the law itself may press \[N\]; none if the task follows no path.
    pub law_force_n: Option<f64>,
    /// Force with which the weight of the arm may rest on the block \[N\]; none if it does not brake.
    pub weight_n: Option<f64>,
    /// Maximum rise of the mechanical energy, kinetic and potential, after the fault \[J\]; only if the encoders are correct.
    pub energy_gained_j: Option<f64>,
    /// Maximum descent of the tip after the fault \[m\].
    pub descent_m: f64,
    /// Mode at the end.
    pub end_mode: &'static str,
    /// Whether the drives are active at the end.
    pub end_active: bool,
    /// Maximum tip speed after the drives are re-enabled \[m/s\].
    pub reenabled_tip_m_per_s: Option<f64>,
    /// Maximum tip displacement after the drives are re-enabled \[m\].
    pub reenabled_travel_m: Option<f64>,
    /// Total time for which the re-enabled drives were active \[ms\].
    pub reenabled_active_ms: Option<f64>,
}

impl RowMetrics {
    /// Computes the metrics from trace rows and controller samples in time order; the task began at `task_start_ns`,
    /// the event occurred at `event_ns`.
    pub fn new(
        lines: &[TraceRow],
        samples: &[ControllerSample],
        task_start_ns: u64,
        event_ns: u64,
    ) -> RowMetrics {
        let ms = |time_ns: u64| (time_ns - event_ns) as f64 * 1e-6;
        let after: Vec<&TraceRow> = lines.iter().filter(|l| l.time_ns >= event_ns).collect();
        let at = |time_ns: u64| lines.iter().find(|line| line.time_ns >= time_ns);
        let mut faults = samples.iter().filter(|sample| sample.fault != 0);
        let first = faults.next();
        let before = first.filter(|sample| sample.time_ns < event_ns);
        let fault = first.filter(|sample| sample.time_ns >= event_ns);
        let braked = after.iter().find(|line| !line.active);
        let stop_ns = [
            fault.map(|sample| sample.time_ns),
            braked.map(|line| line.time_ns),
        ];
        let stop_ns = stop_ns.into_iter().flatten().min();
        let moving = |line: &&&TraceRow| line.active && line.tip_speed_m_per_s > SLOW_M_PER_S;
        let from = |since_ns: u64| after.iter().filter(move |line| line.time_ns >= since_ns);
        let last = samples.last();
        let (event_tip_m, touched) = (
            at(event_ns).map(|line| line.tip_m),
            lines
                .iter()
                .find(|l| l.time_ns >= task_start_ns && l.force_n > TOUCH_N),
        );
        let mut metrics = RowMetrics {
            fault: fault.and_then(|sample| fault_name(sample.fault)),
            fault_before: before.and_then(|sample| fault_name(sample.fault)),
            fault_after_ms: fault.map(|sample| ms(sample.time_ns)),
            braked_after_ms: braked.map(|line| ms(line.time_ns)),
            moving_until_ms: after.iter().rfind(moving).map_or(0.0, |l| ms(l.time_ns)),
            tip_before_m_per_s: max(lines
                .iter()
                .filter(|line| (task_start_ns..event_ns).contains(&line.time_ns))
                .map(|line| line.tip_speed_m_per_s)),
            energy_before_j: max(lines
                .iter()
                .filter(|line| {
                    (event_ns.saturating_sub(ENERGY_CHECK_NS)..event_ns).contains(&line.time_ns)
                })
                .map(|line| line.kinetic_energy_j)),
            tip_after_m_per_s: max(after.iter().map(|line| line.tip_speed_m_per_s)),
            tip_moved_m: event_tip_m.map_or(0.0, |event_tip_m| {
                max(after.iter().map(|line| distance(&line.tip_m, &event_tip_m)))
            }),
            end_mode: last
                .and_then(|sample| sample.mode)
                .map_or("unknown", Mode::name),
            end_active: last.is_some_and(|sample| sample.active),
            ..RowMetrics::default()
        };
        if let Some(stop_ns) = stop_ns {
            let stop = at(stop_ns);
            metrics.energy_at_fault_j = stop.map(|line| line.kinetic_energy_j);
            let at_fault = from(stop_ns).take_while(|line| line.time_ns < stop_ns + SAFE_ACTION_NS);
            metrics.tip_at_fault_m_per_s = Some(max(at_fault.map(|l| l.tip_speed_m_per_s)));
            let until_ns = braked.map_or(u64::MAX, |line| line.time_ns + BRAKING_NS);
            let driven = from(stop_ns).take_while(|line| line.time_ns <= until_ns);
            let peak = driven.max_by(|a, b| a.kinetic_energy_j.total_cmp(&b.kinetic_energy_j));
            metrics.energy_peak = peak.map(|line| {
                let after_ms = (line.time_ns - stop_ns) as f64 * 1e-6;
                (line.kinetic_energy_j, after_ms)
            });
            let later = from(stop_ns + ENERGY_CHECK_NS).map(|line| line.kinetic_energy_j);
            metrics.energy_later_j = Some(max(later));
            let later = from(stop_ns + STOPPED_NS).filter(|line| line.active);
            metrics.tip_later_m_per_s = Some(max(later.map(|l| l.tip_speed_m_per_s)));
            let until = after
                .iter()
                .take_while(|line| line.time_ns < stop_ns + ENERGY_CHECK_NS);
            metrics.stopped_in_m = event_tip_m
                .map(|event_tip_m| max(until.map(|line| distance(&line.tip_m, &event_tip_m))));
        }
        if let Some(touched) = touched {
            let (begin_ns, over_ns) = (touched.time_ns, touched.time_ns + IMPACT_NS);
            let within = |from_ns: u64, to_ns: u64| {
                let lines = lines
                    .iter()
                    .filter(move |line| (from_ns..to_ns).contains(&line.time_ns));
                lines.map(|line| line.force_n)
            };
            metrics.fault_after_contact_ms = fault
                .filter(|sample| sample.time_ns >= begin_ns)
                .map(|sample| (sample.time_ns - begin_ns) as f64 * 1e-6);
            metrics.impact_n = max(within(begin_ns, over_ns));
            metrics.force_n = max(within(over_ns, u64::MAX));
            let pressed: Vec<f64> =
                within(begin_ns + PRESSED_NS.0, begin_ns + PRESSED_NS.1).collect();
            let count = pressed.len() as f64;
            metrics.pressed_n = (count > 0.0).then(|| pressed.iter().sum::<f64>() / count);
        }
        let back = braked.and_then(|braked| {
            after
                .iter()
                .find(|line| line.active && line.time_ns > braked.time_ns)
        });
        if let Some(back) = back {
            metrics.reenabled_tip_m_per_s =
                Some(max(from(back.time_ns).map(|l| l.tip_speed_m_per_s)));
            let distances_m = from(back.time_ns).map(|line| distance(&line.tip_m, &back.tip_m));
            metrics.reenabled_travel_m = Some(max(distances_m));
            let pairs = after
                .windows(2)
                .filter(|pair| pair[0].time_ns >= back.time_ns);
            let active = pairs.filter(|pair| pair[0].active);
            let active_ns: u64 = active.map(|pair| pair[1].time_ns - pair[0].time_ns).sum();
            metrics.reenabled_active_ms = Some(active_ns as f64 * 1e-6);
        }
        if let Some(stop) = stop_ns.and_then(at) {
            let lowest_m = from(stop.time_ns).map(|line| line.tip_m[2]);
            metrics.descent_m = stop.tip_m[2] - lowest_m.fold(stop.tip_m[2], f64::min);
        }
        metrics
    }

    /// Adds the time at which the fault was observable: `at_ns` on the arm's clock, with the event at `event_ns`.
    pub fn observable_at(&mut self, at_ns: Option<u64>, event_ns: u64) {
        self.observable_after_ms = at_ns.map(|at_ns| at_ns.saturating_sub(event_ns) as f64 * 1e-6);
        if let (Some(from_ms), Some(fault_ms)) = (self.observable_after_ms, self.fault_after_ms) {
            self.detected_after_ms = Some((fault_ms - from_ms).max(0.0));
        }
    }

    /// Adds the rise of the mechanical energy from the fault on, with the arm's potential energy \[J\] at given angles.
    pub fn energy_since_fault(
        &mut self,
        lines: &[TraceRow],
        samples: &[ControllerSample],
        event_ns: u64,
        potential_j: impl Fn(&[f64; MAX_DOF]) -> f64,
    ) {
        let after_ms = [self.fault_after_ms, self.braked_after_ms];
        let Some(after_ms) = after_ms.into_iter().flatten().reduce(f64::min) else {
            return;
        };
        let stop_ns = event_ns + (after_ms * 1e6).round() as u64;
        let later = samples.iter().filter(|sample| sample.time_ns >= stop_ns);
        let mut energies_j = later.filter_map(|sample| {
            let line = lines.iter().find(|line| line.time_ns >= sample.time_ns)?;
            Some(line.kinetic_energy_j + potential_j(&sample.position_rad))
        });
        if let Some(first_j) = energies_j.next() {
            self.energy_gained_j = Some(energies_j.fold(0.0, |gained, j| gained.max(j - first_j)));
        }
    }
}

fn max(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    square.sqrt()
}
