//! Motions that wait for a later cycle, and the pose from which each of them is checked.
//!
//! A motion is checked when it is requested, from the pose in which it will begin if that is known: the end of the
//! motion that was requested before it. In real time, the helper keeps a motion that waits and checks it a second time
//! shortly before its cycle, from the pose of the arm at that time. In virtual time, the loop gets the motion at once,
//! because the result must not depend on the speed of a thread.

use crate::request_queue::{QueueFull, RequestQueue};
use supple_core::codes::request_kind;
use supple_core::controller::Mode;
use supple_ipc::message::{MAX_DOF, OperatorReply, OperatorRequest, Outcome};

/// Joint angles, padded with zeros to the maximum number of joints \[rad\].
pub type Pose = [f64; MAX_DOF];

/// Number of cycles before its own cycle at which a waiting motion is checked again and passed to the loop. A check takes
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

/// Pose after the motions that were requested so far.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum NextPose {
    /// No motion waits: the pose is the present pose of the arm.
    #[default]
    Present,
    /// End pose of a motion, given by its operator and sequence number.
    EndOf(u64, u64, Pose),
    /// The end pose of the motion that waits for this cycle is not known.
    Unknown(u64),
}

/// Pose from which a motion is checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum StartPose {
    /// The present pose of the arm.
    Present,
    /// The end pose of the motion before it.
    Known(Pose),
    /// The pose is not known yet: only properties that do not depend on it are checked.
    Unknown,
}

/// Tracks the start pose of the next motion.
#[derive(Clone, Copy, Debug, Default)]
pub struct MotionPlan {
    next: NextPose,
}

impl MotionPlan {
    /// Returns the pose from which a request is checked.
    pub fn start_pose(&self, request: &OperatorRequest) -> StartPose {
        match self.next {
            _ if !request.is_scheduled() => StartPose::Present,
            NextPose::EndOf(_, _, pose) => StartPose::Known(pose),
            NextPose::Unknown(_) => StartPose::Unknown,
            // The pose before the scheduled move is not known; other motions are checked from the present pose.
            NextPose::Present if request.kind == request_kind::MOVE => StartPose::Unknown,
            NextPose::Present => StartPose::Present,
        }
    }

    /// Records a motion that passed its check; `end_rad` is its end pose, if known \[rad\].
    pub fn record_accepted(&mut self, request: &OperatorRequest, end_rad: Option<Pose>) {
        if !is_motion(request) {
            return;
        }
        self.next = match end_rad {
            Some(pose) => NextPose::EndOf(request.operator, request.sequence, pose),
            None if request.is_scheduled() => NextPose::Unknown(request.at_cycle),
            None => NextPose::Present,
        };
    }

    /// Processes a reply of the loop: a motion that the loop refused does not determine the next start pose.
    pub fn handle_reply(&mut self, reply: &OperatorReply) {
        if let NextPose::EndOf(operator, sequence, _) = self.next
            && reply.outcome() == Outcome::Refused
            && (reply.operator, reply.sequence) == (operator, sequence)
        {
            self.next = NextPose::Present;
        }
    }

    /// Records that all requested motions have been cancelled: the next motion starts from the present pose.
    pub fn reset(&mut self) {
        self.next = NextPose::Present;
    }

    /// Processes the cycle of the loop: a motion that waited for an earlier cycle has begun.
    pub fn update(&mut self, cycle: u64) {
        if matches!(self.next, NextPose::Unknown(at_cycle) if cycle > at_cycle) {
            self.next = NextPose::Present;
        }
    }
}

/// Motions that wait in the helper for their cycle.
#[derive(Debug, Default)]
pub struct WaitingMotions {
    queue: RequestQueue,
    fault: bool,
    mode: Option<Mode>,
    drives_active: bool,
}

impl WaitingMotions {
    /// Whether the helper keeps a request, if the loop has reached `cycle`.
    pub fn must_wait(request: &OperatorRequest, cycle: u64) -> bool {
        request.is_scheduled()
            && is_motion(request)
            && request.at_cycle > cycle.saturating_add(CHECK_LEAD_CYCLES)
    }

    /// Adds a request.
    ///
    /// # Errors
    /// [`QueueFull`] with the exhausted limit.
    pub fn push(&mut self, request: OperatorRequest) -> Result<(), QueueFull> {
        self.queue.push(request)
    }

