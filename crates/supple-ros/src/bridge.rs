//! The loop that reads telemetry, publishes it, and sends the moves of a joint trajectory. It polls shared memory, so that it cannot
//! delay the controller.

use crate::error::RosError;
use crate::session::{Publisher, Session, Topic};
use crate::trajectory::{self, Waypoint};
use core::time::Duration;
use std::collections::VecDeque;
use std::sync::mpsc::Receiver;
use std::time::Instant;
use supple_cli::arguments::RosArgs;
use supple_core::Config;
use supple_core::controller::{Mode, Request};
use supple_ipc::message::{Outcome, Telemetry};
use supple_ipc::{Domain, OperatorClient, TelemetryReader};
use supple_log::{CycleTiming, Extras, LiveEncoder};
use supple_model::Description;
use supple_realtime::{Stop, monotonic_ns, pause, since_epoch_ns};

/// Time between two polls. The queue of telemetry holds two seconds at 1 kHz.
const POLL_INTERVAL: Duration = Duration::from_millis(2);
/// Timeout of a reply to a request.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(4);
/// Time after a move until the next one starts, in which the arm comes to rest.
const REST: Duration = Duration::from_millis(100);

/// A running system as a ROS 2 node.
pub(crate) struct Bridge<const N: usize> {
    // First, so that the node leaves the graph before its session closes.
    publishers: Vec<Publisher>,
    trajectories: Option<Receiver<Vec<u8>>>,
    _session: Session,
    reader: TelemetryReader,
    operator: Option<OperatorClient>,
    encoder: LiveEncoder<N>,
    config: Config<N>,
    names: Vec<String>,
    interval_ns: u64,
    next_ns: u64,
    /// Offset from the stamps of states to the time since the epoch \[ns\].
    offset_ns: u64,
    moves: Moves<N>,
}

/// A trajectory on its way.
#[derive(Debug)]
struct Moves<const N: usize> {
    waiting: VecDeque<Waypoint<N>>,
    /// Request that awaits its reply, with the duration of its move.
    sent: Option<(u64, Instant, Duration)>,
    /// End of the move that the arm makes.
    ends: Option<Instant>,
    /// Whether the telemetry since the first accepted move has shown the move mode.
    has_moved: bool,
}

impl<const N: usize> Moves<N> {
    fn new() -> Self {
        Moves {
            waiting: VecDeque::new(),
            sent: None,
            ends: None,
            has_moved: false,
        }
    }

    fn is_idle(&self) -> bool {
        self.sent.is_none() && self.ends.is_none()
    }

    fn clear(&mut self) {
        *self = Moves::new();
    }

    /// Ends the trajectory if the arm has left the move mode: an operator's request or a fault must not be followed by the next
    /// move. Returns whether a move was cut short by this, or the next one is not sent.
    fn check_mode(&mut self, mode: Option<Mode>) -> bool {
        let is_moving = mode == Some(Mode::Move);
        let has_left = self.has_moved && !is_moving && self.sent.is_none();
        let is_unfinished = self.ends.is_some() || !self.waiting.is_empty();
        self.has_moved |= is_moving && self.ends.is_some();
        if has_left {
            self.clear();
        }
        has_left && is_unfinished
    }
}

