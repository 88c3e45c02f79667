//! Controller and simulated arm over shared memory in virtual time: the same bits as in one process, and the
//! same bits each time.

use core::time::Duration;
use std::path::Path;
use std::thread;
use supple_core::controller::{Mode, Request};
use supple_core::{Controller, Vector};
use supple_experiment::{Rig, scenario, start_pose};
use supple_ipc::message::{OperatorRequest, Telemetry};
use supple_ipc::{ControllerLink, Domain, PlantLink, pause};
use supple_model::Description;
use supple_plant::{Plant, PlantConfig};
use supple_realtime::Stop;
use supple_rt::{ControlLoop, rings};
use supple_sim::{Motors, World};

/// Cycles of a run: the way to the start and a little of the sinusoid.
const CYCLES: u64 = 5000;
/// Cycle of the move, and of the trajectory.
const MOVE_AT: u64 = 100;
const TRACK_AT: u64 = 3500;

fn description() -> Description {
    Description::asset("wam4").expect("built in")
}

fn requests() -> [(u64, Request<4>); 3] {
    let config = description().config::<4>().expect("sound");
    let (trajectory, duration_s) = scenario::sinusoid(1.0);
    let target_rad = start_pose(&config, "sinusoid", &trajectory, duration_s).expect("in reach");
    let there = Request::Move {
        target_rad,
        duration_s: 3.0,
    };
    [
        (0, Request::GravityHold),
        (MOVE_AT, there),
        (TRACK_AT, Request::Track(trajectory)),
    ]
}

fn controller() -> Controller<4> {
    Controller::new(description().config().expect("sound")).expect("sound")
}

fn plant() -> PlantConfig<4> {
    PlantConfig::from_description(&description()).expect("sound")
}

/// Both processes' loops, each in its own thread.
fn over_shared_memory(folder: &Path) -> Vec<Telemetry> {
    let domain = Domain::within(folder, "lockstep").expect("a domain");
    let (inside, mut outside) = rings();
    for (cycle, request) in requests() {
        assert!(outside.request(OperatorRequest::new(1, cycle, Some(cycle), &request)));
    }
    let stop = Stop::default();
    let (of_controller, of_plant) = (domain.clone(), domain);
    let asked = stop.clone();
    let control = thread::spawn(move || {
        let link = ControllerLink::new(&of_controller).expect("a controller");
        let mut control = ControlLoop::new(controller(), inside, true);
        control.run(&link, &asked).expect("it runs");
    });
    let world = thread::spawn(move || {
        let config = plant();
        let home = description().home().expect("four joints");
        let motors = Motors::new(
            config.cycle_s,
            supple_core::drive_guard::DriveGuard::new(&description().config().expect("sound")),
        );
        let link = PlantLink::new(&of_plant).expect("a plant");
        let plant = Plant::new(config, home, Vector::zeros()).expect("sound");
        World::new(plant, motors, link).run_in_virtual_time(Some(CYCLES), &Stop::default())
    });
    let mut telemetry = Vec::new();
    while telemetry.len() < CYCLES as usize {
        match outside.telemetry() {
            Some(cycle) => telemetry.push(cycle),
            None => pause(Duration::from_micros(200)),
        }
    }
    let summary = world.join().expect("no panic").expect("it runs");
    assert_eq!(
        (summary.cycles, summary.missed, summary.late),
        (CYCLES, 0, 0)
    );
    stop.ask();
    control.join().expect("no panic");
    telemetry
}

/// Everything but the times of the wall clock.
fn timeless(telemetry: &Telemetry) -> String {
    let mut telemetry = *telemetry;
    telemetry.timing = Default::default();
    telemetry.state.plant = Default::default();
    format!("{telemetry:?}")
}

#[test]
fn the_processes_in_lockstep_give_the_bits_of_one_process_every_time() {
    let folders = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let [one, two] = folders.map(|folder| over_shared_memory(&folder.path().join("run")));
    let home = description().home().expect("four joints");
    let mut rig = Rig::new(controller(), plant(), home).expect("sound");
    let mut requests = requests().into_iter().peekable();
    for (cycle, (one, two)) in one.iter().zip(&two).enumerate() {
        assert_eq!(timeless(one), timeless(two), "cycle {cycle}");
        let request = requests.next_if(|(at, _)| *at == cycle as u64);
        let inside = rig.cycle(request.map(|(_, request)| request));
        assert_eq!(inside.output.refusal, None);
        let torque = Vector::from([0, 1, 2, 3].map(|i| one.torque_nm[i]));
        assert_eq!(torque, inside.output.torque_nm, "cycle {cycle}");
        let position = Vector::from([0, 1, 2, 3].map(|i| one.state.position_rad[i]));
        assert_eq!(position, inside.measurement.position_rad, "cycle {cycle}");
    }
    let last = one.last().expect("there are some");
    assert_eq!((last.mode(), last.fault), (Some(Mode::Track), 0));
    assert!(
        last.tip_error_m().is_some_and(|error_m| error_m < 0.02),
        "{last:?}"
    );
}
