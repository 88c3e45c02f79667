//! How well a model holds an arm: its drift in gravity hold, and its error under weak joint stiffness, in poses of the excitation.

use super::{GAINS_S, ModelStage, Run, config};
use crate::procedure::arm::{Motion, MotionArm};
use crate::procedure::error::ProcedureError;
use crate::procedure::motions::{Motions, every_way, moves, with_held_at};
use crate::procedure::sweep::Sweep;
use crate::procedure::{HOLD_REMEDY, Operator, ProcedureOptions};
use crate::request_sequence::Step;
use serde::Serialize;
use supple_core::config::JointGains;
use supple_core::controller::Request;
use supple_core::dynamics::tip_pose;
use supple_core::{Config, Vector};
use supple_model::Description;

/// Time at the end over which angles are averaged \[s\].
const MEAN_S: f64 = 0.5;
/// Time in which weak stiffness takes over from the move \[s\].
const HANDOVER_S: f64 = 1.0;
/// Distance by which a way may leave the confirmed space, which is wider than the arm, without another question \[m\].
const DRIFT_M: f64 = 0.05;

/// Options of the check.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoldCheckOptions<const N: usize> {
    /// Number of poses.
    pub poses: usize,
    /// Time for which each pose is held, without and with stiffness \[s\].
    pub hold_s: f64,
    /// Gains of the joints; their stiffness is that of the second part.
    pub gains: JointGains<N>,
}

/// How a pose was held.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HeldPose {
    /// Pose \[rad\].
    pub position_rad: Vec<f64>,
    /// Distance by which the tip drifts in gravity hold, by the encoders \[m\]; `None` if it was not held to the end.
    pub tip_drift_m: Option<f64>,
    /// Distance of each joint from the pose under stiffness, at the end \[rad\]; empty if it was not held to the end.
    pub joint_error_rad: Vec<f64>,
    /// The fault that ended the pose, or why the controller refused it.
    pub ended: Option<String>,
}

/// Result of the check.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct HoldCheck {
    /// Name of the arm.
    pub arm: String,
    /// Names of the joints.
    pub joints: Vec<String>,
    /// Time for which each pose was held, without and with stiffness \[s\].
    pub hold_s: f64,
    /// Stiffness of the joints \[N m/rad\].
    pub stiffness_nm_per_rad: Vec<f64>,
    /// The poses.
    pub poses: Vec<HeldPose>,
    /// Time in modes that move joints \[s\].
    pub moved_s: f64,
}

impl HoldCheck {
    /// Greatest drift of the tip in gravity hold \[m\]; `None` without a pose that was held to the end.
    pub fn worst_drift_m(&self) -> Option<f64> {
        let drifts = self.poses.iter().filter_map(|pose| pose.tip_drift_m);
        drifts.reduce(f64::max)
    }

    /// Greatest error of each joint under stiffness \[rad\]; `None` without a pose that was held to the end.
    pub fn worst_error_rad(&self) -> Option<Vec<f64>> {
        let of_joint = |joint: usize| {
            let errors = self.poses.iter();
            let errors = errors.filter_map(|pose| pose.joint_error_rad.get(joint));
            errors.copied().reduce(f64::max)
        };
        (0..self.joints.len()).map(of_joint).collect()
    }

    /// Number of poses that were not held to the end.
    pub fn ended(&self) -> usize {
        self.poses
            .iter()
            .filter(|pose| pose.ended.is_some())
            .count()
    }
}

