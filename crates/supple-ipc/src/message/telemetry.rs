//! Telemetry of one cycle of the controller, for logs and displays.

use super::ArmState;
use super::common::MAX_DOF;
use iceoryx2::prelude::ZeroCopySend;
use supple_core::controller::CycleRecord;
use supple_core::{Input, Output};

/// Number of words in the record of the largest arm.
const WORDS: usize = CycleRecord::<MAX_DOF>::words(MAX_DOF);

/// One cycle of the controller: input, output and timing.
#[derive(Clone, Copy, Debug, PartialEq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.Telemetry.v6")]
pub struct Telemetry {
    /// The state that the controller received, with the report of the plant.
    pub state: ArmState,
    /// Number of arm states discarded since the start, because they were not written by this system's plant or were of another
    /// arm.
    pub states_dropped: u64,
    /// Times of this cycle.
    pub timing: CycleTiming,
    /// The record of the cycle, see [`CycleRecord::pack`]; the remaining words are zero.
    words: [u64; WORDS],
}

/// Times of one cycle of the controller, by the monotonic clock.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ZeroCopySend)]
#[repr(C)]
#[type_name("supple.CycleTiming.v1")]
pub struct CycleTiming {
    /// Time since the start of the previous step \[ns\]; 0 in the first cycle.
    pub period_ns: u64,
    /// Time from the measurement to the start of the step \[ns\]; 0 in virtual time.
    pub latency_ns: u64,
    /// Duration of the step, including the check for requests \[ns\].
    pub step_ns: u64,
}

impl Telemetry {
    /// Creates the telemetry of a step; `step` is the number of the step since the controller started.
    pub fn new<const N: usize>(
        step: u64,
        state: &ArmState,
        input: &Input<N>,
        output: &Output<N>,
        timing: CycleTiming,
    ) -> Telemetry {
        Telemetry::of(&CycleRecord::new(step, input, output), state, timing)
    }

    /// Creates telemetry from a record.
    pub fn of<const N: usize>(
        record: &CycleRecord<N>,
        state: &ArmState,
        timing: CycleTiming,
    ) -> Telemetry {
        const { assert!(N <= MAX_DOF) };
        let mut words = [0; WORDS];
        record.pack(&mut words);
        Telemetry {
            state: *state,
            states_dropped: 0,
            timing,
            words,
        }
    }

    /// Joints of the arm.
    pub fn dof(&self) -> usize {
        usize::from(self.state.dof).min(MAX_DOF)
    }

    /// Number of the step since the controller started; a gap in the numbers means that the reader has lost records.
    pub fn step(&self) -> u64 {
        // The step number is the first field of the record; no other field is decoded.
        self.words[0]
    }

    /// Returns the record of the cycle; the values of joints that the arm does not have are zero.
    pub fn record(&self) -> CycleRecord<MAX_DOF> {
        self.record_of()
    }

    /// Returns the record of the cycle for the first `N` joints.
    pub fn record_of<const N: usize>(&self) -> CycleRecord<N> {
        CycleRecord::unpack(&self.words, self.dof())
    }

    /// The words of the record.
    pub fn words(&self) -> &[u64] {
        &self.words[..CycleRecord::<MAX_DOF>::words(self.dof())]
    }
}
