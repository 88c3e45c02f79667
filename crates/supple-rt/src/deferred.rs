//! Motions that wait for a later cycle: from which pose they are checked, and when.
//!
//! A motion is checked when it is requested, from the pose in which it will begin if that is known: the end of the
//! motion that was requested before it. In wall-clock time a motion that waits is checked a second time shortly before
//! its cycle, from the pose in which the arm is then; until then the helper keeps it. In virtual time the loop gets it
//! at once, because requests must not depend on the speed of a thread.

use crate::request_queue::{QueueFull, RequestQueue};
use supple_core::codes::request_kind;
use supple_core::controller::Mode;
use supple_ipc::message::{MAX_DOF, OperatorReply, OperatorRequest, Outcome};

/// Joint angles, padded for any arm \[rad\].
pub type Pose = [f64; MAX_DOF];

/// Cycles before its own in which a motion that waits is checked again, and passed to the loop. A check takes
/// milliseconds, and several motions may be due at once.
pub const CHECK_LEAD_CYCLES: u64 = 40;

/// Whether a request moves the arm along a path that can be checked beforehand.
pub fn is_motion(request: &OperatorRequest) -> bool {
    matches!(
        request.kind,
        request_kind::MOVE
            | request_kind::TRACK
            | request_kind::TRACK_POSE
            | request_kind::JOINT_IMPEDANCE
            | request_kind::EXCITE
            | request_kind::BREAKAWAY
    )
}

/// What is known of the pose after the motions that were requested so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Next {
    /// Nothing waits: the pose that the arm is in.
    #[default]
    Present,
    /// The end of this operator's motion with this sequence number.
    EndOf(u64, u64, Pose),
    /// The end of a motion that waits for this cycle is not known.
    Unknown(u64),
}

/// Pose from which a motion is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartPose {
    /// The one that the arm is in.
    Present,
    /// The end of the motion before it.
    Known(Pose),
    /// Not known yet: what does not depend on it is checked.
    Unknown,
}

/// Poses between the motions that were requested.
#[derive(Clone, Copy, Debug, Default)]
pub struct MotionPlan {
    next: Next,
}

impl MotionPlan {
    /// Start pose of a request.
    pub fn start_pose(&self, request: &OperatorRequest) -> StartPose {
        match self.next {
            _ if !request.is_scheduled() => StartPose::Present,
            Next::EndOf(_, _, pose) => StartPose::Known(pose),
            Next::Unknown(_) => StartPose::Unknown,
            // What it follows is not known: only a path that begins where the arm is can be judged from there.
            Next::Present if request.kind == request_kind::MOVE => StartPose::Unknown,
            Next::Present => StartPose::Present,
        }
    }

    /// A motion passed its check; `end_rad` is its end pose, if known \[rad\].
    pub fn passed(&mut self, request: &OperatorRequest, end_rad: Option<Pose>) {
        if !is_motion(request) {
            return;
        }
        self.next = match end_rad {
            Some(pose) => Next::EndOf(request.operator, request.sequence, pose),
            None if request.is_scheduled() => Next::Unknown(request.at_cycle),
            None => Next::Present,
        };
    }

    /// The loop replied: a motion that it refused leads nowhere.
    pub fn replied(&mut self, reply: &OperatorReply) {
        if let Next::EndOf(operator, sequence, _) = self.next
            && reply.outcome() == Outcome::Refused
            && (reply.operator, reply.sequence) == (operator, sequence)
        {
            self.next = Next::Present;
        }
    }

    /// The arm is where it is: nothing that was requested before it leads anywhere.
    pub fn ended(&mut self) {
        self.next = Next::Present;
    }

    /// The loop is in this cycle: a motion that waited for an earlier one has begun.
    pub fn cycle(&mut self, cycle: u64) {
        if matches!(self.next, Next::Unknown(at_cycle) if cycle > at_cycle) {
            self.next = Next::Present;
        }
    }
}

/// Motions that wait in the helper.
#[derive(Debug, Default)]
pub struct WaitingMotions {
    queue: RequestQueue,
    fault: bool,
    mode: Option<Mode>,
    drives_active: bool,
}

impl WaitingMotions {
    /// Whether a request is one to be kept, if the loop has reached `cycle`.
    pub fn keeps(request: &OperatorRequest, cycle: u64) -> bool {
        request.is_scheduled()
            && is_motion(request)
            && request.at_cycle > cycle.saturating_add(CHECK_LEAD_CYCLES)
    }

    /// Keeps a request.
    ///
    /// # Errors
    /// [`QueueFull`].
    pub fn push(&mut self, request: OperatorRequest) -> Result<(), QueueFull> {
        self.queue.push(request)
    }

    /// Takes the next motion that is to be checked in `cycle`.
    pub fn pop(&mut self, cycle: u64) -> Option<OperatorRequest> {
        let reached = cycle.saturating_add(CHECK_LEAD_CYCLES);
        self.queue.pop_due(reached).map(|(_, request)| request)
    }

    /// Takes any, to refuse it.
    pub fn take(&mut self) -> Option<OperatorRequest> {
        self.queue.pop()
    }

    /// Whether a cycle ends what waits, as in the loop: a fault latches, the mode becomes idle, or the drives are no
    /// longer active.
    pub fn is_ended_by(&mut self, mode: Option<Mode>, fault: bool, drives_active: bool) -> bool {
        let latched = fault && !self.fault;
        let deactivated = self.drives_active && !drives_active;
        // Before the first cycle the controller is idle already.
        let idle = mode == Some(Mode::Idle) && !matches!(self.mode, None | Some(Mode::Idle));
        (self.fault, self.mode, self.drives_active) = (fault, mode, drives_active);
        latched || idle || deactivated
    }
}

