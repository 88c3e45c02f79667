//! The arm's side of the bus: a node that echoes every frame of the host, in virtual time or in a thread.

use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use supple_bus::virtual_time::{EmulatedNodes, LockstepResponder};
use supple_bus::{Bus, Event, PacedResponder};
use supple_can_frame::{CanFrame, CanId};

/// Transmission time of a frame in virtual time \[ns\].
const FRAME_NS: u64 = 100_000;

/// Returns the answer of the echo node to a frame of the host: the same payload in the same format.
pub fn echo_of(frame: &CanFrame) -> CanFrame {
    CanFrame::of_format(
        CanId::standard(0x426).unwrap(),
        frame.format(),
        frame.payload(),
    )
    .unwrap()
}

#[derive(Default)]
pub struct EchoNodes {
    now_ns: u64,
    busy_until_ns: u64,
    events: VecDeque<(u64, Event)>,
}

impl EmulatedNodes for EchoNodes {
    fn now_ns(&self) -> u64 {
        self.now_ns
    }

    fn receive_from_host(&mut self, frame: &CanFrame) {
        for event in [Event::Sent(*frame), Event::Frame(echo_of(frame))] {
            self.busy_until_ns = self.busy_until_ns.max(self.now_ns) + FRAME_NS;
            self.events.push_back((self.busy_until_ns, event));
        }
    }

    fn run_until(&mut self, until_ns: u64) -> Option<Event> {
        match self.events.front().copied() {
            Some((due, event)) if due <= until_ns => {
                self.events.pop_front();
                self.now_ns = due.max(self.now_ns);
                Some(event)
            }
            _ => {
                self.now_ns = until_ns.max(self.now_ns);
                None
            }
        }
    }
}

/// A thread that echoes frames; it ends when this value is dropped.
pub struct EchoThread {
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl EchoThread {
    fn run(work: impl Fn(&AtomicBool) + Send + 'static) -> EchoThread {
        let stop = Arc::new(AtomicBool::new(false));
        let stop_flag = stop.clone();
        EchoThread {
            stop,
            thread: Some(std::thread::spawn(move || work(&stop_flag))),
        }
    }

    pub fn on_bus<B: Bus + Send + 'static>(bus: B) -> EchoThread {
        let bus = std::sync::Mutex::new(bus);
        EchoThread::run(move |stop| {
            let mut bus = bus.lock().unwrap();
            while !stop.load(Ordering::Relaxed) {
                let until_ns = bus.now_ns() + 5_000_000;
                if let Some(Event::Frame(frame)) = bus.receive_until(until_ns).unwrap() {
                    bus.send(&echo_of(&frame)).unwrap();
                }
            }
        })
    }

    pub fn responder(responder: LockstepResponder) -> EchoThread {
        let responder = std::sync::Mutex::new((responder, EchoNodes::default()));
        EchoThread::run(move |stop| {
            let (responder, peer) = &mut *responder.lock().unwrap();
            while !stop.load(Ordering::Relaxed) {
                responder.serve(peer, 5_000_000).unwrap();
            }
        })
    }

    pub fn paced(responder: PacedResponder) -> EchoThread {
        let shared = std::sync::Mutex::new((responder, EchoNodes::default()));
        EchoThread::run(move |stop| {
            let (responder, peer) = &mut *shared.lock().unwrap();
            while !stop.load(Ordering::Relaxed) {
                responder.serve(peer).unwrap();
            }
        })
    }
}

impl Drop for EchoThread {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let ended = thread.join();
            assert!(
                ended.is_ok() || std::thread::panicking(),
                "the echo thread panicked"
            );
        }
    }
}
