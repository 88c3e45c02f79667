//! What the messages of a system cost by themselves: an arm state there, torques back, in shared memory.

use crate::{ANSWERING_PRIORITY, ASKING_PRIORITY, Common, Failure, Measured, Other, once_a_period};
use core::time::Duration;
use supple_ipc::message::{ArmState, Drives, PlantReport, TorqueCommand};
use supple_ipc::{ControllerLink, Domain, PlantLink, pause};

const PREFIX: &str = "latency";
const PATIENCE: Duration = Duration::from_secs(5);

pub fn measure(common: &Common) -> Result<Measured, Failure> {
    let link = PlantLink::new(&Domain::new(Some(PREFIX))?)?;
    let _answering = Other::start("answer", common, |_| ())?;
    let state = |cycle| {
        let report = PlantReport::default();
        ArmState::new(cycle, 0, &[Some(0.0); 4], None, Drives::Idle, report)
    };
    while !link.publish(&state(0))? {
        pause(Duration::from_millis(1));
    }
    common.enter(ASKING_PRIORITY);
    once_a_period(common, |cycle| {
        link.publish(&state(cycle))?;
        match link.answer(cycle, PATIENCE)?.answer {
            Some(_) => Ok(()),
            None => Err("the other side does not answer".into()),
        }
    })
}

pub fn answer(common: &Common) -> Result<(), Failure> {
    let link = ControllerLink::new(&Domain::new(Some(PREFIX))?)?;
    common.enter(ANSWERING_PRIORITY);
    while let Some(state) = link.wait(PATIENCE)? {
        link.answer(&TorqueCommand {
            writer: 0,
            cycle: state.cycle,
            torque_nm: Default::default(),
            fallback_torque_nm: Default::default(),
            dof: state.dof,
            mode: 0,
            fault: 0,
            safe_action: 0,
            drives: state.drives,
            reserved: Default::default(),
        })?;
    }
    Ok(())
}
