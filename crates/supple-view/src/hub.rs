//! State shared by the threads: the connected viewers, the latest snapshot, and the queue of commands.
//!
//! Each viewer has a queue of bounded length. If a viewer is slow, its oldest messages are dropped; no thread waits for it.

use crate::command::Command;
use crate::protocol::{Channel, message_data};
use crate::snapshot::Snapshot;
use std::collections::{BTreeMap, VecDeque};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum number of messages that wait for a viewer.
const QUEUE_LENGTH: usize = 64;

/// Answer to a command: the mode after it, or the reason why it was refused.
pub type Answer = Result<String, String>;

/// A command with the channel for its answer.
#[derive(Debug)]
pub struct PendingCommand {
    /// The command.
    pub command: Command,
    /// Channel for the answer.
    pub answer: Sender<Answer>,
}

/// A connected viewer.
#[derive(Debug, Default)]
pub struct Viewer {
    /// Id of the subscription of each channel.
    subscriptions: Mutex<BTreeMap<u32, u32>>,
    queue: Mutex<VecDeque<Vec<u8>>>,
}

impl Viewer {
    /// Subscribes to a channel.
    pub fn subscribe(&self, subscription: u32, channel: u32) {
        lock(&self.subscriptions).insert(channel, subscription);
    }

    /// Ends a subscription.
    pub fn unsubscribe(&self, subscription: u32) {
        lock(&self.subscriptions).retain(|_, id| *id != subscription);
    }

    /// Removes and returns the oldest waiting message.
    pub fn next(&self) -> Option<Vec<u8>> {
        lock(&self.queue).pop_front()
    }

    /// Queues a message on a channel, if the viewer has subscribed to the channel.
    pub fn send(&self, channel: u32, time_ns: u64, payload: &[u8]) {
        let Some(subscription) = lock(&self.subscriptions).get(&channel).copied() else {
            return;
        };
        let mut queue = lock(&self.queue);
        while queue.len() >= QUEUE_LENGTH {
            queue.pop_front();
        }
        queue.push_back(message_data(subscription, time_ns, payload));
    }

    fn wants(&self, channel: u32) -> bool {
        lock(&self.subscriptions).contains_key(&channel)
    }
}

/// State shared by the threads.
#[derive(Debug)]
pub struct Hub {
    channels: Vec<Channel>,
    viewers: Mutex<BTreeMap<u64, Arc<Viewer>>>,
    latest: Mutex<Option<Snapshot>>,
    /// Messages that each new subscriber of a channel receives, such as the arm's description.
    retained: Mutex<BTreeMap<u32, Vec<u8>>>,
    commands: Mutex<Option<Sender<PendingCommand>>>,
}

impl Hub {
    /// Creates the hub for these channels.
    pub fn new(channels: Vec<Channel>) -> Hub {
        Hub {
            channels,
            viewers: Mutex::default(),
            latest: Mutex::default(),
            retained: Mutex::default(),
            commands: Mutex::default(),
        }
    }

    /// Returns the channels; the id of a channel is its index.
    pub fn channels(&self) -> &[Channel] {
        &self.channels
    }

    /// Begins to accept commands, which arrive at the returned receiver.
    pub fn accept_commands(&self) -> Receiver<PendingCommand> {
        let (sender, receiver) = channel();
        *lock(&self.commands) = Some(sender);
        receiver
    }

    /// Whether commands are accepted.
    pub fn accepts_commands(&self) -> bool {
        lock(&self.commands).is_some()
    }

    /// Queues a command.
    ///
    /// # Errors
    /// If no commands are accepted.
    pub fn send_command(&self, pending: PendingCommand) -> Result<(), String> {
        let commands = lock(&self.commands);
        let sent = commands.as_ref().map(|commands| commands.send(pending));
        match sent {
            Some(Ok(())) => Ok(()),
            _ => Err(
                "this page only shows data: it shows a log, or was started with --read-only".into(),
            ),
        }
    }

    /// Adds a viewer with a unique id.
    pub fn join(&self, id: u64) -> Arc<Viewer> {
        let viewer = Arc::new(Viewer::default());
        lock(&self.viewers).insert(id, viewer.clone());
        viewer
    }

    /// Removes a viewer.
    pub fn leave(&self, id: u64) {
        lock(&self.viewers).remove(&id);
    }

    /// Whether a viewer has subscribed to one of these channels.
    pub fn wanted(&self, channels: core::ops::Range<u32>) -> bool {
        let viewers = lock(&self.viewers);
        let wants = |viewer: &Arc<Viewer>| channels.clone().any(|channel| viewer.wants(channel));
        viewers.values().any(wants)
    }

    /// Sends a message on a channel to all its subscribers.
    pub fn publish(&self, channel: u32, time_ns: u64, payload: &[u8]) {
        for viewer in lock(&self.viewers).values() {
            viewer.send(channel, time_ns, payload);
        }
    }

    /// Stores a message that each new subscriber of the channel receives.
    pub fn retain(&self, channel: u32, payload: Vec<u8>) {
        lock(&self.retained).insert(channel, payload);
    }

    /// Subscribes a viewer and sends it the stored message of the channel.
    pub fn subscribe(&self, viewer: &Viewer, subscription: u32, channel: u32) {
        viewer.subscribe(subscription, channel);
        if let Some(payload) = lock(&self.retained).get(&channel) {
            viewer.send(channel, 0, payload);
        }
    }

    /// Returns the latest snapshot.
    pub fn latest(&self) -> Option<Snapshot> {
        lock(&self.latest).clone()
    }

    /// Replaces the latest snapshot.
    pub fn set_latest(&self, snapshot: Snapshot) {
        *lock(&self.latest) = Some(snapshot);
    }
}

/// Locks a mutex. A mutex whose holder panicked can be used, because every value in it is complete.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_viewer_that_does_not_read_loses_the_oldest_messages_of_a_bounded_queue() {
        let hub = Hub::new(Vec::new());
        let (slow, other) = (hub.join(1), hub.join(2));
        hub.subscribe(&slow, 7, 0);
        for number in 0..1000_u64 {
            hub.publish(0, number, b"x");
        }
        let mut received = Vec::new();
        while let Some(message) = slow.next() {
            received.push(message);
        }
        assert_eq!(received.len(), QUEUE_LENGTH);
        let newest = message_data(7, 999, b"x");
        assert_eq!(received.last(), Some(&newest));
        assert_eq!(other.next(), None, "the other viewer has not subscribed");
    }

    #[test]
    fn a_retained_message_reaches_later_subscribers() {
        let hub = Hub::new(Vec::new());
        hub.retain(3, b"urdf".to_vec());
        let viewer = hub.join(1);
        hub.subscribe(&viewer, 5, 3);
        assert_eq!(viewer.next(), Some(message_data(5, 0, b"urdf")));
        assert!(hub.wanted(2..4) && !hub.wanted(0..3));
        hub.leave(1);
        assert!(!hub.wanted(0..9));
    }

    #[test]
    fn commands_are_refused_until_they_are_accepted() {
        let hub = Hub::new(Vec::new());
        let pending = || PendingCommand {
            command: Command::Reset,
            answer: channel().0,
        };
        assert!(hub.send_command(pending()).is_err() && !hub.accepts_commands());
        let receiver = hub.accept_commands();
        assert!(hub.send_command(pending()).is_ok());
        assert_eq!(receiver.recv().expect("a command").command, Command::Reset);
    }
}
