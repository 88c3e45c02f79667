//! Sends requests to a controller and receives its replies.

use super::Approach;
use core::time::Duration;
use std::time::Instant;
use supple_cli::exit::Failure;
use supple_core::Vector;
use supple_core::controller::Request;
use supple_ipc::message::{OperatorReply, Outcome};
use supple_ipc::{Domain, IpcError, OperatorClient, TelemetryReader};
use supple_realtime::pause;

/// Timeout for a reply.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// Poll interval while waiting for a reply.
const POLL_INTERVAL: Duration = Duration::from_millis(1);

/// An operator connection with its pending requests.
#[derive(Debug)]
pub struct OperatorSession<const N: usize> {
    operator: OperatorClient,
    prefix: String,
    pending_requests: Vec<u64>,
}

impl<const N: usize> OperatorSession<N> {
    /// Joins a system.
    ///
    /// # Errors
    /// [`Failure::System`].
    pub fn new(domain: &Domain) -> Result<Self, Failure> {
        OperatorSession::of(domain, OperatorClient::new(domain))
    }

    /// Joins a system as [`OperatorSession::new`] does, for a program that runs the system.
    ///
    /// # Errors
    /// [`Failure::System`].
    pub fn for_system(domain: &Domain) -> Result<Self, Failure> {
        OperatorSession::of(domain, OperatorClient::for_system(domain))
    }

    fn of(domain: &Domain, operator: Result<OperatorClient, IpcError>) -> Result<Self, Failure> {
        Ok(OperatorSession {
            operator: operator.map_err(Failure::system)?,
            prefix: domain.prefix().to_owned(),
            pending_requests: Vec::new(),
        })
    }

    /// Sends a request and waits until the controller executes it or queues it for its cycle.
    ///
    /// # Errors
    /// [`Failure::Refused`] with the controller's reason; [`Failure::NotRunning`] if no system answers.
    pub fn send_request(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
    ) -> Result<OperatorReply, Failure> {
        let sequence = self
            .operator
            .send(request, at_cycle)
            .map_err(Failure::system)?;
        self.wait_for_reply(sequence.ok_or_else(|| self.not_running())?)
    }

    /// Sends a request without waiting; `None` if no controller is connected.
    ///
    /// # Errors
    /// [`Failure::System`].
    pub fn begin_request(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
    ) -> Result<Option<u64>, Failure> {
        self.operator
            .send(request, at_cycle)
            .map_err(Failure::system)
    }

    /// Returns the reply to a request of [`OperatorSession::begin_request`], if the controller has executed it. Discards replies to
    /// other requests.
    ///
    /// # Errors
    /// [`Failure::Refused`] with the controller's reason.
    pub fn reply_to(&mut self, sequence: u64) -> Result<Option<OperatorReply>, Failure> {
        while let Some(reply) = self.operator.receive().map_err(Failure::system)? {
            match reply.outcome() {
                _ if reply.sequence != sequence => {}
                Outcome::Refused => return Err(refused(&reply)),
                Outcome::Accepted => return Ok(Some(reply)),
                Outcome::Queued => {}
            }
        }
        Ok(None)
    }

    /// Sends a request that must not follow an idle request: it is for the first cycle, so that the controller refuses it if idle
    /// was accepted in that cycle or later. Waits until it is executed.
    ///
    /// # Errors
    /// The same as those of [`OperatorSession::send_request`].
    pub fn send_first_request(&mut self, request: &Request<N>) -> Result<OperatorReply, Failure> {
        let sequence = self.begin_request(request, Some(0))?;
        let sequence = sequence.ok_or_else(|| self.not_running())?;
        let start = Instant::now();
        while start.elapsed() < ANSWER_TIMEOUT {
            if let Some(reply) = self.reply_to(sequence)? {
                return Ok(reply);
            }
            pause(POLL_INTERVAL);
        }
        Err(self.not_running())
    }

    /// Sends a request as [`OperatorSession::send_request`] does, but waits for a controller that may still be starting; `check`
    /// fails if the controller cannot start any more.
    ///
    /// # Errors
    /// The same as those of [`OperatorSession::send_request`], and the errors of `check`.
    pub fn send_request_when_ready(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
        within_s: u64,
        check: &mut dyn FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let start = Instant::now();
        loop {
            if let Some(sequence) = self
                .operator
                .send(request, at_cycle)
                .map_err(Failure::system)?
            {
                return self.wait_until_queued(sequence);
            }
            check()?;
            if start.elapsed() > Duration::from_secs(within_s) {
                return Err(self.not_running());
            }
            pause(POLL_INTERVAL);
        }
    }