impl<const N: usize> Bridge<N> {
    /// Joins the system and the ROS 2 graph.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn new(
        domain: &Domain,
        description: &Description,
        args: &RosArgs,
    ) -> Result<Self, RosError> {
        let reader = TelemetryReader::new(domain)?;
        let operator = args
            .accept_trajectories
            .then(|| OperatorClient::new(domain));
        let mut encoder = LiveEncoder::new(description)?;
        let mut session = Session::open(args)?;
        let mut publishers = Vec::new();
        let urdf = encoder.robot_description()?;
        for (index, channel) in LiveEncoder::<N>::channels()?.iter().enumerate() {
            let topic = Topic {
                name: &channel.topic,
                type_name: &channel.schema_name,
                definition: &channel.schema,
            };
            publishers.push(session.publisher(&topic, index == urdf.channel)?);
        }
        publishers[urdf.channel].put(since_epoch_ns(), urdf.data)?;
        let topic = Topic {
            name: "/joint_trajectory",
            type_name: trajectory::TYPE,
            definition: trajectory::DEFINITION,
        };
        let trajectories = match args.accept_trajectories {
            true => Some(session.subscription(&topic)?),
            false => None,
        };
        Ok(Bridge {
            publishers,
            trajectories,
            _session: session,
            reader,
            operator: operator.transpose()?,
            encoder,
            config: description.config()?,
            names: description.joint_names().to_vec(),
            interval_ns: (1e9 / args.rate_hz) as u64,
            next_ns: 0,
            offset_ns: since_epoch_ns().saturating_sub(monotonic_ns()),
            moves: Moves::new(),
        })
    }

    /// Runs until a shutdown is requested; `tell` receives what happens to trajectories.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn run(&mut self, stop: &Stop, tell: &dyn Fn(&str)) -> Result<(), RosError> {
        while !stop.shutdown_requested() {
            while let Some(telemetry) = self.reader.receive()? {
                if telemetry.dof() == N {
                    let mode = telemetry.record_of::<N>().mode();
                    if self.moves.check_mode(mode) {
                        let now = mode.map_or("unknown", Mode::name);
                        tell(&format!(
                            "the arm has left the move mode, its mode is {now}: the trajectory ends"
                        ));
                    }
                }
                self.publish(&telemetry)?;
            }
            self.receive_trajectories(tell)?;
            self.receive_replies(tell)?;
            self.send_next(tell)?;
            pause(POLL_INTERVAL);
        }
        Ok(())
    }

    fn publish(&mut self, telemetry: &Telemetry) -> Result<(), RosError> {
        if telemetry.dof() != N {
            return Ok(());
        }
        let time_ns = telemetry.state.stamp_ns.saturating_add(self.offset_ns);
        // The stamps of states restart with the plant.
        let is_due = time_ns >= self.next_ns || self.next_ns > time_ns + self.interval_ns;
        if !is_due {
            return Ok(());
        }
        self.next_ns = time_ns + self.interval_ns;
        let timing = &telemetry.timing;
        let extras = Extras {
            timing: Some(CycleTiming {
                period_ns: timing.period_ns,
                latency_ns: timing.latency_ns,
                step_ns: timing.step_ns,
            }),
            ..Extras::default()
        };
        let record = telemetry.record_of::<N>();
        for message in self.encoder.encode(time_ns, &record, &extras)? {
            self.publishers[message.channel].put(time_ns, message.data)?;
        }
        Ok(())
    }

    /// A new trajectory replaces the one on its way; the present move goes on until the first new one is accepted.
    fn receive_trajectories(&mut self, tell: &dyn Fn(&str)) -> Result<(), RosError> {
        let Some(message) = self
            .trajectories
            .as_ref()
            .and_then(|from| from.try_iter().last())
        else {
            return Ok(());
        };
        match trajectory::read(&message, &self.names, &self.config) {
            Ok(waypoints) if waypoints.is_empty() => {
                tell("trajectory without points: gravity hold");
                self.moves.clear();
                self.send(&Request::GravityHold, Duration::ZERO, tell)
            }
            Ok(waypoints) => {
                tell(&format!("trajectory of {} points", waypoints.len()));
                self.moves.clear();
                self.moves.waiting = waypoints;
                Ok(())
            }
            Err(reason) => {
                tell(&format!("trajectory rejected: {reason}"));
                Ok(())
            }
        }
    }

    fn send_next(&mut self, tell: &dyn Fn(&str)) -> Result<(), RosError> {
        if let Some(ends) = self.moves.ends
            && Instant::now() >= ends
        {
            self.moves.ends = None;
            if self.moves.waiting.is_empty() {
                tell("the last move of the trajectory has ended");
            }
        }
        if !self.moves.is_idle() {
            return Ok(());
        }
        let Some(waypoint) = self.moves.waiting.pop_front() else {
            return Ok(());
        };
        self.send(
            &waypoint.request(),
            Duration::from_secs_f64(waypoint.duration_s),
            tell,
        )
    }

    fn send(
        &mut self,
        request: &Request<N>,
        duration: Duration,
        tell: &dyn Fn(&str),
    ) -> Result<(), RosError> {
        let Some(operator) = &mut self.operator else {
            return Ok(());
        };
        match operator.send(request, None)? {
            Some(sequence) => self.moves.sent = Some((sequence, Instant::now(), duration)),
            None => {
                self.moves.clear();
                tell(
                    "the controller does not answer, or its request queue is full: the trajectory ends",
                );
            }
        }
        Ok(())
    }

    fn receive_replies(&mut self, tell: &dyn Fn(&str)) -> Result<(), RosError> {
        let Some(operator) = &self.operator else {
            return Ok(());
        };
        while let Some(reply) = operator.receive()? {
            let Some((sequence, _, duration)) = self.moves.sent else {
                continue;
            };
            if reply.sequence != sequence {
                continue;
            }
            match reply.outcome() {
                Outcome::Refused => {
                    tell(&format!(
                        "refused by the controller: {}; the trajectory ends",
                        reply.text
                    ));
                    self.moves.clear();
                }
                Outcome::Accepted => {
                    self.moves.sent = None;
                    // A request to hold is no move.
                    self.moves.ends =
                        (!duration.is_zero()).then(|| Instant::now() + duration + REST);
                }
                Outcome::Queued => {}
            }
        }
        if let Some((_, at, _)) = self.moves.sent
            && at.elapsed() > ANSWER_TIMEOUT
        {
            self.moves.clear();
            tell("the controller does not answer: the trajectory ends");
        }
        Ok(())
    }
}
