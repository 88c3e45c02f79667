//! Frames that were handed over in a cycle, until each is seen to have left.

use supple_puck::CanFrame;

/// The most frames that a cycle sends: request, two torque frames, module's mode, motors' mode, a poll.
const MOST: usize = 8;

/// Frames of one cycle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Outbox {
    frames: [Option<CanFrame>; MOST],
}

impl Outbox {
    /// A frame was handed over. A cycle that sends more than it has room for counts the rest as lost.
    pub fn put(&mut self, frame: &CanFrame) {
        if let Some(room) = self.frames.iter_mut().find(|room| room.is_none()) {
            *room = Some(*frame);
        }
    }

    /// A frame has left; whether it was one of these.
    pub fn confirm(&mut self, frame: &CanFrame) -> bool {
        let slot = self.frames.iter_mut().find(|f| f.as_ref() == Some(frame));
        slot.is_some_and(|slot| slot.take().is_some())
    }

    /// Whether this frame has not left yet.
    pub fn holds(&self, frame: &CanFrame) -> bool {
        self.frames.iter().flatten().any(|f| f == frame)
    }

    /// How many have not left; they are forgotten.
    pub fn close(&mut self) -> u64 {
        let lost = self.frames.iter().flatten().count() as u64;
        self.frames = [None; MOST];
        lost
    }
}
