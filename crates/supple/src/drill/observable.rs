//! Time from which a fault is observable: an angle is wrong, or the arm has left the path that it takes without the fault.

use super::trace::TraceRow;
use supple_core::{Config, Vector};
use supple_plant::InjectionKind;

/// Whether the fault is a sensor fault, which makes the reported values wrong.
pub fn is_of_sensors(kind: InjectionKind) -> bool {
    matches!(
        kind,
        InjectionKind::EncoderStuck { .. }
            | InjectionKind::MotorEncoderStuck { .. }
            | InjectionKind::EncoderLate { .. }
            | InjectionKind::EncoderSign { .. }
            | InjectionKind::EncoderOffset { .. }
            | InjectionKind::EncoderNan { .. }
            | InjectionKind::ReplyLost { .. }
    )
}

/// Returns the first time from the injection at `event_ns` on at which the fault is observable \[ns\]. If a reply is missing or
/// an angle jumps, this is at once; otherwise as soon as an angle is wrong, or a joint has left its path in the run without the
/// fault, by more than the resolution of the checks (`stuck_rad`).
pub fn observable_ns<const N: usize>(
    kind: InjectionKind,
    config: &Config<N>,
    lines: &[TraceRow],
    undisturbed: &[TraceRow],
    event_ns: u64,
) -> Option<u64> {
    let resolution_rad = config.plausible.stuck_rad;
    let wrong_ns = match kind {
        InjectionKind::EncoderOffset { .. }
        | InjectionKind::EncoderNan { .. }
        | InjectionKind::ReplyLost { .. } => return Some(event_ns),
        // This is not a fault but an external action on the arm.
        InjectionKind::Bump { .. } | InjectionKind::DrivesIdle { .. } => return None,
        InjectionKind::EncoderStuck { joint } => {
            first_ns(lines, event_ns, resolution_rad, |turned_rad| {
                largest(turned_rad, joint)
            })
        }
        InjectionKind::EncoderSign { joint } => {
            first_ns(lines, event_ns, resolution_rad, |turned_rad| {
                2.0 * largest(turned_rad, joint)
            })
        }
        InjectionKind::MotorEncoderStuck { motor } => {
            let joint_from_motor = config.joint_from_motor;
            let motor_from_joint = joint_from_motor.try_inverse()?;
            first_ns(lines, event_ns, resolution_rad, |turned_rad| {
                let turned = motor_from_joint * Vector::<N>::from_column_slice(turned_rad);
                (joint_from_motor.column(motor) * turned[motor]).amax()
            })
        }
        _ => None,
    };
    let left_ns = left_path_ns(lines, undisturbed, event_ns, resolution_rad);
    [wrong_ns, left_ns].into_iter().flatten().min()
}

/// Returns the largest rotation of `joint`, or of any joint.
fn largest(turned_rad: &[f64], joint: Option<usize>) -> f64 {
    let counts = |(index, _): &(usize, &f64)| joint.is_none_or(|joint| joint == *index);
    let turned_rad = turned_rad.iter().enumerate().filter(counts);
    turned_rad.fold(0.0, |largest, (_, angle)| largest.max(angle.abs()))
}

/// Returns the first time at which the rotation of a joint since `event_ns` differs from the run without the fault by more than
/// `resolution_rad`. The comparison ends with the run without the fault.
fn left_path_ns(
    lines: &[TraceRow],
    undisturbed: &[TraceRow],
    event_ns: u64,
    resolution_rad: f64,
) -> Option<u64> {
    let mut both =
        JointRotations::new(lines, event_ns).zip(JointRotations::new(undisturbed, event_ns));
    both.find_map(|((time_ns, turned_rad), (_, undisturbed_rad))| {
        let away_rad = turned_rad.iter().zip(&undisturbed_rad).map(|(a, b)| a - b);
        let away_rad = away_rad.fold(0.0_f64, |largest, away| largest.max(away.abs()));
        (away_rad > resolution_rad).then_some(time_ns)
    })
}

/// Returns the first time from `event_ns` on at which `error_rad` of the rotations since then exceeds `resolution_rad`.
fn first_ns(
    lines: &[TraceRow],
    event_ns: u64,
    resolution_rad: f64,
    error_rad: impl Fn(&[f64]) -> f64,
) -> Option<u64> {
    JointRotations::new(lines, event_ns).find_map(|(time_ns, turned_rad)| {
        (error_rad(&turned_rad) > resolution_rad).then_some(time_ns)
    })
}

