//! Thirty-nine errors of a log, each applied to a correct log.

use supple_ident::log_checks::Problem;
use supple_ident::{DMatrix, Log};
use supple_random::Random;

/// A log with one error, and the permitted reports.
pub struct Variant {
    pub name: String,
    pub log: Log,
    /// Reports of which any one is correct.
    pub problems: Vec<Problem>,
    /// Joint that must be reported; `None` if the error affects all joints.
    pub joint: Option<usize>,
}

/// Data from which the variants of an arm's log are made.
pub struct Sizes {
    /// Joint that carries weight, a second such joint, and a wrist joint.
    pub heavy: usize,
    pub second: usize,
    pub wrist: usize,
    /// Gear ratio of the motors.
    pub ratio: f64,
    /// Torque constant with gear \[N m/A\].
    pub gain: f64,
    /// Torques that `payload_kg` at the tip adds, (samples, joints).
    pub payload_nm: DMatrix<f64>,
    /// Torques that a push of 60 N m at the heavy joint's tip adds at each joint, as a fraction of 60 N m.
    pub push: Vec<f64>,
}

fn scaled(log: &Log, f: impl Fn(&mut Log)) -> Log {
    let mut log = log.clone();
    f(&mut log);
    log
}

fn angle(log: &mut Log, joint: usize, f: impl Fn(f64) -> f64, rate: f64) {
    log.q_rad.column_mut(joint).apply(|q| *q = f(*q));
    if let Some(qd) = &mut log.qd_rad_per_s {
        qd.column_mut(joint).scale_mut(rate);
    }
}

fn hold(values: &mut DMatrix<f64>, joint: Option<usize>, every: usize) {
    for j in joint.map_or(0..values.ncols(), |j| j..j + 1) {
        for i in 0..values.nrows() {
            values[(i, j)] = values[(i - i % every, j)];
        }
    }
}

fn kept(log: &Log, keep: &[usize], step_s: f64) -> Log {
    Log {
        t_s: (0..keep.len()).map(|i| i as f64 * step_s).collect(),
        q_rad: log.q_rad.select_rows(keep),
        qd_rad_per_s: log.qd_rad_per_s.as_ref().map(|qd| qd.select_rows(keep)),
        tau_nm: log.tau_nm.select_rows(keep),
    }
}

