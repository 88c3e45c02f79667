//! One-way services in shared memory: a writer and readers.
//!
//! Once both sides are connected, writing and reading allocate nothing. When a side joins or leaves, the other side
//! makes a few system calls and allocations in its next call. Therefore the thread of the control loop uses only the ports
//! to the plant.

use crate::domain::{Domain, Node};
use crate::error::{IpcError, failed};
use crate::writer_identity::WriterLock;
use core::fmt::Debug;
use core::time::Duration;
use iceoryx2::port::publisher::{Publisher, PublisherCreateError};
use iceoryx2::port::subscriber::{Subscriber, SubscriberCreateError};
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::prelude::*;
use iceoryx2::service::builder::publish_subscribe::{
    PublishSubscribeCreateError, PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use std::time::Instant;
use supple_realtime::pause;

/// Quality of service: the parameters of a service.
#[derive(Clone, Copy, Debug)]
pub(crate) struct QualityOfService {
    /// Name within the system.
    pub name: &'static str,
    /// Maximum number of writers. If it is 1, the writer holds the lock of the service.
    pub writers: usize,
    /// Maximum number of readers.
    pub readers: usize,
    /// Queue length of a reader.
    pub depth: usize,
    /// If a reader's queue is full: overwrite the oldest unread sample (true), or apply [`Backpressure`] (false).
    pub overwrite_oldest: bool,
}

impl QualityOfService {
    /// Shared memory for one writer \[bytes\]: messages and headers for the full depth of all readers, and the index
    /// queues of the connections.
    pub const fn bytes_of<T>(&self) -> u64 {
        let messages = slots(self.readers) * (self.depth + 2) + 2;
        (messages * (size_of::<T>() + HEADER_BYTES)) as u64
    }

    /// Shared memory for the connections of one reader \[bytes\].
    pub const fn bytes_of_reader(&self) -> u64 {
        (slots(self.writers) * (self.depth + 2) * HEADER_BYTES) as u64
    }
}

/// Size of a message header and its entries in the index queues, rounded up \[bytes\].
const HEADER_BYTES: usize = 64;

/// Bounds of a message type.
pub(crate) trait Message: Debug + Copy + ZeroCopySend + 'static {}
impl<T: Debug + Copy + ZeroCopySend + 'static> Message for T {}

/// Behaviour of a writer if a reader's queue is full and the oldest sample may not be overwritten.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Backpressure {
    /// The reader with the full queue does not get the sample.
    Drop,
    /// The writer blocks until the reader has space: for virtual time only.
    Block,
}

/// The writer of a service.
#[derive(Debug)]
pub(crate) struct Writer<T: Message> {
    publisher: Publisher<ipc::Service, T, ()>,
    name: &'static str,
    writer_lock: Option<WriterLock>,
}

impl<T: Message> Writer<T> {
    pub fn new(
        domain: &Domain,
        node: &Node,
        qos: &QualityOfService,
        backpressure: Backpressure,
    ) -> Result<Self, IpcError> {
        let taken = || IpcError::SecondWriter {
            service: qos.name.to_owned(),
            prefix: domain.prefix().to_owned(),
        };
        let writer_lock = match qos.writers {
            1 => Some(WriterLock::acquire(domain, qos.name)?.ok_or_else(taken)?),
            _ => None,
        };
        let service = open::<T>(domain, node, qos)?;
        let strategy = match backpressure {
            Backpressure::Drop => BackpressureStrategy::DiscardData,
            Backpressure::Block => BackpressureStrategy::RetryUntilDelivered,
        };
        let publisher = service
            .publisher_builder()
            .max_loaned_samples(1)
            .backpressure_strategy(strategy)
            .create();
        let publisher = publisher.map_err(|error| match error {
            PublisherCreateError::ExceedsMaxSupportedPublishers => taken(),
            error => failed(qos.name, &error),
        })?;
        Ok(Writer {
            publisher,
            name: qos.name,
            writer_lock,
        })
    }

    /// Writer id that the messages of an exclusive writer carry; 0 if the service allows several writers.
    pub fn writer_id(&self) -> u64 {
        self.writer_lock.as_ref().map_or(0, WriterLock::writer_id)
    }

    /// Connects to new readers now, so that the next send does not spend time on it.
    pub fn connect(&self) -> Result<(), IpcError> {
        let connected = self.publisher.update_connections();
        connected.map_err(|error| failed(self.name, &error))
    }

    /// Sends a copy; returns the number of readers that it reached.
    pub fn send(&self, message: &T) -> Result<usize, IpcError> {
        let sample = self.publisher.loan_uninit();
        let sample = sample.map_err(|error| failed(self.name, &error))?;
        let sent = sample.write_payload(*message).send();
        sent.map_err(|error| failed(self.name, &error))
    }
}

/// A reader of a service.
#[derive(Debug)]
pub(crate) struct Reader<T: Message> {
    subscriber: Subscriber<ipc::Service, T, ()>,
    name: &'static str,
}

impl<T: Message> Reader<T> {
    pub fn new(domain: &Domain, node: &Node, qos: &QualityOfService) -> Result<Self, IpcError> {
        let service = open::<T>(domain, node, qos)?;
        let subscriber = service.subscriber_builder().create();
        let subscriber = subscriber.map_err(|error| match error {
            SubscriberCreateError::ExceedsMaxSupportedSubscribers => IpcError::TooManyReaders {
                service: qos.name.to_owned(),
            },
            error => failed(qos.name, &error),
        })?;
        Ok(Reader {
            subscriber,
            name: qos.name,
        })
    }

