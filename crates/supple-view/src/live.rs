//! The thread that reads the telemetry of a running system and sends requests to it. Only this thread accesses shared memory.
//! It polls, so that it cannot delay the controller.

use crate::error::ViewError;
use crate::hub::{Answer, Hub, PendingCommand};
use crate::snapshot::{CycleExtras, SnapshotBuilder};
use core::time::Duration;
use std::sync::mpsc::{Receiver, Sender};
use std::time::Instant;
use supple_ipc::message::{Drives, OperatorReply, Outcome, Telemetry};
use supple_ipc::{Domain, OperatorClient, TelemetryReader};
use supple_log::{CycleTiming, Extras, LiveEncoder};
use supple_model::Description;
use supple_realtime::{Stop, monotonic_ns, pause, since_epoch_ns};

/// Id of the channel of snapshots; the ids of the log's channels follow.
pub const VIEW_CHANNEL: u32 = 0;
/// Time between two polls. The queue of telemetry holds two seconds at 1 kHz.
const POLL_INTERVAL: Duration = Duration::from_millis(5);
/// Time between two snapshots.
const SNAPSHOT_INTERVAL: Duration = Duration::from_millis(33);
/// Time between two messages of each channel of the log \[ns\].
const MESSAGE_INTERVAL_NS: u64 = 10_000_000;
/// Timeout of a reply to a request.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(4);

/// A request that awaits its reply.
struct SentRequest {
    sequence: u64,
    at: Instant,
    answer: Sender<Answer>,
}

/// Connection to a running system of an arm with `N` joints.
pub struct LiveConnection<'a, const N: usize> {
    hub: &'a Hub,
    reader: TelemetryReader,
    operator: Option<OperatorClient>,
    encoder: LiveEncoder<N>,
    builder: SnapshotBuilder<N>,
    last: Option<Telemetry>,
    sent: Vec<SentRequest>,
    /// Offset from the stamps of states to the time since the epoch \[ns\].
    offset_ns: u64,
    next_message_ns: u64,
}

impl<'a, const N: usize> LiveConnection<'a, N> {
    /// Connects to the system, also as an operator if `commands` is set.
    ///
    /// # Errors
    /// [`ViewError::Ipc`] if no client slot is free, [`ViewError::Log`] if the system has another arm.
    pub fn new(
        domain: &Domain,
        description: &Description,
        hub: &'a Hub,
        commands: bool,
    ) -> Result<Self, ViewError> {
        let operator = commands.then(|| OperatorClient::new(domain));
        let mut encoder = LiveEncoder::new(description)?;
        let urdf = encoder.robot_description()?;
        hub.retain(channel_of(urdf.channel), urdf.data);
        Ok(LiveConnection {
            hub,
            reader: TelemetryReader::new(domain)?,
            operator: operator.transpose()?,
            encoder,
            builder: SnapshotBuilder::default(),
            last: None,
            sent: Vec::new(),
            offset_ns: since_epoch_ns().saturating_sub(monotonic_ns()),
            next_message_ns: 0,
        })
    }

    /// Runs until a shutdown is requested.
    ///
    /// # Errors
    /// [`ViewError::Ipc`] if shared memory cannot be accessed; [`ViewError::Log`] for a message that cannot be encoded.
    pub fn run(
        &mut self,
        commands: &Receiver<PendingCommand>,
        stop: &Stop,
    ) -> Result<(), ViewError> {
        let mut last_snapshot = Instant::now();
        while !stop.shutdown_requested() {
            while let Some(telemetry) = self.reader.receive()? {
                self.add(&telemetry)?;
            }
            if last_snapshot.elapsed() >= SNAPSHOT_INTERVAL {
                last_snapshot = Instant::now();
                self.publish_snapshot();
            }
            while let Ok(pending) = commands.try_recv() {
                self.send(pending)?;
            }
            self.answer()?;
            pause(POLL_INTERVAL);
        }
        Ok(())
    }

