//! In-process link that calls the controller step directly.

use supple_core::controller::Request;
use supple_core::{Controller, Input, Output, State, step};
use supple_drive::{Answer, ArmReport, Command, Drives, Link, LoopError};

pub struct InProcessLink<const N: usize> {
    controller: Controller<N>,
    state: State<N>,
    pub request: Option<Request<N>>,
    pub output: Option<Output<N>>,
    pub report: Option<ArmReport<N>>,
    /// Simulates a killed controller: states are neither read nor answered.
    pub dead: bool,
    /// Replaces the torques with NaN.
    pub not_finite: bool,
}

impl<const N: usize> InProcessLink<N> {
    pub fn new(controller: Controller<N>) -> Self {
        InProcessLink {
            state: State::new(&controller),
            controller,
            request: None,
            output: None,
            report: None,
            dead: false,
            not_finite: false,
        }
    }
}

impl<const N: usize> Link<N> for InProcessLink<N> {
    fn announce(&mut self) -> Result<(), LoopError> {
        Ok(())
    }

    fn publish(&mut self, report: &ArmReport<N>) -> Result<(), LoopError> {
        self.report = Some(*report);
        self.output = None;
        if !self.dead {
            let input = Input {
                cycle: report.cycle,
                position_rad: report.position_rad,
                tip_force_n: report.tip_force_n,
                drives_active: report.drives == Drives::Active,
                request: self.request.take(),
            };
            self.output = Some(step(&self.controller, &mut self.state, &input));
        }
        Ok(())
    }

    fn answer(&mut self, cycle: u64, _wait_ns: u64) -> Result<Answer<N>, LoopError> {
        let answers = |output: &Output<N>| output.cycle == cycle;
        let output = self.output.as_ref().filter(|output| answers(output));
        let command = output.map(|output| Command {
            torque_nm: match self.not_finite {
                true => output.torque_nm * f64::NAN,
                false => output.torque_nm,
            },
            fallback_torque_nm: output.fallback_torque_nm,
            wants_torque: wants_torque(output),
            mode: Some(output.mode),
            fault: output.fault.is_some(),
            codes: [0; 2],
        });
        Ok(Answer { command, late: 0 })
    }
}

/// False in idle and in faults whose safe action is torque off.
fn wants_torque<const N: usize>(output: &Output<N>) -> bool {
    !output.torque_off
}
