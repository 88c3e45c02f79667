//! What a row was in numbers, from the trace of the simulated arm and the controller's telemetry.

use super::fault_name::fault_name;
use super::trace::Line;
use serde::Serialize;
use supple_core::controller::Mode;
use supple_ipc::message::{Drives, Telemetry};

/// A time from which nothing may be fast any more after a fault \[ns\].
const STOPPED_NS: u64 = 500_000_000;
/// A time from which the kinetic energy may not be above that at the fault \[ns\].
const CALMED_NS: u64 = 200_000_000;
/// A safe action acts within this time \[ns\].
const ACTS_NS: u64 = 20_000_000;
/// Tip speed above which an arm still moves \[m/s\].
pub const SLOW_M_PER_S: f64 = 0.25;
/// A contact, and not the noise of none \[N\].
const TOUCH_N: f64 = 0.5;
/// The first impact is over, and the reaction has come \[ns\].
const IMPACT_NS: u64 = 20_000_000;
/// Pressing is the mean force from 0.5 s to 0.7 s after the contact \[ns\].
const PRESSED_NS: (u64, u64) = (500_000_000, 700_000_000);

/// What the controller said in a cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Said {
    /// When, by the arm's clock \[ns\].
    pub time_ns: u64,
    /// Cycle of the arm's state.
    pub cycle: u64,
    /// Mode.
    pub mode: Option<Mode>,
    /// Kind of its fault, 0 for none.
    pub fault: u8,
    /// The drives are active.
    pub active: bool,
}

impl Said {
    /// Of a cycle.
    pub fn of(telemetry: &Telemetry) -> Said {
        Said {
            time_ns: telemetry.state.stamp_ns,
            cycle: telemetry.state.cycle,
            mode: telemetry.mode(),
            fault: telemetry.fault,
            active: telemetry.state.drives() == Drives::Active,
        }
    }
}

/// A row in numbers. Times from what happened on.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Measures {
    /// Name of the first fault after it.
    pub fault: Option<&'static str>,
    /// A fault latched before it: the row says nothing.
    pub fault_before: Option<&'static str>,
    /// To that fault \[ms\].
    pub fault_after_ms: Option<f64>,
    /// To motors that brake \[ms\].
    pub braked_after_ms: Option<f64>,
    /// To the last moment in which the tip was faster than 0.25 m/s with motors that do not brake, 0 for none \[ms\].
    pub moving_until_ms: f64,
    /// Kinetic energy at the fault, or where the motors came to brake \[J\].
    pub energy_at_fault_j: Option<f64>,
    /// The greatest from 0.2 s after it on \[J\].
    pub energy_later_j: Option<f64>,
    /// Greatest tip speed before it, since work began \[m/s\].
    pub tip_before_m_per_s: f64,
    /// Greatest tip speed in the 20 ms that the action has from the fault on, or from braking on \[m/s\].
    pub tip_at_fault_m_per_s: Option<f64>,
    /// Greatest tip speed after it \[m/s\].
    pub tip_after_m_per_s: f64,
    /// Greatest tip speed from 0.5 s after the fault on, while motors do not brake \[m/s\].
    pub tip_later_m_per_s: Option<f64>,
    /// How far the tip was at most from where it was when it happened \[m\].
    pub tip_moved_m: f64,
    /// Greatest force of the first 20 ms of the first contact \[N\].
    pub impact_n: f64,
    /// Greatest force later \[N\].
    pub force_n: f64,
    /// From the first contact to the fault after it \[ms\].
    pub fault_after_contact_ms: Option<f64>,
    /// Mean force from 0.5 s to 0.7 s after the contact began \[N\].
    pub pressed_n: Option<f64>,
    /// Mode and drives at the end.
    pub end_mode: &'static str,
    /// Drives are active at the end.
    pub end_active: bool,
    /// Tip speed in the second after drives came back, greatest \[m/s\].
    pub back_tip_m_per_s: Option<f64>,
    /// Way of the tip in that second \[m\].
    pub back_moved_m: Option<f64>,
}