/// Iterator over the rows of a trace: time of the row \[ns\], and rotation of each joint since a given time.
struct JointRotations<'a> {
    lines: &'a [TraceRow],
    turned_rad: Vec<f64>,
}

impl<'a> JointRotations<'a> {
    fn new(lines: &'a [TraceRow], from_ns: u64) -> JointRotations<'a> {
        let before = lines.partition_point(|line| line.time_ns < from_ns);
        JointRotations {
            lines: &lines[before..],
            turned_rad: Vec::new(),
        }
    }
}

impl Iterator for JointRotations<'_> {
    type Item = (u64, Vec<f64>);

    fn next(&mut self) -> Option<Self::Item> {
        let [now, next, ..] = self.lines else {
            return None;
        };
        let period_s = (next.time_ns - now.time_ns) as f64 * 1e-9;
        self.turned_rad.resize(now.joint_rad_per_s.len(), 0.0);
        for (turned_rad, speed) in self.turned_rad.iter_mut().zip(&now.joint_rad_per_s) {
            *turned_rad += speed * period_s;
        }
        self.lines = &self.lines[1..];
        Some((next.time_ns, self.turned_rad.clone()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_model::Description;

    const MS: u64 = 1_000_000;
    const EVENT_NS: u64 = 1000 * MS;

    /// Returns a trace of four seconds in which two of four joints turn at these speeds from the event on.
    fn turning(first_rad_per_s: f64, second_rad_per_s: f64) -> Vec<TraceRow> {
        let line = |ms: u64| TraceRow {
            time_ns: ms * MS,
            active: true,
            torque_nm: Vec::new(),
            force_n: 0.0,
            tip_m: [0.0; 3],
            tip_speed_m_per_s: 0.0,
            joint_rad_per_s: match ms < 1000 {
                true => vec![0.0; 4],
                false => vec![first_rad_per_s, second_rad_per_s, 0.0, 0.0],
            },
            joint_speed_rad_per_s: 0.0,
            kinetic_energy_j: 0.0,
            injections: u64::from(ms >= 1000),
        };
        (0..4000).map(line).collect()
    }

    fn observable_ms(
        kind: InjectionKind,
        lines: &[TraceRow],
        undisturbed: &[TraceRow],
    ) -> Option<u64> {
        let arm = Description::asset("wam4").expect("built in");
        let mut config = arm.config::<4>().expect("four joints");
        config.plausible.stuck_rad = 0.10005;
        let at_ns = observable_ns(kind, &config, lines, undisturbed, EVENT_NS);
        at_ns.map(|ns| (ns - EVENT_NS) / MS)
    }

    #[test]
    fn a_stuck_or_reversed_encoder_is_observable_when_its_angle_is_wrong() {
        let lines = turning(0.5, 0.05);
        let stuck = |joint| InjectionKind::EncoderStuck { joint };
        let after = |kind| observable_ms(kind, &lines, &lines);
        assert_eq!(after(stuck(Some(1))), Some(2002));
        assert_eq!(after(stuck(None)), Some(201));
        assert_eq!(after(stuck(Some(3))), None);
        let reversed = InjectionKind::EncoderSign { joint: Some(1) };
        assert_eq!(after(reversed), Some(1001));
    }

    #[test]
    fn a_motor_without_torque_is_observable_when_a_joint_leaves_its_path() {
        let dead = InjectionKind::MotorDead { motor: 1 };
        let undisturbed = turning(0.5, 0.05);
        assert_eq!(observable_ms(dead, &undisturbed, &undisturbed), None);
        let falls = turning(0.5, 1.05);
        assert_eq!(observable_ms(dead, &falls, &undisturbed), Some(101));
    }

    #[test]
    fn a_missing_reply_is_observable_at_once() {
        let lost = InjectionKind::ReplyLost {
            joint: Some(1),
            every: 2,
        };
        let at_rest = turning(0.0, 0.0);
        assert_eq!(observable_ms(lost, &at_rest, &at_rest), Some(0));
    }
}
