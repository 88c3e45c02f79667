//! The way from a system that has just started to one that tracks.
//!
//! ```text
//! joining --first state--> held --drives active--> following
//!                           |
//!                           +-- an arm on a bus waits here for its pendant
//! ```

use crate::cli::PlantKind;
use crate::console::remark;
use crate::exit::Failure;
use crate::operate::{Approach, Pendant, Session};
use supple_core::controller::Request;
use supple_ipc::message::{Drives, Telemetry};

/// Gravity hold before the way to the start \[s\].
const SETTLE_S: f64 = 0.1;
/// Gravity hold before the pendant is pressed \[s\].
pub const HELD_S: f64 = 0.2;
/// From the pendant's button to drives that are active at the latest, and known to be \[s\].
const ACTIVATION_S: f64 = 0.1;

/// When the way to the start may begin in virtual time, of a simulated and of an emulated arm \[s\].
pub const START_S: [f64; 2] = [SETTLE_S, SETTLE_S + HELD_S + ACTIVATION_S];

/// How far it has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// No state yet.
    Joining,
    /// The controller holds the arm since this cycle, the drives are not active yet.
    Held(u64),
    /// The same, and the pendant was pressed, or its operator was asked to.
    Asked,
    /// On the way, or there.
    Following,
}

/// What happens when.
#[derive(Debug)]
pub struct Stages {
    stage: Stage,
    pendant: Option<Pendant>,
    plant: PlantKind,
    period_s: f64,
}

/// Whole cycles in a time \[s\].
pub fn cycles_of(time_s: f64, period_s: f64) -> u64 {
    (time_s / period_s).round() as u64
}

impl Stages {
    /// At the beginning. `pendant` is that of an emulated arm.
    pub fn new(pendant: Option<Pendant>, plant: PlantKind, period_s: f64) -> Stages {
        Stages {
            stage: Stage::Joining,
            pendant,
            plant,
            period_s,
        }
    }

    /// Settles it beforehand, as virtual time needs it: the pendant is pressed by the arm's own clock. Gives
    /// the cycle in which the way to the start may begin.
    ///
    /// # Errors
    /// [`Failure::Pendant`].
    pub fn plan(&mut self) -> Result<u64, Failure> {
        let start_s = START_S[usize::from(self.pendant.is_some())];
        if let Some(pendant) = &self.pendant {
            pendant.press(&format!("activate@held+{HELD_S}"))?;
        }
        self.stage = Stage::Following;
        Ok(cycles_of(start_s, self.period_s))
    }

    /// Takes the next step if it is time for it.
    ///
    /// # Errors
    /// What the controller refuses, a pendant that does not answer.
    pub fn advance<const N: usize>(
        &mut self,
        telemetry: &Telemetry,
        session: &mut Session<N>,
        approach: &Approach<N>,
    ) -> Result<(), Failure> {
        let cycle = telemetry.state.cycle;
        let active = telemetry.state.drives() == Drives::Active;
        match self.stage {
            Stage::Joining => {
                session.ask(&Request::GravityHold, None)?;
                self.stage = Stage::Held(cycle);
            }
            Stage::Held(_) | Stage::Asked if active => {
                let position = core::array::from_fn(|i| telemetry.position_rad[i]);
                let start = cycle + cycles_of(SETTLE_S, self.period_s);
                session.follow(approach, &position.into(), Some(start))?;
                self.stage = Stage::Following;
            }
            Stage::Held(since) if cycle >= since + cycles_of(HELD_S, self.period_s) => {
                match &self.pendant {
                    Some(pendant) => pendant.press("activate")?,
                    None if self.plant == PlantKind::Can => {
                        remark("the controller holds the arm: press Shift-Activate at the pendant");
                    }
                    None => {}
                }
                self.stage = Stage::Asked;
            }
            Stage::Held(_) | Stage::Asked | Stage::Following => {}
        }
        Ok(())
    }
}
