//! A scripted controller, which publishes telemetry, applies new gains, and refuses a stiffness above 500 N/m.

use core::cell::{Cell, RefCell};
use core::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::channel;
use std::thread::JoinHandle;
use std::time::Duration;
use supple_core::controller::{CycleRecord, Mode, Request};
use supple_ipc::message::{
    ArmState, CycleTiming, Drives, OperatorReply, Outcome, PlantReport, Telemetry, Text,
};
use supple_ipc::{Backpressure, Domain, IdleServer, OperatorServer, idle_reply};
use supple_model::Description;
use supple_realtime::{Stop, pause};
use supple_view::{Addresses, Options, Source};
use tempfile::TempDir;

/// Number of joints of the arm.
pub const N: usize = 4;
/// Maximum stiffness that the controller accepts \[N/m\].
pub const MAX_STIFFNESS: f64 = 500.0;

/// A scripted controller and the server of its page.
pub struct System {
    server: OperatorServer,
    domain: Domain,
    cycle: Cell<u64>,
    stiffness: Cell<[f64; 3]>,
    idle: RefCell<IdleServer>,
    /// Whether the controller ignores the requests of operators, like a controller whose helper thread hangs.
    pub mute: Cell<bool>,
    stop: Stop,
    view: Option<JoinHandle<()>>,
    _folder: TempDir,
}

impl System {
    /// Starts the controller and the server.
    pub fn start(options: Options) -> (System, Addresses) {
        let folder = tempfile::tempdir().expect("a folder");
        static SYSTEMS: AtomicU32 = AtomicU32::new(0);
        let number = SYSTEMS.fetch_add(1, Ordering::Relaxed);
        // The folder of an emulated arm's bus depends only on this name.
        let prefix = format!("view-{}-{number}", std::process::id());
        let domain = Domain::in_folder(&folder.path().join("run"), &prefix).expect("a domain");
        let server = OperatorServer::new(&domain, Backpressure::Drop).expect("a controller");
        let (stop, (sender, receiver)) = (Stop::default(), channel());
        let source = Source::System {
            domain: Box::new(domain.clone()),
            description: Box::new(Description::asset("wam4").expect("a built-in arm")),
        };
        let stopped = stop.clone();
        let view = std::thread::spawn(move || {
            let announce = |addresses: &Addresses| sender.send(addresses.clone()).expect("a test");
            supple_view::run(&source, &options, &stopped, announce).expect("served");
        });
        let addresses = receiver.recv_timeout(Duration::from_secs(60));
        let system = System {
            server,
            idle: RefCell::new(IdleServer::new(&domain).expect("a socket")),
            mute: Cell::new(false),
            domain,
            cycle: Cell::new(0),
            stiffness: Cell::new([5.0; 3]),
            stop,
            view: Some(view),
            _folder: folder,
        };
        (system, addresses.expect("the page's address"))
    }

    /// Returns the namespace of the system.
    pub fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Number of cycles so far.
    pub fn cycles(&self) -> u64 {
        self.cycle.get()
    }

    /// Runs one cycle: publishes telemetry and answers requests.
    pub fn step(&self) {
        let cycle = self.cycle.get();
        self.cycle.set(cycle + 1);
        let mut record = CycleRecord::<N>::unpack(&[0; CycleRecord::<N>::words(N)], N);
        record.step = cycle;
        record.cycle = cycle;
        record.mode = Mode::Track as u8;
        record.drives_active = true;
        record.position_rad[1] = 0.001 * cycle as f64;
        record.stiffness_n_per_m = self.stiffness.get();
        record.damping_n_s_per_m = [8.0; 3];
        let report = PlantReport::default();
        let stamp_ns = 1_000_000 * cycle;
        let measured = [Some(0.0); N];
        let state = ArmState::new(cycle, stamp_ns, &measured, None, Drives::Active, report);
        let telemetry = Telemetry::of(&record, &state, CycleTiming::default());
        self.server.publish(&telemetry).expect("published");
        let mut idle = self.idle.borrow_mut();
        if idle
            .receive_requests(cycle, Duration::ZERO)
            .expect("a socket")
        {
            let accepted = Outcome::Accepted;
            idle.answer(&idle_reply(cycle, cycle, Mode::Idle, accepted, Text::EMPTY));
        }
        while !self.mute.get()
            && let Some(message) = self.server.request().expect("a request")
        {
            let request = message.request::<N>().expect("the request is for this arm");
            let refused = match request {
                Some(Request::Gains { gains, .. }) => {
                    let wanted: [f64; 3] = gains.stiffness_n_per_m.into();
                    let refused = wanted.iter().any(|k| *k > MAX_STIFFNESS);
                    if !refused {
                        self.stiffness.set(wanted);
                    }
                    refused
                }
                _ => false,
            };
            let (outcome, text) = match refused {
                true => (Outcome::Refused, Text::of(&"refused: too stiff")),
                false => (Outcome::Accepted, Text::EMPTY),
            };
            let reply = OperatorReply::new(&message, cycle, Mode::Track, outcome, text);
            self.server.reply(&reply).expect("replied");
        }
        pause(Duration::from_millis(1));
    }
}

impl Drop for System {
    fn drop(&mut self) {
        self.stop.request_shutdown();
        let ended = self.view.take().map(JoinHandle::join);
        if !std::thread::panicking() {
            assert!(
                matches!(ended, Some(Ok(()))),
                "the page ended with an error"
            );
        }
    }
}