    /// Requests the approach and then the trajectory, from `start_cycle` or immediately.
    ///
    /// # Errors
    /// The same as those of [`OperatorSession::send_request`].
    pub fn follow(
        &mut self,
        approach: &Approach<N>,
        from_rad: &Vector<N>,
        start_cycle: Option<u64>,
    ) -> Result<(), Failure> {
        let (to_start, between, along) = approach.requests(from_rad);
        let start_cycle = match start_cycle {
            Some(cycle) => {
                self.queue(&to_start, cycle)?;
                cycle
            }
            None => self.send_request(&to_start, None)?.cycle,
        };
        self.queue(&along, start_cycle + between)
    }

    /// Number of queued requests that have not been executed.
    pub fn pending(&self) -> usize {
        self.pending_requests.len()
    }

    /// Whether any queued request has not been executed.
    pub fn is_pending(&self) -> bool {
        !self.pending_requests.is_empty()
    }

    /// Collects the replies to pending requests.
    ///
    /// # Errors
    /// [`Failure::Refused`] if a request was refused.
    pub fn check(&mut self) -> Result<Option<OperatorReply>, Failure> {
        let mut done = None;
        while let Some(reply) = self.operator.receive().map_err(Failure::system)? {
            match reply.outcome() {
                Outcome::Queued => {}
                Outcome::Accepted => {
                    self.pending_requests
                        .retain(|pending| *pending != reply.sequence);
                    done = Some(reply);
                }
                Outcome::Refused => return Err(refused(&reply)),
            }
        }
        Ok(done)
    }

    /// Waits until every request is executed; returns the reply to the last request. Waits for at most this time of the arm, which in
    /// virtual time passes faster or slower than that of the clock, and as long as that advances.
    ///
    /// # Errors
    /// The same as those of [`OperatorSession::send_request`].
    pub fn wait_for_all(
        &mut self,
        reader: &mut TelemetryReader,
        within: Duration,
    ) -> Result<OperatorReply, Failure> {
        let (mut passed_ns, mut last_ns, mut advanced) = (0, None, Instant::now());
        loop {
            // Before the replies are read: those to what these cycles executed are there.
            while let Some(telemetry) = reader.receive().map_err(Failure::system)? {
                let now_ns = telemetry.state.stamp_ns;
                // A plant that starts again begins with another time.
                let step_ns = last_ns.map_or(0, |last_ns| now_ns.saturating_sub(last_ns));
                last_ns = Some(now_ns);
                if step_ns > 0 {
                    passed_ns += step_ns;
                    advanced = Instant::now();
                }
            }
            let done = self.check()?;
            if let (Some(reply), true) = (done, self.pending_requests.is_empty()) {
                return Ok(reply);
            }
            if Duration::from_nanos(passed_ns) > within || advanced.elapsed() > ANSWER_TIMEOUT {
                return Err(self.not_running());
            }
            pause(POLL_INTERVAL);
        }
    }

    /// Sends a request for a future cycle and waits until the controller has queued it.
    ///
    /// # Errors
    /// The same as those of [`OperatorSession::send_request`].
    pub fn queue(&mut self, request: &Request<N>, at_cycle: u64) -> Result<(), Failure> {
        match self
            .operator
            .send(request, Some(at_cycle))
            .map_err(Failure::system)?
        {
            Some(sequence) => self.wait_until_queued(sequence),
            None => Err(self.not_running()),
        }
    }

    /// Waits until the controller has queued the request.
    fn wait_until_queued(&mut self, sequence: u64) -> Result<(), Failure> {
        if self.wait_for_reply(sequence)?.outcome() == Outcome::Queued {
            self.pending_requests.push(sequence);
        }
        Ok(())
    }

    fn wait_for_reply(&mut self, sequence: u64) -> Result<OperatorReply, Failure> {
        let start = Instant::now();
        while start.elapsed() < ANSWER_TIMEOUT {
            while let Some(reply) = self.operator.receive().map_err(Failure::system)? {
                if reply.outcome() == Outcome::Refused {
                    return Err(refused(&reply));
                }
                if reply.sequence == sequence {
                    return Ok(reply);
                }
                self.pending_requests.retain(|pending| {
                    reply.outcome() == Outcome::Queued || *pending != reply.sequence
                });
            }
            pause(POLL_INTERVAL);
        }
        Err(self.not_running())
    }

    fn not_running(&self) -> Failure {
        Failure::NotRunning {
            prefix: self.prefix.clone(),
        }
    }
}

fn refused(reply: &OperatorReply) -> Failure {
    Failure::Refused {
        reason: reason_of(&reply.text.to_string()),
    }
}

/// Returns the reason in the text of an answer: the failure itself says that the request was refused.
pub(super) fn reason_of(text: &str) -> String {
    text.strip_prefix("refused: ").unwrap_or(text).to_owned()
}
