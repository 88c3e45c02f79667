//! Model of the bus medium, which carries one frame at a time for the duration of its bits.
//!
//! When the bus is free, the waiting frame with the lowest id starts; a frame that has started is not
//! interrupted. Bus errors and retransmissions are not modelled.

use supple_can_frame::{BitRates, CanFrame};

/// A waiting frame.
#[derive(Clone, Copy, Debug)]
struct QueuedFrame {
    ready_ns: u64,
    frame: CanFrame,
}

/// The bus medium with all waiting frames.
#[derive(Clone, Debug)]
pub struct Wire {
    rates: BitRates,
    waiting: Vec<QueuedFrame>,
    /// The current frame and its end time \[ns\].
    current: Option<(CanFrame, u64)>,
    free_ns: u64,
    busy_ns: u64,
}

impl Wire {
    /// Creates a free bus with these bit rates.
    pub fn new(rates: BitRates) -> Wire {
        Wire {
            rates,
            waiting: Vec::new(),
            current: None,
            free_ns: 0,
            busy_ns: 0,
        }
    }

    /// Queues a frame for transmission from `ready_ns` on. Frames of one node with equal times are sent in the order of the
    /// calls.
    pub fn queue(&mut self, ready_ns: u64, frame: CanFrame) {
        self.waiting.push(QueuedFrame { ready_ns, frame });
    }

    /// Returns the end time of the current or next frame \[ns\], if any. A frame that is queued later can be sent first only if
    /// this frame has not started.
    pub fn next_end_ns(&self) -> Option<u64> {
        match (self.current, self.next()) {
            (Some((_, end_ns)), _) => Some(end_ns),
            (None, Some((begin_ns, index))) => {
                Some(begin_ns + self.rates.duration_ns(&self.waiting[index].frame))
            }
            (None, None) => None,
        }
    }

    /// Starts the next frame if it is due by `now_ns`; returns the current frame if it ends by then.
    pub fn advance(&mut self, now_ns: u64) -> Option<(CanFrame, u64)> {
        if self.current.is_none()
            && let Some((begin_ns, index)) = self.next()
            && begin_ns <= now_ns
        {
            let frame = self.waiting.remove(index).frame;
            let end_ns = begin_ns + self.rates.duration_ns(&frame);
            self.busy_ns += end_ns - begin_ns;
            self.current = Some((frame, end_ns));
        }
        match self.current {
            Some((frame, end_ns)) if end_ns <= now_ns => {
                self.current = None;
                self.free_ns = end_ns;
                Some((frame, end_ns))
            }
            _ => None,
        }
    }

    /// Pauses for `gap_ns`: discards all waiting frames and delays the end of a frame in transmission by `gap_ns`.
    pub fn pause(&mut self, gap_ns: u64) {
        self.waiting.clear();
        self.free_ns += gap_ns;
        if let Some((_, end_ns)) = &mut self.current {
            *end_ns += gap_ns;
        }
    }

    /// Discards the waiting frames for which `is_discarded` returns true.
    pub fn discard(&mut self, is_discarded: impl Fn(&CanFrame) -> bool) {
        self.waiting.retain(|waiting| !is_discarded(&waiting.frame));
    }

    /// Total time for which frames have occupied the bus \[ns\].
    pub fn busy_ns(&self) -> u64 {
        self.busy_ns
    }

    /// Start time and index of the next frame.
    fn next(&self) -> Option<(u64, usize)> {
        let earliest = self.waiting.iter().map(|w| w.ready_ns).min()?;
        let begin_ns = earliest.max(self.free_ns);
        let ready = self.waiting.iter().enumerate();
        let ready = ready.filter(|(_, w)| w.ready_ns <= begin_ns);
        let (index, _) = ready.min_by_key(|(index, w)| (w.frame.id(), *index))?;
        Some((begin_ns, index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u32, dlc: usize) -> CanFrame {
        CanFrame::from_raw(id, &[0x55; 8][..dlc]).unwrap()
    }

    fn run(wire: &mut Wire) -> Vec<(u32, u64)> {
        let mut ends = Vec::new();
        while let Some(end_ns) = wire.next_end_ns() {
            if let Some((frame, end_ns)) = wire.advance(end_ns) {
                ends.push((frame.id().raw(), end_ns));
            }
        }
        ends
    }

    #[test]
    fn the_waiting_frame_with_the_lowest_id_starts() {
        let mut wire = Wire::new(BitRates::CLASSIC_1M);
        wire.queue(0, frame(0x4e3, 3));
        wire.queue(10, frame(0x443, 3));
        wire.queue(20, frame(0x423, 3));
        let order: Vec<_> = run(&mut wire).into_iter().map(|(id, _)| id).collect();
        assert_eq!(order, [0x4e3, 0x423, 0x443]);
    }

    #[test]
    fn frames_follow_each_other_without_overlap() {
        let mut wire = Wire::new(BitRates::CLASSIC_1M);
        let frames: Vec<_> = (1..=7u32).map(|n| frame(0x403 | n << 5, 3)).collect();
        for frame in &frames {
            wire.queue(1000, *frame);
        }
        let total: u64 = frames
            .iter()
            .map(|frame| BitRates::CLASSIC_1M.duration_ns(frame))
            .sum();
        assert_eq!(
            run(&mut wire).last().map(|(_, end)| *end),
            Some(1000 + total)
        );
        assert_eq!(wire.busy_ns(), total);
    }

    #[test]
    fn a_pause_discards_waiting_frames_and_delays_the_end_of_the_current_frame() {
        let mut wire = Wire::new(BitRates::CLASSIC_1M);
        wire.queue(0, frame(0x423, 3));
        let end_ns = wire.next_end_ns().unwrap();
        assert!(wire.advance(10).is_none());
        wire.queue(20, frame(0x443, 3));
        wire.pause(1_000_000);
        assert_eq!(run(&mut wire), [(0x423, end_ns + 1_000_000)]);
        wire.queue(0, frame(0x423, 3));
        wire.queue(0, frame(0x443, 3));
        wire.discard(|frame| frame.id().raw() == 0x423);
        assert_eq!(run(&mut wire).len(), 1);
    }

    /// Barrett's 75 us for a position reply lie between the durations without and with maximum stuffing.
    #[test]
    fn the_duration_of_a_position_reply_is_that_of_its_bits() {
        let ns = BitRates::CLASSIC_1M.duration_ns(&frame(0x423, 3));
        assert!((71_000..=85_000).contains(&ns), "{ns}");
    }
}