    /// Returns the oldest unread message.
    pub fn receive(&self) -> Result<Option<T>, IpcError> {
        let sample = self.subscriber.receive();
        let sample = sample.map_err(|error| failed(self.name, &error))?;
        Ok(sample.map(|sample| *sample))
    }
}

fn open<T: Message>(
    domain: &Domain,
    node: &Node,
    qos: &QualityOfService,
) -> Result<PortFactory<ipc::Service, T, ()>, IpcError> {
    let name = service_name(qos.name)?;
    let service = open_with_retry(
        OPEN_TIMEOUT,
        || {
            node.service_builder(&name)
                .publish_subscribe::<T>()
                .max_publishers(slots(qos.writers))
                .max_subscribers(slots(qos.readers))
                .max_nodes(MAX_NODES)
                .subscriber_max_buffer_size(qos.depth)
                .subscriber_max_borrowed_samples(1)
                .history_size(0)
                .enable_safe_overflow(qos.overwrite_oldest)
                .open_or_create()
        },
        |error| {
            use PublishSubscribeCreateError as Create;
            use PublishSubscribeOpenError as Open;
            use PublishSubscribeOpenOrCreateError as Either;
            matches!(
                error,
                Either::SystemInFlux
                    | Either::PublishSubscribeOpenError(
                        Open::DoesNotExist
                            | Open::IsMarkedForDestruction
                            | Open::ServiceInCorruptedState
                            | Open::HangsInCreation
                    )
                    | Either::PublishSubscribeCreateError(
                        Create::AlreadyExists
                            | Create::IsBeingCreatedByAnotherInstance
                            | Create::ServiceInCorruptedState
                            | Create::HangsInCreation
                    )
            )
        },
    );
    service.map_err(|error| {
        use PublishSubscribeOpenError as Open;
        let PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(open) = error else {
            return failed(qos.name, &error);
        };
        match open {
            Open::IncompatibleTypes
            | Open::IncompatibleMessagingPattern
            | Open::IncompatibleAttributes
            | Open::IncompatibleOverflowBehavior
            | Open::DoesNotSupportRequestedMinBufferSize
            | Open::DoesNotSupportRequestedMinHistorySize
            | Open::DoesNotSupportRequestedMinSubscriberBorrowedSamples
            | Open::DoesNotSupportRequestedAmountOfPublishers
            | Open::DoesNotSupportRequestedAmountOfSubscribers
            | Open::DoesNotSupportRequestedAmountOfNodes => IpcError::Version {
                service: qos.name.to_owned(),
                expected: core::any::type_name::<T>(),
                prefix: domain.prefix().to_owned(),
            },
            Open::ExceedsMaxNumberOfNodes => IpcError::TooManyReaders {
                service: qos.name.to_owned(),
            },
            open => failed(qos.name, &open),
        }
    })
}

/// Maximum number of processes that have a service open: the writers, the readers, and some that are leaving.
const MAX_NODES: usize = 24 + LEAKED_SLOTS;

/// A process that is killed while it joins may leak a writer or reader slot (iceoryx2 0.9.3 releases only completed
/// ports). Services with a single slot get this many spare slots; after as many leaks the process that created the
/// service must be restarted. Services with many slots need no spares.
const LEAKED_SLOTS: usize = 8;

const fn slots(wanted: usize) -> usize {
    match wanted {
        1 => 1 + LEAKED_SLOTS,
        several => several,
    }
}

/// Timeout for opening a service that other processes are creating or removing at the same time.
const OPEN_TIMEOUT: Duration = Duration::from_secs(3);
/// Time between two attempts to open a service.
const RETRY_INTERVAL: Duration = Duration::from_millis(2);

/// Opens a service that other processes may be creating or removing. iceoryx2 gives up after a few internal retries, or
/// reports a half-created service as corrupted; this function retries in both cases.
fn open_with_retry<T, E>(
    timeout: Duration,
    mut open: impl FnMut() -> Result<T, E>,
    in_flux: impl Fn(&E) -> bool,
) -> Result<T, E> {
    let start = Instant::now();
    loop {
        let opened = open();
        match &opened {
            Err(error) if in_flux(error) && start.elapsed() < timeout => pause(RETRY_INTERVAL),
            _ => return opened,
        }
    }
}

fn service_name(name: &str) -> Result<ServiceName, IpcError> {
    ServiceName::new(name).map_err(|error| failed(name, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Succeeds at attempt number `at` and fails with `error` before it; returns the result and the number of attempts.
    fn attempts(at: u32, error: &'static str) -> (Result<(), &'static str>, u32) {
        let mut made = 0;
        let opened = open_with_retry(
            Duration::from_millis(50),
            || {
                made += 1;
                if made < at { Err(error) } else { Ok(()) }
            },
            |error| *error == "in flux",
        );
        (opened, made)
    }

    #[test]
    fn opening_is_retried_until_the_timeout_while_other_processes_create_or_remove_the_service() {
        assert_eq!(attempts(1, "in flux"), (Ok(()), 1));
        assert_eq!(attempts(3, "in flux"), (Ok(()), 3));
        let (opened, made) = attempts(u32::MAX, "in flux");
        assert_eq!(opened, Err("in flux"));
        assert!(made > 1, "{made}");
        assert_eq!(attempts(2, "another version"), (Err("another version"), 1));
    }
}