    /// Removes and returns the next motion that must be checked in `cycle`.
    pub fn pop_due(&mut self, cycle: u64) -> Option<OperatorRequest> {
        let reached = cycle.saturating_add(CHECK_LEAD_CYCLES);
        self.queue.pop_due(reached).map(|(_, request)| request)
    }

    /// Removes and returns the first motion, due or not.
    pub fn pop(&mut self) -> Option<OperatorRequest> {
        self.queue.pop()
    }

    /// Whether a cycle cancels the waiting motions, as the loop does with its queued requests: a fault latches, the mode becomes
    /// idle, or the drives are no longer active.
    pub fn cancelled_by(&mut self, mode: Option<Mode>, fault: bool, drives_active: bool) -> bool {
        let latched = fault && !self.fault;
        let deactivated = self.drives_active && !drives_active;
        // Before the first cycle, the controller is already idle.
        let idle = mode == Some(Mode::Idle) && !matches!(self.mode, None | Some(Mode::Idle));
        (self.fault, self.mode, self.drives_active) = (fault, mode, drives_active);
        latched || idle || deactivated
    }
}

/// Whether a request is for a mode without motion in the next cycle, which cancels the motions that were requested before.
pub fn cancels_motions(request: &OperatorRequest) -> bool {
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

    /// Every motion after a move starts from the end pose of the move, whichever operator requests it.
    #[test]
    fn a_motion_after_a_move_starts_from_the_end_pose_of_the_move() {
        for motion in motions() {
            let mut plan = MotionPlan::default();
            plan.record_accepted(&message(1, 1, None, &to_somewhere()), Some(END_RAD));
            let later = message(2, 7, Some(5000), &motion);
            assert_eq!(plan.start_pose(&later), StartPose::Known(END_RAD));
            // A motion for the next cycle starts from the present pose.
            let now = message(2, 8, None, &motion);
            assert_eq!(plan.start_pose(&now), StartPose::Present);
        }
    }

    #[test]
    fn a_move_that_the_loop_refused_does_not_change_the_start_pose() {
        let mut plan = MotionPlan::default();
        let refused = message(1, 1, None, &to_somewhere());
        plan.record_accepted(&refused, Some(END_RAD));
        let reply = |sequence, outcome| {
            let request = message(1, sequence, None, &to_somewhere());
            OperatorReply::new(&request, 0, Mode::GravityHold, outcome, Text::EMPTY)
        };
        let later = message(1, 2, Some(5000), &motions()[1]);
        plan.handle_reply(&reply(1, Outcome::Accepted));
        plan.handle_reply(&reply(9, Outcome::Refused));
        assert_eq!(plan.start_pose(&later), StartPose::Known(END_RAD));
        plan.handle_reply(&reply(1, Outcome::Refused));
        assert_eq!(plan.start_pose(&later), StartPose::Present);
    }

    #[test]
    fn the_end_pose_of_a_tip_path_is_unknown_until_the_path_has_begun() {
        let mut plan = MotionPlan::default();
        let [to, track, ..] = motions();
        assert_eq!(
            plan.start_pose(&message(1, 1, Some(100), &to)),
            StartPose::Unknown
        );
        plan.record_accepted(&message(1, 1, Some(1000), &track), None);
        let next = message(1, 2, Some(9000), &track);
        plan.update(1000);
        assert_eq!(plan.start_pose(&next), StartPose::Unknown);
        plan.update(1001);
        assert_eq!(plan.start_pose(&next), StartPose::Present);
    }

    #[test]
    fn motions_wait_until_shortly_before_their_cycle() {
        let mut waiting = WaitingMotions::default();
        let motion = message(1, 1, Some(1000), &to_somewhere());
        assert!(WaitingMotions::must_wait(&motion, 0));
        assert!(!WaitingMotions::must_wait(
            &motion,
            1000 - CHECK_LEAD_CYCLES
        ));
        let other = message(1, 1, Some(1000), &Request::Reset);
        assert!(!WaitingMotions::must_wait(&other, 0));
        waiting.push(motion).expect("room");
        assert_eq!(waiting.pop_due(999 - CHECK_LEAD_CYCLES), None);
        assert_eq!(waiting.pop_due(1000 - CHECK_LEAD_CYCLES), Some(motion));
    }

    #[test]
    fn a_fault_idle_and_inactive_drives_cancel_waiting_motions_once() {
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
            let found = waiting.cancelled_by(Some(mode), fault, drives_active);
            assert_eq!(found, ended, "{mode:?}, {fault}, {drives_active}");
        }
    }
}
