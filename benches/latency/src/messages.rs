//! Latency of the messages of a system alone: an arm state in one direction and torques in the other, in shared memory.

use crate::common::{
    CONTROLLER_PRIORITY, Common, Failure, Measured, PLANT_PRIORITY, PeerProcess, run_periodically,
};
use core::time::Duration;
use supple_ipc::message::{ArmState, Drives, PlantReport, TorqueCommand};
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_realtime::pause;

const PREFIX: &str = "latency";
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

pub fn measure(common: &Common) -> Result<Measured, Failure> {
    let link = PlantLink::new(&Domain::new(Some(PREFIX))?)?;
    let _answering = PeerProcess::start("answer", common, |_| ())?;
    let state = |cycle| {
        let report = PlantReport::default();
        ArmState::new(cycle, 0, &[Some(0.0); 4], None, Drives::Idle, report)
    };
    while !link.publish(&state(0))? {
        pause(Duration::from_millis(1));
    }
    common.enter(PLANT_PRIORITY);
    run_periodically(common, |cycle| {
        link.publish(&state(cycle))?;
        match link.answer(cycle, ANSWER_TIMEOUT)?.answer {
            Some(_) => Ok(()),
            None => Err("the peer does not reply".into()),
        }
    })
}

pub fn answer(common: &Common) -> Result<(), Failure> {
    let link = ControllerLink::new(&Domain::new(Some(PREFIX))?)?;
    common.enter(CONTROLLER_PRIORITY);
    while let Some(state) = link.wait(ANSWER_TIMEOUT)? {
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