/// Whether an operator wants the arm to rest now, so that what was requested before must not move it later.
pub fn ends_motions(request: &OperatorRequest) -> bool {
    let rests = matches!(
        request.kind,
        request_kind::IDLE | request_kind::GRAVITY_HOLD | request_kind::FLOAT
    );
    rests && !request.is_scheduled()
}

#[cfg(test)]
mod tests {
    use super::*;
    use supple_core::controller::Request;
    use supple_core::math::Vector3;
    use supple_core::trajectory::Rotation;
    use supple_core::{Trajectory, Vector};
    use supple_ipc::message::Text;

    const END_RAD: Pose = [0.5; supple_ipc::message::MAX_DOF];

    fn message(
        operator: u64,
        sequence: u64,
        at: Option<u64>,
        request: &Request<4>,
    ) -> OperatorRequest {
        OperatorRequest::new(operator, sequence, at, request)
    }

    fn to_somewhere() -> Request<4> {
        Request::Move {
            target_rad: Vector::repeat(0.5),
            duration_s: 2.0,
        }
    }

    fn motions() -> [Request<4>; 4] {
        let trajectory = Trajectory::Hold(Vector3::zeros());
        let rotation = Rotation {
            axis: Vector3::z(),
            angle_rad: 0.1,
            duration_s: 1.0,
        };
        [
            to_somewhere(),
            Request::Track(trajectory),
            Request::TrackPose {
                trajectory,
                rotation,
            },
            Request::JointImpedance {
                target_rad: Vector::repeat(0.1),
                duration_s: 1.0,
            },
        ]
    }

    /// Every motion after a move begins at its end, whoever requests it.
    #[test]
    fn a_motion_after_a_move_begins_at_its_end() {
        for motion in motions() {
            let mut plan = MotionPlan::default();
            plan.passed(&message(1, 1, None, &to_somewhere()), Some(END_RAD));
            let later = message(2, 7, Some(5000), &motion);
            assert_eq!(plan.start_pose(&later), StartPose::Known(END_RAD));
            // One that begins now begins where the arm is.
            let now = message(2, 8, None, &motion);
            assert_eq!(plan.start_pose(&now), StartPose::Present);
        }
    }

    #[test]
    fn a_move_that_the_loop_refused_leads_nowhere() {
        let mut plan = MotionPlan::default();
        let refused = message(1, 1, None, &to_somewhere());
        plan.passed(&refused, Some(END_RAD));
        let reply = |sequence, outcome| {
            let request = message(1, sequence, None, &to_somewhere());
            OperatorReply::new(&request, 0, Mode::GravityHold, outcome, Text::EMPTY)
        };
        let later = message(1, 2, Some(5000), &motions()[1]);
        plan.replied(&reply(1, Outcome::Accepted));
        plan.replied(&reply(9, Outcome::Refused));
        assert_eq!(plan.start_pose(&later), StartPose::Known(END_RAD));
        plan.replied(&reply(1, Outcome::Refused));
        assert_eq!(plan.start_pose(&later), StartPose::Present);
    }

    #[test]
    fn the_end_of_a_path_of_the_tip_is_unknown_until_it_has_begun() {
        let mut plan = MotionPlan::default();
        let [to, track, ..] = motions();
        assert_eq!(
            plan.start_pose(&message(1, 1, Some(100), &to)),
            StartPose::Unknown
        );
        plan.passed(&message(1, 1, Some(1000), &track), None);
        let next = message(1, 2, Some(9000), &track);
        plan.cycle(1000);
        assert_eq!(plan.start_pose(&next), StartPose::Unknown);
        plan.cycle(1001);
        assert_eq!(plan.start_pose(&next), StartPose::Present);
    }

    #[test]
    fn motions_wait_until_shortly_before_their_cycle() {
        let mut waiting = WaitingMotions::default();
        let motion = message(1, 1, Some(1000), &to_somewhere());
        assert!(WaitingMotions::keeps(&motion, 0));
        assert!(!WaitingMotions::keeps(&motion, 1000 - CHECK_LEAD_CYCLES));
        let other = message(1, 1, Some(1000), &Request::Reset);
        assert!(!WaitingMotions::keeps(&other, 0));
        waiting.push(motion).expect("room");
        assert_eq!(waiting.pop(999 - CHECK_LEAD_CYCLES), None);
        assert_eq!(waiting.pop(1000 - CHECK_LEAD_CYCLES), Some(motion));
    }

    #[test]
    fn a_fault_and_idle_end_what_waits_once() {
        let mut waiting = WaitingMotions::default();
        for (mode, fault, drives_active, ended) in [
            (Mode::Idle, false, false, false),
            (Mode::GravityHold, false, false, false),
            (Mode::Move, false, true, false),
            (Mode::Fault, true, true, true),
            (Mode::Fault, true, true, false),
            (Mode::Idle, false, true, true),
            (Mode::Idle, false, true, false),
            (Mode::Track, false, true, false),
            (Mode::GravityHold, false, false, true),
            (Mode::GravityHold, false, false, false),
        ] {
            let found = waiting.is_ended_by(Some(mode), fault, drives_active);
            assert_eq!(found, ended, "{mode:?}, {fault}, {drives_active}");
        }
    }
}