/// Moves an arm with the model `start` to poses of its excitation. Each is held in gravity hold, then by joint impedance with the
/// stiffness of `check`. The operator confirms the swept space before. There are two logs for each pose, `logs/hold-<number>-gravity.mcap` and
/// `-stiffness.mcap`.
///
/// # Errors
/// [`ProcedureError`] with the remedy, and the errors of the arm. A fault or a refusal in a pose ends this pose only; an error if all of
/// them ended so.
pub fn check_hold<const N: usize, A: MotionArm<N>>(
    arm: &mut A,
    start: &Description,
    check: &HoldCheckOptions<N>,
    options: &ProcedureOptions,
    operator: &mut dyn Operator,
) -> Result<HoldCheck, A::Error> {
    let mut run = Run::without_progress(arm, start, options, operator)?;
    let motions = run.design(ModelStage::Given)?;
    let model = config::<N>(start)?;
    let poses = poses(&model, &run.home_rad, &motions, check.poses);
    run.ensure_model(ModelStage::Given)?;
    let (limits, home_rad) = (run.limits, run.home_rad);
    let via_pose = run.via_pose(ModelStage::Given)?;
    let from_rad = run.arm.position_rad()?;
    let minutes = poses.len() as f64 * (2.0 * check.hold_s + 6.0) / 60.0;
    run.report(&format!(
        "{} poses follow, about {minutes:.0} minutes",
        poses.len()
    ));
    let route = every_way(&from_rad, &poses, &home_rad, via_pose.as_ref());
    run.confirm_sweep(&Sweep::of_moves(&model, &from_rad, &route, &home_rad))?;
    let mut held = Vec::with_capacity(poses.len());
    for (number, pose_rad) in poses.iter().enumerate() {
        run.report(&format!("pose {} of {}", number + 1, poses.len()));
        let moves = |from_rad: &Vector<N>| moves(&limits, via_pose.as_ref(), from_rad, pose_rad);
        held.push(run.held_pose(
            &model,
            &format!("hold-{}", number + 1),
            pose_rad,
            &moves,
            check,
        )?);
    }
    run.motion("home", &|from_rad| {
        moves(&limits, via_pose.as_ref(), from_rad, &home_rad)
    })?;
    if let Some(fault) = held.iter().find_map(|pose| pose.ended.clone())
        && held.iter().all(|pose| pose.ended.is_some())
    {
        return Err(ProcedureError::Stopped {
            motion: "hold-check".to_owned(),
            fault,
            remedy: HOLD_REMEDY,
        }
        .into());
    }
    Ok(HoldCheck {
        arm: start.name().to_owned(),
        joints: start.joint_names().to_vec(),
        hold_s: check.hold_s,
        stiffness_nm_per_rad: check.gains.stiffness_nm_per_rad.as_slice().to_vec(),
        poses: held,
        moved_s: run.progress.moved_s,
    })
}

