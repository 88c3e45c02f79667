//! Tests of the link to the controller: it discards commands for another arm without an error.

use core::time::Duration;
use supple_core::{Controller, State, step};
use supple_drive::{ArmReport, Counters, Drives, Link, SharedMemoryLink};
use supple_ipc::message::TorqueCommand;
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_model::Description;
use supple_realtime::Stop;

const TIMEOUT: Duration = Duration::from_secs(5);

#[test]
fn a_command_for_another_arm_is_counted_and_the_next_is_accepted() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::in_folder(&folder.path().join("run"), "other-arm").expect("a domain");
    let plant = PlantLink::new(&domain).expect("a plant");
    let controller_link = ControllerLink::new(&domain).expect("a controller");
    let mut link = SharedMemoryLink::new(plant, false, Stop::default());
    let description = Description::asset("wam4").expect("built in");
    let home = description.home::<4>().expect("four joints");
    let controller: Controller<4> =
        Controller::new(description.config().expect("valid")).expect("valid");
    let mut state = State::new(&controller);
    for cycle in 0..6 {
        let report = ArmReport::<4> {
            cycle,
            stamp_ns: cycle * 1_000_000,
            position_rad: core::array::from_fn(|i| Some(home[i])),
            tip_force_n: None,
            drives: Drives::Idle,
            counters: Counters::default(),
        };
        link.publish(&report).expect("published");
        let arm = controller_link
            .wait(TIMEOUT)
            .expect("read")
            .expect("a state");
        // Every other command is for an arm with seven joints.
        let accepted = cycle.div_ceil(2);
        assert_eq!(arm.plant.unusable, cycle - accepted);
        let output = step(
            &controller,
            &mut state,
            &arm.input(None).expect("four joints"),
        );
        let command = TorqueCommand::new(&output, false);
        let is_ours = cycle % 2 == 0;
        let dof = if is_ours { 4 } else { 7 };
        controller_link
            .answer(&TorqueCommand { dof, ..command })
            .expect("answered");
        let answer = Link::<4>::answer(&mut link, cycle, 1_000_000_000).expect("no error");
        assert_eq!(answer.command.is_some(), is_ours);
    }
}
