//! Commands of one viewer that await their answer. Nothing here waits: a connection goes on reading, so that idle and the
//! emergency stop pass a command that the controller does not answer.

use crate::command::Command;
use crate::hub::{Answer, Hub, Pending};
use core::time::Duration;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::Instant;
use supple_ipc::{Domain, request_idle};

/// How long a command waits for its answer.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);
/// Most commands of each way that await their answer, for each viewer.
const MAX_WAITING: usize = 8;

/// Who gets an answer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ReplyTo {
    /// A call of a service, by the ids of both.
    Call {
        /// The service.
        service_id: u32,
        /// The call.
        call_id: u32,
    },
    /// Parameters that were set, under the id of the message.
    Parameters(Option<String>),
}

/// The way that a command takes; each has room of its own, so that none can take that of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Idle,
    Pendant,
    Controller,
}

/// A command on its way.
#[derive(Debug)]
struct Waiting {
    way: Way,
    reply_to: ReplyTo,
    answer: Receiver<Answer>,
    since: Instant,
}

/// The commands of a viewer that await their answer.
#[derive(Debug, Default)]
pub struct Calls(Vec<Waiting>);

impl Calls {
    /// Starts a command. Idle and the pendant run in threads of their own, everything else in the queue of the hub.
    pub fn start(
        &mut self,
        hub: &Hub,
        domain: Option<&Domain>,
        command: Command,
        reply_to: ReplyTo,
    ) {
        let (sender, answer) = channel();
        let domain = domain.filter(|_| hub.accepts_commands()).cloned();
        let way = match (command, &domain) {
            (Command::Idle, Some(_)) => Way::Idle,
            (Command::Pendant { .. }, Some(_)) => Way::Pendant,
            _ => Way::Controller,
        };
        let waiting = self.0.iter().filter(|waiting| waiting.way == way).count();
        let outcome = match (command, domain) {
            _ if waiting >= MAX_WAITING => Err(format!(
                "{MAX_WAITING} requests of this page still await their answer"
            )),
            (Command::Idle, Some(domain)) => aside(sender.clone(), move || idle(&domain)),
            (Command::Pendant { button }, Some(domain)) => aside(sender.clone(), move || {
                crate::pendant::press(&domain, button.line()).map(|()| "pendant".to_owned())
            }),
            (command, _) => hub.send_command(Pending {
                command,
                answer: sender.clone(),
            }),
        };
        if let Err(reason) = outcome {
            // The other end is below.
            let _ = sender.send(Err(reason));
        }
        self.0.push(Waiting {
            way,
            reply_to,
            answer,
            since: Instant::now(),
        });
    }

    /// Takes the answers that have come; a command without one for too long gets that as its answer.
    pub fn answered(&mut self) -> Vec<(ReplyTo, Answer)> {
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

/// Runs something that waits in a thread of its own.
fn aside(
    answer: Sender<Answer>,
    work: impl FnOnce() -> Answer + Send + 'static,
) -> Result<(), String> {
    let thread = std::thread::Builder::new().name("request".to_owned());
    let started = thread.spawn(move || {
        // The viewer may have gone.
        let _ = answer.send(work());
    });
    started.map(drop).map_err(|error| error.to_string())
}

/// Idle has a way of its own, which no other client can block.
fn idle(domain: &Domain) -> Answer {
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
    fn a_command_without_an_answer_holds_up_no_other_and_room_is_bounded() {
        let hub = Hub::new(Vec::new());
        let commands = hub.accept_commands();
        let mut calls = Calls::default();
        let call = |call| ReplyTo::Call {
            service_id: 1,
            call_id: call,
        };
        for number in 0..=MAX_WAITING as u32 {
            calls.start(&hub, None, Command::Reset, call(number));
        }
        let refused = calls.answered();
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
        // Answers come in any order.
        taken[3]
            .answer
            .send(Ok("track".to_owned()))
            .expect("awaited");
        assert_eq!(calls.answered(), [(call(3), Ok("track".to_owned()))]);
        assert_eq!(calls.answered(), []);
    }
}