impl<const N: usize, A: MotionArm<N>> Run<'_, N, A> {
    fn held_pose(
        &mut self,
        model: &Config<N>,
        name: &str,
        pose_rad: &Vector<N>,
        moves: &dyn Fn(&Vector<N>) -> Vec<Step<N>>,
        check: &HoldCheckOptions<N>,
    ) -> Result<HeldPose, A::Error> {
        let approach = self.confirmed_moves(model, moves)?;
        let recorded = |request, duration_s| Step {
            recorded: true,
            ..Step::wait(request, duration_s)
        };
        let gains = Request::JointGains {
            gains: check.gains,
            ramp_s: 0.5 * GAINS_S,
        };
        let impedance = Request::JointImpedance {
            target_rad: *pose_rad,
            duration_s: HANDOVER_S,
        };
        let gravity_hold = recorded(Request::GravityHold, check.hold_s);
        let steps = [approach, vec![gravity_hold]].concat();
        let mut held = HeldPose {
            position_rad: pose_rad.as_slice().to_vec(),
            tip_drift_m: None,
            joint_error_rad: Vec::new(),
            ended: None,
        };
        match self.held_motion(&format!("{name}-gravity"), &steps)? {
            Ok(motion) => held.tip_drift_m = Some(tip_drift_m(model, &motion)),
            Err(fault) => {
                held.ended = Some(fault);
                return Ok(held);
            }
        }
        // The arm may have drifted far.
        let back = self.confirmed_moves(model, moves)?;
        let stiffness = [
            Step::wait(gains, GAINS_S),
            recorded(impedance, HANDOVER_S + check.hold_s),
        ];
        let steps = [back, stiffness.to_vec()].concat();
        match self.held_motion(&format!("{name}-stiffness"), &steps)? {
            Ok(motion) => {
                let end_rad = mean_rad::<N>(&motion, true, model.period_s);
                held.joint_error_rad = (end_rad - pose_rad).abs().as_slice().to_vec();
            }
            Err(fault) => held.ended = Some(fault),
        }
        Ok(held)
    }

    /// Returns the moves from the present pose. The operator confirms their space if it leaves the confirmed one: the arm has drifted far, or a
    /// fault has laid it down.
    fn confirmed_moves(
        &mut self,
        model: &Config<N>,
        moves: &dyn Fn(&Vector<N>) -> Vec<Step<N>>,
    ) -> Result<Vec<Step<N>>, A::Error> {
        let from_rad = self.arm.position_rad()?;
        let steps = moves(&from_rad);
        let targets: Vec<_> = steps.iter().filter_map(move_target_rad).collect();
        let end_rad = targets.last().copied().unwrap_or(from_rad);
        let sweep = Sweep::of_moves(model, &from_rad, &targets, &end_rad);
        if let Some(wider) = beyond(self.progress.sweep.as_ref(), sweep) {
            self.report("the arm is elsewhere than planned: its way leaves the confirmed space");
            self.confirm_sweep(&wider)?;
        }
        Ok(steps)
    }

    /// Performs steps of which the last one is recorded; returns its data, or the fault that ended one of them, or why one was refused even
    /// with slower moves.
    fn held_motion(
        &mut self,
        name: &str,
        steps: &[Step<N>],
    ) -> Result<Result<Motion, String>, A::Error> {
        let mut performed = self.arm.perform(name, steps);
        if performed.as_ref().is_err_and(|e| A::refusal(e).is_some()) {
            performed = self.arm.perform(name, &slower(steps));
        }
        let performed = match performed {
            Ok(performed) => performed,
            Err(error) => {
                let refusal = A::refusal(&error).map(str::to_owned);
                return refusal.map(Err).ok_or(error);
            }
        };
        self.progress.moved_s += performed.moved_s;
        if let Some(stopped) = performed.stopped {
            self.arm.recover()?;
            return Ok(Err(stopped.fault));
        }
        let motion = performed.motions.into_iter().next();
        Ok(motion.ok_or_else(|| "no cycle was recorded".to_owned()))
    }
}

/// Returns the space to confirm if a way leaves the confirmed one by more than [`DRIFT_M`]: both, so that later ways need no question.
fn beyond(confirmed: Option<&Sweep>, way: Sweep) -> Option<Sweep> {
    match confirmed {
        Some(confirmed) if confirmed.contains_within(&way, DRIFT_M) => None,
        Some(confirmed) => Some(confirmed.clone().with(way)),
        None => Some(way),
    }
}

/// Returns steps whose moves take twice the time.
fn slower<const N: usize>(steps: &[Step<N>]) -> Vec<Step<N>> {
    let mut steps = steps.to_vec();
    for step in &mut steps {
        if let Request::Move { duration_s, .. } = &mut step.request {
            *duration_s *= 2.0;
            step.duration_s *= 2.0;
        }
    }
    steps
}

/// Returns the target of a move.
fn move_target_rad<const N: usize>(step: &Step<N>) -> Option<Vector<N>> {
    match step.request {
        Request::Move { target_rad, .. } => Some(target_rad),
        _ => None,
    }
}

/// Returns poses of the excitations at equal distances in time; held joints stay in the home pose.
fn poses<const N: usize>(
    config: &Config<N>,
    home_rad: &Vector<N>,
    motions: &Motions<N>,
    count: usize,
) -> Vec<Vector<N>> {
    let whole_s: f64 = motions.full.iter().map(|series| series.duration_s).sum();
    let at = |mut time_s: f64| {
        for series in &motions.full {
            if time_s <= series.duration_s {
                return series.at(time_s).position_rad;
            }
            time_s -= series.duration_s;
        }
        *home_rad
    };
    let times = (0..count).map(|k| whole_s * (k as f64 + 0.5) / count as f64);
    times
        .map(at)
        .map(|pose_rad| with_held_at(config, &pose_rad, home_rad))
        .collect()
}

