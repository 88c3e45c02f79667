//! A control loop whose ports and queues the test controls, and a function that ends a process.
#![allow(dead_code, reason = "each test program uses only some of these items")]

use core::time::Duration;
use rustix::process::{Pid, Signal, kill_process};
use std::process::Child;
use supple_core::controller::Request;
use supple_core::math::Vector3;
use supple_core::{Controller, Vector};
use supple_ipc::message::{
    ArmState, Drives, OperatorReply, OperatorRequest, PlantReport, Telemetry, TorqueCommand,
};
use supple_ipc::{ControllerLink, Domain, PlantLink};
use supple_model::Description;
use supple_realtime::Stop;
use supple_rt::{ControlLoop, HelperQueues, IdleThreadChannel, idle_channel, loop_queues};
use tempfile::TempDir;

const TIMEOUT: Duration = Duration::from_secs(5);

pub fn description() -> Description {
    Description::asset("wam4").expect("built in")
}

pub fn controller() -> Controller<4> {
    Controller::new(description().config().expect("valid")).expect("valid")
}

pub struct Bench {
    pub control: ControlLoop<4>,
    pub link: ControllerLink,
    pub plant: PlantLink,
    /// `None` once the helper thread has ended.
    pub helper_queues: Option<HelperQueues>,
    /// `None` once the idle-request thread has ended.
    pub idle: Option<IdleThreadChannel>,
    pub stop: Stop,
    pub home_rad: Vector<4>,
    pub cycle: u64,
    sequence: u64,
    _folder: TempDir,
}

impl Bench {
    pub fn new(virtual_time: bool) -> Bench {
        let folder = tempfile::tempdir().expect("a folder");
        let domain = Domain::in_folder(&folder.path().join("run"), "loop").expect("a domain");
        let (queues, helper_queues) = loop_queues();
        let (idle_channel_end, idle) = idle_channel();
        let mut control = ControlLoop::new(controller(), queues, virtual_time);
        control.set_idle_channel(idle_channel_end);
        Bench {
            control,
            link: ControllerLink::new(&domain).expect("a controller"),
            plant: PlantLink::new(&domain).expect("a plant"),
            helper_queues: Some(helper_queues),
            idle: Some(idle),
            stop: Stop::default(),
            home_rad: description().home().expect("four joints"),
            cycle: 0,
            sequence: 0,
            _folder: folder,
        }
    }

    /// Returns a state of the arm at standstill in its home pose.
    pub fn state(&self, drives: Drives) -> ArmState {
        ArmState::new::<4>(
            self.cycle,
            self.cycle * 1_000_000,
            &core::array::from_fn(|i| Some(self.home_rad[i])),
            Some(Vector3::zeros()),
            drives,
            PlantReport::default(),
        )
    }

    /// Runs one iteration of the loop; returns whether the loop continues.
    pub fn run_iteration(&mut self) -> bool {
        self.control
            .run_iteration(&self.link, &self.stop)
            .expect("an iteration")
    }

    /// Announces a state on behalf of the plant.
    pub fn announce(&mut self) {
        self.plant.announce().expect("announced");
        assert!(self.run_iteration());
    }

    /// Runs one cycle; returns the loop's answer and whether the loop continues.
    pub fn cycle(&mut self, drives: Drives) -> (TorqueCommand, bool) {
        self.plant.publish(&self.state(drives)).expect("published");
        let goes_on = self.run_iteration();
        let received = self.plant.answer(self.cycle, TIMEOUT).expect("read");
        self.cycle += 1;
        (received.answer.expect("an answer"), goes_on)
    }

    /// Runs one cycle with active drives; returns the loop's answer.
    pub fn active_cycle(&mut self) -> TorqueCommand {
        self.cycle(Drives::Active).0
    }

    pub fn helper_queues(&mut self) -> &mut HelperQueues {
        self.helper_queues.as_mut().expect("there")
    }

    pub fn idle(&mut self) -> &mut IdleThreadChannel {
        self.idle.as_mut().expect("there")
    }

    /// Queues a request of operator 1; the sequence numbers count from 1.
    pub fn request(&mut self, request: &Request<4>, at_cycle: Option<u64>) {
        self.sequence += 1;
        assert!(self.enqueue(1, self.sequence, request, at_cycle));
    }

    /// Returns whether the queue had room for the request.
    pub fn enqueue(
        &mut self,
        operator: u64,
        sequence: u64,
        request: &Request<4>,
        at_cycle: Option<u64>,
    ) -> bool {
        let message = OperatorRequest::new(operator, sequence, at_cycle, request);
        self.helper_queues().request(message)
    }

    pub fn replies(&mut self) -> Vec<OperatorReply> {
        let helper_queues = self.helper_queues();
        core::iter::from_fn(|| helper_queues.reply()).collect()
    }

    pub fn telemetry(&mut self) -> Vec<Telemetry> {
        let helper_queues = self.helper_queues();
        core::iter::from_fn(|| helper_queues.telemetry()).collect()
    }
}

/// Requests shutdown of a process.
pub fn terminate(child: &Child) {
    let process = i32::try_from(child.id()).expect("a process number");
    let process = Pid::from_raw(process).expect("not zero");
    kill_process(process, Signal::TERM).expect("it runs");
}
