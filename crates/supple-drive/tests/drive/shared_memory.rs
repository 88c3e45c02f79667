//! Tests of the link to the controller: it discards commands for another arm without an error, and in virtual time it waits for a
//! controller for up to a minute, unless it has left.

use core::time::Duration;
use supple_core::{Controller, State, step};
use supple_drive::{ArmReport, Counters, Drives, Link, SharedMemoryLink};
use supple_ipc::message::TorqueCommand;
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_model::Description;
use supple_realtime::Stop;

const TIMEOUT: Duration = Duration::from_secs(5);

fn report(cycle: u64, position_rad: [f64; 4]) -> ArmReport<4> {
    ArmReport {
        cycle,
        stamp_ns: cycle * 1_000_000,
        position_rad: position_rad.map(Some),
        tip_force_n: None,
        drives: Drives::Idle,
        counters: Counters::default(),
    }
}

/// A controller may wait for a reader of its telemetry for more than two seconds; one that has ended is not waited for any longer.
#[test]
fn in_virtual_time_a_slow_controller_is_waited_for_and_an_ended_one_is_not() {
    let folder = tempfile::tempdir().expect("a folder");
    let domain = Domain::in_folder(&folder.path().join("run"), "slow").expect("a domain");
    let plant = PlantLink::new(&domain).expect("a plant");
    let mut link = SharedMemoryLink::new(plant, true, Stop::default());
    let description = Description::asset("wam4").expect("built in");
    let home = description.home::<4>().expect("four joints");
    let controller = || Controller::<4>::new(description.config().expect("valid")).expect("valid");
    std::thread::scope(|scope| {
        let slow = scope.spawn(|| {
            let link = ControllerLink::new(&domain).expect("a controller");
            let state = link.wait(TIMEOUT).expect("read").expect("a state");
            let controller = controller();
            let input = state.input(None).expect("four joints");
            let output = step(&controller, &mut State::new(&controller), &input);
            supple_realtime::pause(Duration::from_millis(2500));
            let command = TorqueCommand::new(&output, false);
            link.answer(&command).expect("answered");
        });
        link.publish(&report(0, home.into())).expect("published");
        let answer = Link::<4>::answer(&mut link, 0, 0).expect("no error");
        assert!(answer.command.is_some());
        slow.join().expect("no panic");
    });
    let answer = Link::<4>::answer(&mut link, 1, 0).expect("no error");
    assert!(answer.command.is_none());
}

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
        link.publish(&report(cycle, home.into()))
            .expect("published");
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
