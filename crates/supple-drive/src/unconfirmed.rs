//! Frames that were sent in a cycle and that the CAN interface has not confirmed.

use supple_can_frame::CanFrame;

/// Maximum number of frames in a cycle: a torque and a property for each of seven motors, rounded up.
const CAPACITY: usize = 16;

/// Unconfirmed frames of one cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct UnconfirmedFrames {
    frames: [Option<CanFrame>; CAPACITY],
}

impl UnconfirmedFrames {
    /// Adds a sent frame.
    pub fn add(&mut self, frame: &CanFrame) {
        if let Some(slot) = self.frames.iter_mut().find(|slot| slot.is_none()) {
            *slot = Some(*frame);
        }
    }

    /// Removes a confirmed frame; returns whether it was unconfirmed until now.
    pub fn confirm(&mut self, frame: &CanFrame) -> bool {
        let slot = self.frames.iter_mut().find(|f| f.as_ref() == Some(frame));
        slot.is_some_and(|slot| slot.take().is_some())
    }

    /// Whether this frame is still unconfirmed.
    pub fn contains(&self, frame: &CanFrame) -> bool {
        self.frames.iter().flatten().any(|f| f == frame)
    }

    /// Returns the number of unconfirmed frames and removes them.
    pub fn take_count(&mut self) -> u64 {
        let lost = self.frames.iter().flatten().count() as u64;
        self.frames = [None; CAPACITY];
        lost
    }
}