/// Returns the mean angles over the first or the last [`MEAN_S`] of a motion.
fn mean_rad<const N: usize>(motion: &Motion, last: bool, period_s: f64) -> Vector<N> {
    let q = &motion.recording.q_rad;
    let count = ((MEAN_S / period_s) as usize).clamp(1, q.nrows().max(1));
    let first = if last {
        q.nrows().saturating_sub(count)
    } else {
        0
    };
    let rows = q.rows(first, count.min(q.nrows()));
    Vector::from_fn(|joint, _| rows.column(joint).mean())
}

/// Returns the distance of the tip between the beginning and the end of a motion \[m\].
fn tip_drift_m<const N: usize>(model: &Config<N>, motion: &Motion) -> f64 {
    let tip_m = |last| {
        let position_rad = mean_rad::<N>(motion, last, model.period_s);
        tip_pose(&model.arm, &position_rad).translation
    };
    (tip_m(true) - tip_m(false)).norm()
}

#[cfg(test)]
mod tests {
    use super::{DRIFT_M, Sweep, beyond, every_way, move_target_rad, moves, with_held_at};
    use crate::procedure::motions::ViaPose;
    use crate::procedure::motions::tests::{spread_poses, yam};
    use supple_core::config::Role;

    /// Also where the arm goes by a via pose, it stays in the space that the operator confirmed.
    #[test]
    fn the_confirmed_space_contains_every_move() {
        let config = yam();
        let mut went_by_via_pose = 0;
        for all in spread_poses(&config).chunks_exact(5) {
            let (from_rad, home_rad) = (all[0], all[3]);
            let poses =
                &[all[1], all[2]].map(|pose_rad| with_held_at(&config, &pose_rad, &home_rad));
            let via_pose = ViaPose::new(config, &all[4], home_rad);
            let route = every_way(&from_rad, poses, &home_rad, Some(&via_pose));
            let confirmed = Sweep::of_moves(&config, &from_rad, &route, &home_rad);
            let (mut at_rad, mut targets) = (from_rad, Vec::new());
            for to_rad in poses.iter().chain([&home_rad]) {
                let steps = moves(&config, Some(&via_pose), &at_rad, to_rad);
                went_by_via_pose += steps.len() - 1;
                let moved_to = steps.iter().map(|step| move_target_rad(step).unwrap());
                for target_rad in moved_to {
                    for (joint, role) in config.roles.iter().enumerate() {
                        let is_there = target_rad[joint] == home_rad[joint];
                        assert!(
                            is_there || !matches!(role, Role::Held { .. }),
                            "joint {joint}"
                        );
                    }
                    targets.push(target_rad);
                }
                assert_eq!(targets.last(), Some(to_rad));
                at_rad = *to_rad;
            }
            let moved = Sweep::of_moves(&config, &from_rad, &targets, &home_rad);
            assert!(
                confirmed.contains(&moved),
                "{} does not contain {}",
                confirmed.text(),
                moved.text()
            );
        }
        assert!(went_by_via_pose > 10, "{went_by_via_pose}");
    }

    /// What was confirmed stays confirmed, and a drift within the margin asks nothing.
    #[test]
    fn a_way_beyond_the_confirmed_space_adds_to_it() {
        let config = yam();
        let poses = spread_poses(&config);
        let way = |pair: &[_]| Sweep::of_moves(&config, &pair[0], &pair[1..], &pair[1]);
        let mut asked = 0;
        for four in poses.chunks_exact(4) {
            let (confirmed, other) = (way(&four[..2]), way(&four[2..]));
            let wider = beyond(Some(&confirmed), other.clone());
            assert_eq!(wider.is_none(), confirmed.contains_within(&other, DRIFT_M));
            assert_eq!(beyond(Some(&confirmed), confirmed.clone()), None);
            if let Some(wider) = wider {
                asked += 1;
                assert!(wider.contains(&confirmed) && wider.contains(&other));
                assert_eq!(beyond(Some(&wider), other), None);
            }
        }
        assert!(asked > 3, "{asked}");
    }
}