/// All variants of a log of `dof` joints at about `rate_hz`.
pub fn all(log: &Log, s: &Sizes, rate_hz: f64) -> Vec<Variant> {
    let dof = log.q_rad.ncols();
    let n = log.t_s.len();
    let deg = 180.0 / std::f64::consts::PI;
    let mut out: Vec<Variant> = Vec::new();
    let mut add = |name: &str, joint: Option<usize>, problems: &[Problem], log: Log| {
        out.push(Variant {
            name: name.to_owned(),
            log,
            problems: problems.to_vec(),
            joint,
        });
    };
    let all_angles = |f: f64| scaled(log, |l| (0..dof).for_each(|j| angle(l, j, |q| f * q, f)));
    use Problem::*;
    let (a, b, w) = (s.heavy, s.second, s.wrist);
    add("degrees", None, &[Degrees], all_angles(deg));
    add(
        "degrees of a joint",
        Some(a),
        &[Degrees, AngleScale],
        scaled(log, |l| angle(l, a, |q| q * deg, deg)),
    );
    add(
        "velocity in degrees",
        None,
        &[Degrees],
        match &log.qd_rad_per_s {
            Some(qd) => Log {
                qd_rad_per_s: Some(qd * deg),
                ..log.clone()
            },
            None => Log {
                q_rad: &log.q_rad * deg,
                ..log.clone()
            },
        },
    );
    add(
        "motor side angles",
        None,
        &[MotorAngles, AngleScale],
        all_angles(s.ratio),
    );
    add(
        "motor side angle of a joint",
        Some(b),
        &[MotorAngles, AngleScale, Degrees],
        scaled(log, |l| angle(l, b, |q| q * s.ratio, s.ratio)),
    );
    add(
        "motor side torques",
        None,
        &[NotJointTorques],
        scaled(log, |l| l.tau_nm /= s.ratio),
    );
    add(
        "currents",
        None,
        &[NotJointTorques],
        scaled(log, |l| l.tau_nm /= s.gain),
    );
    for (name, factor) in [("milliseconds", 1e3), ("nanoseconds", 1e9)] {
        add(
            name,
            None,
            &[TimeUnit],
            scaled(log, |l| l.t_s.iter_mut().for_each(|t| *t *= factor)),
        );
    }
    for (name, factor) in [
        ("clock twice too fast", 2.0),
        ("clock half as fast", 0.5),
        ("clock 1.1 times too fast", 1.1),
    ] {
        // Velocities measured by the robot have the robot's clock.
        let changed = scaled(log, |l| l.t_s.iter_mut().for_each(|t| *t *= factor));
        add(name, None, &[TimeScale], changed);
    }
    for j in [a, b, w] {
        add(
            &format!("angle sign of {j}"),
            Some(j),
            &[AngleSign],
            scaled(log, |l| angle(l, j, |q| -q, -1.0)),
        );
        add(
            &format!("torque sign of {j}"),
            Some(j),
            &[TorqueSign],
            scaled(log, |l| l.tau_nm.column_mut(j).neg_mut()),
        );
    }
    add(
        "all torque signs",
        None,
        &[TorqueSign],
        scaled(log, |l| l.tau_nm.neg_mut()),
    );
    let swap = |l: &mut Log, angles: bool, torques: bool, j: usize, k: usize| {
        if angles {
            l.q_rad.swap_columns(j, k);
            if let Some(qd) = &mut l.qd_rad_per_s {
                qd.swap_columns(j, k);
            }
        }
        if torques {
            l.tau_nm.swap_columns(j, k);
        }
    };
    add(
        "swapped torques",
        Some(a),
        &[Swapped],
        scaled(log, |l| swap(l, false, true, a, b)),
    );
    add(
        "swapped angles",
        Some(a),
        &[Swapped],
        scaled(log, |l| swap(l, true, false, a, b)),
    );
    add(
        "swapped joints",
        Some(a),
        &[Swapped],
        scaled(log, |l| swap(l, true, true, a, b)),
    );
    add(
        "swapped wrist torques",
        Some(w),
        &[Swapped],
        scaled(log, |l| swap(l, false, true, w - 1, w)),
    );
    add(
        "ratio 1.25 of an angle",
        Some(a),
        &[AngleScale],
        scaled(log, |l| angle(l, a, |q| 1.25 * q, 1.25)),
    );
    add(
        "ratio 2 of an angle",
        Some(b),
        &[AngleScale],
        scaled(log, |l| angle(l, b, |q| 2.0 * q, 2.0)),
    );
    add(
        "scale 0.5 of a torque",
        Some(a),
        &[TorqueScale, NotJointTorques],
        scaled(log, |l| l.tau_nm.column_mut(a).scale_mut(0.5)),
    );
    add(
        "scale 2 of a torque",
        Some(b),
        &[TorqueScale, NotJointTorques],
        scaled(log, |l| l.tau_nm.column_mut(b).scale_mut(2.0)),
    );
    add(
        "zero offset 0.3",
        Some(a),
        &[ZeroOffset],
        scaled(log, |l| angle(l, a, |q| q + 0.3, 1.0)),
    );
    add(
        "zero offset pi/2",
        Some(b),
        &[ZeroOffset],
        scaled(log, |l| {
            angle(l, b, |q| q + std::f64::consts::FRAC_PI_2, 1.0)
        }),
    );
    let deviation = |j: usize| {
        let c = log.tau_nm.column(j);
        let mean = c.mean();
        c.map(|x| (x - mean).powi(2)).mean().sqrt()
    };
    add(
        "torque offset",
        Some(a),
        &[TorqueOffset],
        scaled(log, |l| {
            l.tau_nm.column_mut(a).add_scalar_mut(1.5 * deviation(a))
        }),
    );
    add(
        "torque offset of the wrist",
        Some(w),
        &[TorqueOffset],
        scaled(log, |l| {
            l.tau_nm.column_mut(w).add_scalar_mut(2.0 * deviation(w))
        }),
    );
    let limit = |j: usize, f: f64| {
        let mut sizes: Vec<f64> = log.tau_nm.column(j).iter().map(|x| x.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        sizes[(f * (n - 1) as f64) as usize]
    };
    add(
        "saturation",
        Some(a),
        &[Saturated],
        scaled(log, |l| {
            let m = limit(a, 0.8);
            l.tau_nm.column_mut(a).apply(|x| *x = x.clamp(-m, m));
        }),
    );
    let every = (rate_hz / 12.0).round() as usize;
    add(
        "angles held at 12 Hz",
        Some(a),
        &[Held],
        scaled(log, |l| {
            hold(&mut l.q_rad, None, every);
            if let Some(qd) = &mut l.qd_rad_per_s {
                hold(qd, None, every);
            }
        }),
    );
    add(
        "torques held at 12 Hz",
        Some(a),
        &[Held],
        scaled(log, |l| hold(&mut l.tau_nm, None, every)),
    );
    let mut noise = Random::new(3);
    let keep: Vec<usize> = (0..n).filter(|_| noise.signed() > -0.96).collect();
    let step = (log.t_s[n - 1] - log.t_s[0]) / (n - 1) as f64;
    add(
        "2 % of the samples lost",
        None,
        &[LostSamples],
        kept(log, &keep, step),
    );
    let block: Vec<usize> = (0..n)
        .filter(|i| *i < n / 2 || *i > n / 2 + (0.5 * rate_hz) as usize)
        .collect();
    add(
        "half a second lost",
        None,
        &[LostSamples],
        kept(log, &block, step),
    );
    // The angle is frozen while the joint moves fast.
    let fast = |j: usize| {
        let reach = (0.02 * rate_hz).round().max(1.0) as usize;
        let speed = |i: usize| (log.q_rad[(i + reach, j)] - log.q_rad[(i - reach, j)]).abs();
        (n / 4..3 * n / 4)
            .max_by(|x, y| speed(*x).total_cmp(&speed(*y)))
            .unwrap_or(n / 2)
    };
    add(
        "frozen encoder",
        Some(b),
        &[FrozenAngle],
        scaled(log, |l| {
            let from = fast(b);
            let to = (from + (0.5 * rate_hz) as usize).min(n - 1);
            for i in from..to {
                l.q_rad[(i, b)] = log.q_rad[(from, b)];
                if let Some(qd) = &mut l.qd_rad_per_s {
                    qd[(i, b)] = 0.0;
                }
            }
        }),
    );
    add(
        "push of 60 N m",
        None,
        &[Contact],
        scaled(log, |l| {
            let (from, length) = (n / 2, (0.4 * rate_hz) as usize);
            for i in from..from + length {
                let phase = std::f64::consts::PI * (i - from) as f64 / length as f64;
                for j in 0..dof {
                    l.tau_nm[(i, j)] += 60.0 * s.push[j] * phase.sin();
                }
            }
        }),
    );
    add(
        "payload",
        None,
        &[Payload],
        scaled(log, |l| l.tau_nm += &s.payload_nm),
    );
    out
}