    fn add(&mut self, telemetry: &Telemetry) -> Result<(), ViewError> {
        if telemetry.dof() != N {
            return Ok(());
        }
        let record = telemetry.record_of::<N>();
        let timing = &telemetry.timing;
        let microseconds = |ns: u64| ns as f64 / 1e3;
        let extras = CycleExtras {
            time_s: telemetry.state.stamp_ns as f64 / 1e9,
            timing_us: Some([
                microseconds(timing.period_ns),
                microseconds(timing.latency_ns),
                microseconds(timing.step_ns),
            ]),
            round_trip_us: microseconds(telemetry.state.plant.round_trip_ns),
            missed: telemetry.state.plant.missed,
            held: telemetry.state.drives() == Drives::Held,
        };
        self.builder.add(&record, extras);
        self.last = Some(*telemetry);
        let time_ns = telemetry.state.stamp_ns.saturating_add(self.offset_ns);
        // The stamps of states restart with the plant.
        let due =
            time_ns >= self.next_message_ns || self.next_message_ns > time_ns + MESSAGE_INTERVAL_NS;
        let channels = self.hub.channels().len() as u32;
        if due && self.hub.wanted(VIEW_CHANNEL + 1..channels) {
            self.next_message_ns = time_ns + MESSAGE_INTERVAL_NS;
            let extras = Extras {
                timing: Some(CycleTiming {
                    period_ns: timing.period_ns,
                    latency_ns: timing.latency_ns,
                    step_ns: timing.step_ns,
                }),
                ..Extras::default()
            };
            for message in self.encoder.encode(time_ns, &record, &extras)? {
                let channel = channel_of(message.channel);
                self.hub.publish(channel, time_ns, &message.data);
            }
        }
        Ok(())
    }

    fn publish_snapshot(&mut self) {
        let Some(snapshot) = self.builder.take() else {
            return;
        };
        let time_ns = ((snapshot.time_s * 1e9) as u64).saturating_add(self.offset_ns);
        if let Ok(json) = serde_json::to_vec(&snapshot) {
            self.hub.publish(VIEW_CHANNEL, time_ns, &json);
        }
        self.hub.set_latest(snapshot);
    }

    fn send(&mut self, pending: PendingCommand) -> Result<(), ViewError> {
        let PendingCommand { command, answer } = pending;
        let refuse = |reason: &str| {
            // The viewer may have disconnected.
            let _ = answer.send(Err(reason.to_owned()));
            Ok(())
        };
        let (Some(operator), Some(last)) = (&mut self.operator, &self.last) else {
            return refuse("no system is running");
        };
        let Some(request) = command.request::<N>(&last.record_of()) else {
            return refuse("this command is not a request to the controller");
        };
        match operator.send(&request, None)? {
            Some(sequence) => {
                let at = Instant::now();
                self.sent.push(SentRequest {
                    sequence,
                    at,
                    answer,
                });
                Ok(())
            }
            None => refuse("the controller does not answer, or its request queue is full"),
        }
    }

    fn answer(&mut self) -> Result<(), ViewError> {
        let Some(operator) = &self.operator else {
            return Ok(());
        };
        while let Some(reply) = operator.receive()? {
            let of_this = |sent: &SentRequest| sent.sequence == reply.sequence;
            if let Some(index) = self.sent.iter().position(of_this) {
                let _ = self.sent.swap_remove(index).answer.send(in_words(&reply));
            }
        }
        self.sent.retain(|sent| sent.at.elapsed() < ANSWER_TIMEOUT);
        Ok(())
    }
}

fn in_words(reply: &OperatorReply) -> Answer {
    match reply.outcome() {
        Outcome::Refused => Err(reply.text.to_string()),
        _ => Ok(reply
            .mode()
            .map_or("unknown", |mode| mode.name())
            .to_owned()),
    }
}

/// Returns the id of the channel of a message of the log.
fn channel_of(index: usize) -> u32 {
    VIEW_CHANNEL + 1 + index as u32
}
