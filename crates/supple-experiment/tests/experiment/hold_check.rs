//! Holding in poses by an arm whose controller refuses moves.

use std::collections::BTreeMap;
use supple_core::Vector;
use supple_core::controller::Request;
use supple_experiment::calibrate::plant_of;
use supple_experiment::procedure::{
    HoldCheckOptions, InProcessArm, LOGS, MotionArm, Operator, PerformedMotion, ProcedureError,
    ProcedureOptions, Sweep, check_hold,
};
use supple_experiment::{Calibration, ExperimentError, Step};
use supple_model::Description;

const REASON: &str = "joint joint2 would need 18.01 N m, limit 18.00 N m; request a slower motion";

/// A simulated arm that refuses motions of these names so many times.
struct Refusing {
    arm: InProcessArm<4>,
    refuses: BTreeMap<&'static str, u32>,
    /// Duration of the moves of each motion that was requested \[s\].
    moves_s: Vec<(String, f64)>,
}

impl MotionArm<4> for Refusing {
    type Error = ProcedureError;

    fn load(&mut self, model: &Description) -> Result<(), ProcedureError> {
        self.arm.load(model)
    }

    fn refusal(error: &ProcedureError) -> Option<&str> {
        InProcessArm::<4>::refusal(error)
    }

    fn position_rad(&mut self) -> Result<Vector<4>, ProcedureError> {
        self.arm.position_rad()
    }

    fn perform(
        &mut self,
        name: &str,
        steps: &[Step<4>],
    ) -> Result<PerformedMotion, ProcedureError> {
        let moves_s = steps.iter().filter_map(|step| match step.request {
            Request::Move { duration_s, .. } => Some(duration_s),
            _ => None,
        });
        self.moves_s.push((name.to_owned(), moves_s.sum()));
        match self.refuses.get_mut(name) {
            Some(left) if *left > 0 => {
                *left -= 1;
                Err(ExperimentError::Refused {
                    experiment: name.to_owned(),
                    reason: REASON.to_owned(),
                }
                .into())
            }
            _ => self.arm.perform(name, steps),
        }
    }

    fn recover(&mut self) -> Result<(), ProcedureError> {
        self.arm.recover()
    }

    fn learned(&mut self) -> Result<Option<Description>, ProcedureError> {
        self.arm.learned()
    }

    fn take_weight(
        &mut self,
        weight_kg: f64,
        attach: &mut dyn FnMut() -> bool,
    ) -> Result<(), ProcedureError> {
        self.arm.take_weight(weight_kg, attach)
    }

    fn meanwhile<T: Send>(&mut self, work: impl FnOnce() -> T + Send) -> Result<T, ProcedureError> {
        self.arm.meanwhile(work)
    }
}

struct Confirms;

impl Operator for Confirms {
    fn progress(&mut self, _: &str) {}

    fn confirms(&mut self, _: &Sweep, _: &std::path::Path) -> bool {
        true
    }

    fn attaches_weight(&mut self, _: f64) -> bool {
        false
    }
}

/// A refused way is tried at half of its speed. Expected: the first pose is held after that; the second one is refused again, has no result
/// but the reason, and the third one is held all the same.
#[test]
fn a_refused_move_is_tried_more_slowly_and_ends_its_pose_only() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir_all(folder.path().join(LOGS)).unwrap();
    let description = Description::asset("wam4").unwrap();
    let plant = plant_of::<4>(&description, &Calibration::new(0)).unwrap();
    let home = description.home::<4>().unwrap();
    let mut arm = Refusing {
        arm: InProcessArm::new(plant, home, folder.path().join(LOGS), BTreeMap::new()),
        refuses: BTreeMap::from([("hold-1-gravity", 1), ("hold-2-gravity", 2)]),
        moves_s: Vec::new(),
    };
    let check = HoldCheckOptions {
        poses: 3,
        hold_s: 1.0,
        gains: description.config::<4>().unwrap().joint_gains,
    };
    let options = ProcedureOptions::new(folder.path().to_owned());
    let found = check_hold(&mut arm, &description, &check, &options, &mut Confirms).unwrap();
    let ended: Vec<_> = found.poses.iter().map(|pose| pose.ended.clone()).collect();
    assert_eq!(ended, [None, Some(REASON.to_owned()), None]);
    assert_eq!(found.ended(), 1);
    for (pose, held) in found.poses.iter().zip([true, false, true]) {
        assert_eq!(pose.tip_drift_m.is_some(), held);
        assert_eq!(pose.joint_error_rad.is_empty(), !held);
    }
    let of = |name: &str| {
        let moves = arm.moves_s.iter().filter(|(of, _)| of == name);
        moves.map(|(_, duration_s)| *duration_s).collect::<Vec<_>>()
    };
    for refused in ["hold-1-gravity", "hold-2-gravity"] {
        let tried = of(refused);
        assert_eq!(tried.len(), 2, "{refused}");
        assert!(tried[0] > 0.0 && tried[1] == 2.0 * tried[0], "{tried:?}");
    }
    assert_eq!(of("hold-3-gravity").len(), 1);
}