impl Measures {
    /// From lines and cycles in order of time; work began at `work_ns`, it happened at `event_ns`.
    pub fn new(lines: &[Line], said: &[Said], work_ns: u64, event_ns: u64) -> Measures {
        let ms = |time_ns: u64| (time_ns - event_ns) as f64 * 1e-6;
        let after: Vec<&Line> = lines.iter().filter(|l| l.time_ns >= event_ns).collect();
        let at = |time_ns: u64| lines.iter().find(|line| line.time_ns >= time_ns);
        let mut faults = said.iter().filter(|said| said.fault != 0);
        let first = faults.next();
        let before = first.filter(|said| said.time_ns < event_ns);
        let fault = first.filter(|said| said.time_ns >= event_ns);
        let braked = after.iter().find(|line| !line.active);
        let stop_ns = [
            fault.map(|said| said.time_ns),
            braked.map(|line| line.time_ns),
        ];
        let stop_ns = stop_ns.into_iter().flatten().min();
        let moving = |line: &&&Line| line.active && line.tip_speed_m_per_s > SLOW_M_PER_S;
        let from = |since_ns: u64| after.iter().filter(move |line| line.time_ns >= since_ns);
        let last = said.last();
        let (place, touched) = (
            at(event_ns).map(|line| line.tip_m),
            lines
                .iter()
                .find(|l| l.time_ns >= work_ns && l.force_n > TOUCH_N),
        );
        let mut measures = Measures {
            fault: fault.and_then(|said| fault_name(said.fault)),
            fault_before: before.and_then(|said| fault_name(said.fault)),
            fault_after_ms: fault.map(|said| ms(said.time_ns)),
            braked_after_ms: braked.map(|line| ms(line.time_ns)),
            moving_until_ms: after.iter().rfind(moving).map_or(0.0, |l| ms(l.time_ns)),
            tip_before_m_per_s: greatest(
                lines
                    .iter()
                    .filter(|line| (work_ns..event_ns).contains(&line.time_ns))
                    .map(|line| line.tip_speed_m_per_s),
            ),
            tip_after_m_per_s: greatest(after.iter().map(|line| line.tip_speed_m_per_s)),
            tip_moved_m: place.map_or(0.0, |place| {
                greatest(after.iter().map(|line| distance(&line.tip_m, &place)))
            }),
            end_mode: last
                .and_then(|said| said.mode)
                .map_or("unknown", Mode::name),
            end_active: last.is_some_and(|said| said.active),
            ..Measures::default()
        };
        if let Some(stop_ns) = stop_ns {
            let stop = at(stop_ns);
            measures.energy_at_fault_j = stop.map(|line| line.kinetic_energy_j);
            let at_fault = from(stop_ns).take_while(|line| line.time_ns < stop_ns + ACTS_NS);
            measures.tip_at_fault_m_per_s = Some(greatest(at_fault.map(|l| l.tip_speed_m_per_s)));
            let later = from(stop_ns + CALMED_NS).map(|line| line.kinetic_energy_j);
            measures.energy_later_j = Some(greatest(later));
            let later = from(stop_ns + STOPPED_NS).filter(|line| line.active);
            measures.tip_later_m_per_s = Some(greatest(later.map(|l| l.tip_speed_m_per_s)));
        }
        if let Some(touched) = touched {
            let (begin_ns, over_ns) = (touched.time_ns, touched.time_ns + IMPACT_NS);
            let within = |from_ns: u64, to_ns: u64| {
                let lines = lines
                    .iter()
                    .filter(move |line| (from_ns..to_ns).contains(&line.time_ns));
                lines.map(|line| line.force_n)
            };
            measures.fault_after_contact_ms = fault
                .filter(|said| said.time_ns >= begin_ns)
                .map(|said| (said.time_ns - begin_ns) as f64 * 1e-6);
            measures.impact_n = greatest(within(begin_ns, over_ns));
            measures.force_n = greatest(within(over_ns, u64::MAX));
            let pressed: Vec<f64> =
                within(begin_ns + PRESSED_NS.0, begin_ns + PRESSED_NS.1).collect();
            let count = pressed.len() as f64;
            measures.pressed_n = (count > 0.0).then(|| pressed.iter().sum::<f64>() / count);
        }
        let back = braked.and_then(|braked| {
            after
                .iter()
                .find(|line| line.active && line.time_ns > braked.time_ns)
        });
        if let Some(back) = back {
            measures.back_tip_m_per_s =
                Some(greatest(from(back.time_ns).map(|l| l.tip_speed_m_per_s)));
            let way = from(back.time_ns).map(|line| distance(&line.tip_m, &back.tip_m));
            measures.back_moved_m = Some(greatest(way));
        }
        measures
    }
}

fn greatest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    square.sqrt()
}
