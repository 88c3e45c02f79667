//! Requests to a controller, and its answers to them.

use super::Approach;
use crate::exit::Failure;
use core::time::Duration;
use std::time::Instant;
use supple_core::Vector;
use supple_core::controller::Request;
use supple_ipc::message::{OperatorReply, Outcome};
use supple_ipc::{Domain, Operator, pause};

/// Longest wait for an answer to something that is due.
const ANSWER_WITHIN: Duration = Duration::from_secs(5);
/// How often a waiting operator looks.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// An operator with the requests that were not done yet.
#[derive(Debug)]
pub struct Session<const N: usize> {
    operator: Operator,
    prefix: String,
    waiting: Vec<u64>,
}

impl<const N: usize> Session<N> {
    /// Joins a system.
    ///
    /// # Errors
    /// [`Failure::Ipc`].
    pub fn new(domain: &Domain) -> Result<Self, Failure> {
        Session::of(domain, Operator::new(domain)?)
    }

    /// As [`Session::new`], for a program that runs the system.
    ///
    /// # Errors
    /// [`Failure::Ipc`].
    pub fn for_system(domain: &Domain) -> Result<Self, Failure> {
        Session::of(domain, Operator::for_system(domain)?)
    }

    fn of(domain: &Domain, operator: Operator) -> Result<Self, Failure> {
        Ok(Session {
            operator,
            prefix: domain.prefix().to_owned(),
            waiting: Vec::new(),
        })
    }

    /// Asks, and waits until the controller does it, or has it wait for its cycle.
    ///
    /// # Errors
    /// [`Failure::Refused`] with the controller's words; [`Failure::NotRunning`] where nobody answers.
    pub fn ask(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
    ) -> Result<OperatorReply, Failure> {
        let sequence = self.operator.send(request, at_cycle)?;
        self.heard(sequence.ok_or_else(|| self.nobody())?)
    }

    /// As [`Session::ask`], of a controller that may still be starting. `check` says whether it still may.
    ///
    /// # Errors
    /// As [`Session::ask`], and what `check` says.
    pub fn ask_when_there(
        &mut self,
        request: &Request<N>,
        at_cycle: Option<u64>,
        within_s: u64,
        check: &mut dyn FnMut() -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let start = Instant::now();
        loop {
            if let Some(sequence) = self.operator.send(request, at_cycle)? {
                return self.wait_for_place(sequence);
            }
            check()?;
            if start.elapsed() > Duration::from_secs(within_s) {
                return Err(self.nobody());
            }
            pause(LOOK_EVERY);
        }
    }

    /// Asks for the way to a trajectory and for the trajectory after it, from `start_cycle` on or now.
    ///
    /// # Errors
    /// As [`Session::ask`].
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
            None => self.ask(&to_start, None)?.cycle,
        };
        self.queue(&along, start_cycle + between)
    }

    /// Hears what became of the requests that wait.
    ///
    /// # Errors
    /// [`Failure::Refused`] where one was refused.
    pub fn check(&mut self) -> Result<Option<OperatorReply>, Failure> {
        let mut done = None;
        while let Some(reply) = self.operator.receive()? {
            match reply.outcome() {
                Outcome::Queued => {}
                Outcome::Accepted => {
                    self.waiting.retain(|waits| *waits != reply.sequence);
                    done = Some(reply);
                }
                Outcome::Refused => return Err(refused(&reply)),
            }
        }
        Ok(done)
    }

    /// Waits until every request is done; gives the answer to the last.
    ///
    /// # Errors
    /// As [`Session::ask`].
    pub fn wait_for_all(&mut self, within: Duration) -> Result<OperatorReply, Failure> {
        let start = Instant::now();
        loop {
            let done = self.check()?;
            if let (Some(reply), true) = (done, self.waiting.is_empty()) {
                return Ok(reply);
            }
            if start.elapsed() > within {
                return Err(self.nobody());
            }
            pause(LOOK_EVERY);
        }
    }

    /// Asks for something in a cycle to come, and waits until the controller has it in its queue.
    ///
    /// # Errors
    /// As [`Session::ask`].
    pub fn queue(&mut self, request: &Request<N>, at_cycle: u64) -> Result<(), Failure> {
        match self.operator.send(request, Some(at_cycle))? {
            Some(sequence) => self.wait_for_place(sequence),
            None => Err(self.nobody()),
        }
    }

    /// The controller has it, and hears it in its cycle.
    fn wait_for_place(&mut self, sequence: u64) -> Result<(), Failure> {
        if self.heard(sequence)?.outcome() == Outcome::Queued {
            self.waiting.push(sequence);
        }
        Ok(())
    }

    fn heard(&mut self, sequence: u64) -> Result<OperatorReply, Failure> {
        let start = Instant::now();
        while start.elapsed() < ANSWER_WITHIN {
            while let Some(reply) = self.operator.receive()? {
                if reply.outcome() == Outcome::Refused {
                    return Err(refused(&reply));
                }
                if reply.sequence == sequence {
                    return Ok(reply);
                }
                self.waiting
                    .retain(|waits| reply.outcome() == Outcome::Queued || *waits != reply.sequence);
            }
            pause(LOOK_EVERY);
        }
        Err(self.nobody())
    }

    fn nobody(&self) -> Failure {
        Failure::NotRunning {
            prefix: self.prefix.clone(),
        }
    }
}

fn refused(reply: &OperatorReply) -> Failure {
    Failure::Refused {
        words: reply.text.to_string(),
    }
}
