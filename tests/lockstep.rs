//! Tests controller and simulated arm through shared memory in virtual time: in every run, the results are bit-identical to those
//! in one process.

use core::time::Duration;
use std::path::Path;
use std::thread;
use supple_core::controller::{Mode, Request};
use supple_core::{Controller, Vector};
use supple_drive::SharedMemoryLink;
use supple_experiment::{Rig, scenario, start_pose};
use supple_ipc::message::{OperatorRequest, Telemetry};
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_model::Description;
use supple_plant::{Plant, PlantConfig};
use supple_realtime::{Stop, pause};
use supple_rt::{ControlLoop, loop_queues};
use supple_sim::{SimulatedArm, run_simulation, simulation};

/// Number of cycles of a run: the move to the start and a part of the sinusoid.
const CYCLES: u64 = 5000;
/// Cycles in which the move and the trajectory are requested.
const MOVE_AT: u64 = 100;
const TRACK_AT: u64 = 3500;

fn description() -> Description {
    Description::asset("wam4").expect("built in")
}

fn requests() -> [(u64, Request<4>); 3] {
    let config = description().config::<4>().expect("valid");
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
    Controller::new(description().config().expect("valid")).expect("valid")
}

fn plant() -> PlantConfig<4> {
    PlantConfig::from_description(&description()).expect("valid")
}

/// Runs the loops of both processes, each in its own thread.
fn over_shared_memory(folder: &Path) -> Vec<Telemetry> {
    let domain = Domain::in_folder(folder, "lockstep").expect("a domain");
    let (queues, mut helper_queues) = loop_queues();
    for (cycle, request) in requests() {
        assert!(helper_queues.request(OperatorRequest::new(1, cycle, Some(cycle), &request)));
    }
    let stop = Stop::default();
    let (controller_domain, plant_domain) = (domain.clone(), domain);
    let stop_control = stop.clone();
    let control = thread::spawn(move || {
        let link = ControllerLink::new(&controller_domain).expect("a controller");
        let mut control = ControlLoop::new(controller(), queues, true);
        control.run(&link, &stop_control).expect("it runs");
    });
    let simulation = thread::spawn(move || {
        let config = plant();
        let home = description().home().expect("four joints");
        let link = PlantLink::new(&plant_domain).expect("a plant");
        let link = SharedMemoryLink::new(link, true, Stop::default());
        let plant = Plant::new(config, home, Vector::zeros()).expect("valid");
        let arm = SimulatedArm::new(plant, true, 0.75);
        let limits = description().config().expect("valid");
        let mut simulation = simulation(arm, link, &limits).expect("a bus is not needed");
        run_simulation(&mut simulation, Some(CYCLES), true, &Stop::default())
    });
    let mut telemetry = Vec::new();
    while telemetry.len() < CYCLES as usize {
        match helper_queues.telemetry() {
            Some(cycle) => telemetry.push(cycle),
            None => pause(Duration::from_micros(200)),
        }
    }
    let summary = simulation.join().expect("no panic").expect("it runs");
    assert_eq!(
        (summary.cycles, summary.missed, summary.late),
        (CYCLES, 0, 0)
    );
    stop.request_shutdown();
    control.join().expect("no panic");
    telemetry
}

/// Returns the telemetry without wall-clock times, as text.
fn timeless(telemetry: &Telemetry) -> String {
    let mut telemetry = *telemetry;
    telemetry.timing = Default::default();
    telemetry.state.plant = Default::default();
    format!("{telemetry:?}")
}

#[test]
fn lockstep_runs_are_bit_identical_to_one_process() {
    let folders = [(); 2].map(|()| tempfile::tempdir().expect("a folder"));
    let [one, two] = folders.map(|folder| over_shared_memory(&folder.path().join("run")));
    let home = description().home().expect("four joints");
    let mut rig = Rig::new(controller(), plant(), home).expect("valid");
    let mut requests = requests().into_iter().peekable();
    for (cycle, (one, two)) in one.iter().zip(&two).enumerate() {
        assert_eq!(timeless(one), timeless(two), "cycle {cycle}");
        let request = requests.next_if(|(at, _)| *at == cycle as u64);
        let in_process = rig.cycle(request.map(|(_, request)| request));
        assert_eq!(in_process.output.refusal, None);
        let torque = one.record_of::<4>().torque_nm;
        assert_eq!(torque, in_process.output.torque_nm, "cycle {cycle}");
        let position = Vector::from([0, 1, 2, 3].map(|i| one.state.position_rad[i]));
        assert_eq!(
            position, in_process.measurement.position_rad,
            "cycle {cycle}"
        );
    }
    let last = one.last().expect("at least one cycle").record();
    assert_eq!((last.mode(), last.fault), (Some(Mode::Track), 0));
    assert!(
        last.tip_error_m().is_some_and(|error_m| error_m < 0.02),
        "{last:?}"
    );
}
