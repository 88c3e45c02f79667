//! Commands of one viewer that await their answer. This module never blocks: the connection continues to read, so that an
//! unanswered command delays neither idle nor the emergency stop.

use crate::command::Command;
use crate::hub::{Answer, Hub, PendingCommand};
use core::time::Duration;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::Instant;
use supple_ipc::{Domain, request_idle};

/// Timeout of an answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// Maximum number of commands on each path that await their answer, for each viewer.
const MAX_WAITING: usize = 8;

/// Recipient of an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplyTo {
    /// A service call.
    Call {
        /// Id of the service.
        service_id: u32,
        /// Id of the call.
        call_id: u32,
    },
    /// A message that set parameters, with its id.
    Parameters(Option<String>),
}

/// Path of a command. The number of pending commands is limited separately for each path, so that no path blocks another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum CommandPath {
    Idle,
    Pendant,
    Controller,
}

/// A command that awaits its answer.
#[derive(Debug)]
struct PendingCall {
    path: CommandPath,
    reply_to: ReplyTo,
    answer: Receiver<Answer>,
    since: Instant,
}

/// The commands of a viewer that await their answer.
#[derive(Debug, Default)]
pub struct PendingCalls(Vec<PendingCall>);

impl PendingCalls {
    /// Starts a command. Idle and pendant commands run in separate threads; all others go to the queue of the hub.
    pub fn start(
        &mut self,
        hub: &Hub,
        domain: Option<&Domain>,
        command: Command,
        reply_to: ReplyTo,
    ) {
        let (sender, answer) = channel();
        let domain = domain.filter(|_| hub.accepts_commands()).cloned();
        let path = match (command, &domain) {
            (Command::Idle, Some(_)) => CommandPath::Idle,
            (Command::Pendant { .. }, Some(_)) => CommandPath::Pendant,
            _ => CommandPath::Controller,
        };
        let waiting = self.0.iter().filter(|waiting| waiting.path == path).count();
        let outcome = match (command, domain) {
            _ if waiting >= MAX_WAITING => Err(format!(
                "{MAX_WAITING} requests of this page still await their answer: wait for it, or request idle"
            )),
            (Command::Idle, Some(domain)) => {
                spawn(sender.clone(), move || request_idle_mode(&domain))
            }
            (Command::Pendant { button }, Some(domain)) => spawn(sender.clone(), move || {
                crate::pendant::press(&domain, button.line()).map(|()| "pendant".to_owned())
            }),
            (command, _) => hub.send_command(PendingCommand {
                command,
                answer: sender.clone(),
            }),
        };
        if let Err(reason) = outcome {
            // The receiver is stored below, so sending succeeds.
            let _ = sender.send(Err(reason));
        }
        self.0.push(PendingCall {
            path,
            reply_to,
            answer,
            since: Instant::now(),
        });
    }

    /// Removes and returns the answers that have arrived; a command whose answer timed out gets an error as its answer.
    pub fn take_answers(&mut self) -> Vec<(ReplyTo, Answer)> {
        let mut done = Vec::new();
        self.0.retain(|waiting| {
            let answer = match waiting.answer.try_recv() {
                Ok(answer) => answer,
                Err(TryRecvError::Empty) if waiting.since.elapsed() < ANSWER_TIMEOUT => {
                    return true;
                }
                Err(_) => Err("the controller does not answer".to_owned()),
            };
            done.push((waiting.reply_to.clone(), answer));
            false
        });
        done
    }
}

/// Runs blocking work in a separate thread.
fn spawn(
    answer: Sender<Answer>,
    work: impl FnOnce() -> Answer + Send + 'static,
) -> Result<(), String> {
    let thread = std::thread::Builder::new().name("request".to_owned());
    let started = thread.spawn(move || {
        // The viewer may have disconnected.
        let _ = answer.send(work());
    });
    started.map(drop).map_err(|error| error.to_string())
}

/// Requests idle through the separate socket for idle requests, which no other client can block.
fn request_idle_mode(domain: &Domain) -> Answer {
    match request_idle(domain, ANSWER_TIMEOUT) {
        Ok(Some(answer)) => match answer.outcome {
            supple_ipc::message::Outcome::Refused => Err(answer.text),
            _ => Ok(answer.mode.map_or("unknown", |mode| mode.name()).to_owned()),
        },
        Ok(None) => Err("the controller does not answer".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unanswered_command_blocks_no_other_and_pending_commands_are_limited() {
        let hub = Hub::new(Vec::new());
        let commands = hub.accept_commands();
        let mut calls = PendingCalls::default();
        let call = |call| ReplyTo::Call {
            service_id: 1,
            call_id: call,
        };
        for number in 0..=MAX_WAITING as u32 {
            calls.start(&hub, None, Command::Reset, call(number));
        }
        let refused = calls.take_answers();
        assert_eq!(refused.len(), 1);
        assert_eq!(refused[0].0, call(MAX_WAITING as u32));
        assert!(
            refused[0]
                .1
                .as_ref()
                .is_err_and(|reason| reason.contains("await"))
        );
        let taken: Vec<_> = commands.try_iter().collect();
        assert_eq!(taken.len(), MAX_WAITING);
        // Answers arrive in any order.
        taken[3]
            .answer
            .send(Ok("track".to_owned()))
            .expect("awaited");
        assert_eq!(calls.take_answers(), [(call(3), Ok("track".to_owned()))]);
        assert_eq!(calls.take_answers(), []);
    }
}
