//! One-way services in shared memory: a writer and readers.
//!
//! Writing and reading allocate nothing once both sides are connected. A side that joins or leaves costs the
//! other a few system calls and allocations at its next call: a control loop has no port but those to its
//! plant.

use crate::domain::{Domain, Node};
use crate::error::IpcError;
use crate::outside::pause;
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

/// What there is to know of a service before it is opened.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Terms {
    /// Name within the system.
    pub name: &'static str,
    /// Writers that may be there at a time. One alone has the lock of that name.
    pub writers: usize,
    /// Readers that may be there at a time.
    pub readers: usize,
    /// Samples that a slow reader may lag behind.
    pub depth: usize,
    /// What a full reader costs: the oldest sample it has not read, or else the newest.
    pub oldest_goes: bool,
}

impl Terms {
    /// Shared memory for the messages of one writer: as many as all readers may lag behind, with a header each, and
    /// the connections' lists of them \[bytes\].
    pub const fn bytes_of<T>(&self) -> u64 {
        let messages = places(self.readers) * (self.depth + 2) + 2;
        (messages * (size_of::<T>() + HEADER_BYTES)) as u64
    }

    /// Shared memory for what one reader is connected by \[bytes\].
    pub const fn bytes_of_reader(&self) -> u64 {
        (places(self.writers) * (self.depth + 2) * HEADER_BYTES) as u64
    }
}

/// Header of a message and its places in lists, rounded up \[bytes\].
const HEADER_BYTES: usize = 64;

/// A type that is a message.
pub(crate) trait Message: Debug + Copy + ZeroCopySend + 'static {}
impl<T: Debug + Copy + ZeroCopySend + 'static> Message for T {}

/// What to do where a reader is full and the oldest does not go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Full {
    /// It loses this sample.
    Lose,
    /// Wait for it: for virtual time only.
    Wait,
}

/// The writer of a service.
#[derive(Debug)]
pub(crate) struct Writer<T: Message> {
    publisher: Publisher<ipc::Service, T, ()>,
    name: &'static str,
    alone: Option<WriterLock>,
}

impl<T: Message> Writer<T> {
    pub fn new(domain: &Domain, node: &Node, terms: &Terms, full: Full) -> Result<Self, IpcError> {
        let taken = || IpcError::SecondWriter {
            service: terms.name.to_owned(),
            prefix: domain.prefix().to_owned(),
        };
        let alone = match terms.writers {
            1 => Some(WriterLock::take(domain, terms.name)?.ok_or_else(taken)?),
            _ => None,
        };
        let service = open::<T>(domain, node, terms)?;
        let strategy = match full {
            Full::Lose => BackpressureStrategy::DiscardData,
            Full::Wait => BackpressureStrategy::RetryUntilDelivered,
        };
        let publisher = service
            .publisher_builder()
            .max_loaned_samples(1)
            .backpressure_strategy(strategy)
            .create();
        let publisher = publisher.map_err(|error| match error {
            PublisherCreateError::ExceedsMaxSupportedPublishers => taken(),
            error => failed(terms.name, &error),
        })?;
        Ok(Writer {
            publisher,
            name: terms.name,
            alone,
        })
    }

    /// What tells the messages of a service's one writer from those of others; 0 where there may be several.
    pub fn number(&self) -> u64 {
        self.alone.as_ref().map_or(0, WriterLock::number)
    }

    /// Meets readers that have come, as the next sending would, which then has the time.
    pub fn connect(&self) -> Result<(), IpcError> {
        let connected = self.publisher.update_connections();
        connected.map_err(|error| failed(self.name, &error))
    }

    /// Sends a copy; gives the number of readers that it reached.
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
    pub fn new(domain: &Domain, node: &Node, terms: &Terms) -> Result<Self, IpcError> {
        let service = open::<T>(domain, node, terms)?;
        let subscriber = service.subscriber_builder().create();
        let subscriber = subscriber.map_err(|error| match error {
            SubscriberCreateError::ExceedsMaxSupportedSubscribers => IpcError::TooManyReaders {
                service: terms.name.to_owned(),
            },
            error => failed(terms.name, &error),
        })?;
        Ok(Reader {
            subscriber,
            name: terms.name,
        })
    }

    /// The oldest message that was not read yet.
    pub fn receive(&self) -> Result<Option<T>, IpcError> {
        let sample = self.subscriber.receive();
        let sample = sample.map_err(|error| failed(self.name, &error))?;
        Ok(sample.map(|sample| *sample))
    }
}

fn open<T: Message>(
    domain: &Domain,
    node: &Node,
    terms: &Terms,
) -> Result<PortFactory<ipc::Service, T, ()>, IpcError> {
    let name = service_name(terms.name)?;
    let service = settled(
        SETTLES_WITHIN,
        || {
            node.service_builder(&name)
                .publish_subscribe::<T>()
                .max_publishers(places(terms.writers))
                .max_subscribers(places(terms.readers))
                .max_nodes(NODES)
                .subscriber_max_buffer_size(terms.depth)
                .subscriber_max_borrowed_samples(1)
                .history_size(0)
                .enable_safe_overflow(terms.oldest_goes)
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
            return failed(terms.name, &error);
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
                service: terms.name.to_owned(),
                expected: core::any::type_name::<T>(),
                prefix: domain.prefix().to_owned(),
            },
            Open::ExceedsMaxNumberOfNodes => IpcError::TooManyReaders {
                service: terms.name.to_owned(),
            },
            open => failed(terms.name, &open),
        }
    })
}

/// Processes that may have a service open: the writers, the readers, and some that are just leaving.
const NODES: usize = 24 + LOST_PLACES;

/// A process that is killed in the very milliseconds in which it joins may leave a place taken for good, of its
/// services' writers or readers (iceoryx2 0.9.3 clears only what was finished). So many may be lost where there
/// is one place, before whoever made the services has to be restarted; where there are many, some are not used.
const LOST_PLACES: usize = 8;

const fn places(wanted: usize) -> usize {
    match wanted {
        1 => 1 + LOST_PLACES,
        several => several,
    }
}

/// How long a service may take to settle that others are just making or taking away.
const SETTLES_WITHIN: Duration = Duration::from_secs(3);
/// How long it is waited before it is asked for again.
const ASK_AGAIN: Duration = Duration::from_millis(2);

/// Opens what others may be making and taking away at the same time: the library gives up on it after a few
/// rounds of its own, or takes what is half there for broken.
fn settled<T, E>(
    within: Duration,
    mut open: impl FnMut() -> Result<T, E>,
    in_flux: impl Fn(&E) -> bool,
) -> Result<T, E> {
    let start = Instant::now();
    loop {
        let opened = open();
        match &opened {
            Err(error) if in_flux(error) && start.elapsed() < within => pause(ASK_AGAIN),
            _ => return opened,
        }
    }
}

fn service_name(name: &str) -> Result<ServiceName, IpcError> {
    ServiceName::new(name).map_err(|error| failed(name, &error))
}

pub(crate) fn failed(service: &str, cause: &dyn core::fmt::Display) -> IpcError {
    IpcError::Service {
        service: service.to_owned(),
        cause: cause.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Opens at the `at`th attempt, refused with `error` until then; the attempts that were made.
    fn attempts(at: u32, error: &'static str) -> (Result<(), &'static str>, u32) {
        let mut made = 0;
        let opened = settled(
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
    fn what_is_in_flux_is_asked_for_again_but_not_for_ever() {
        assert_eq!(attempts(1, "in flux"), (Ok(()), 1));
        assert_eq!(attempts(3, "in flux"), (Ok(()), 3));
        let (opened, made) = attempts(u32::MAX, "in flux");
        assert_eq!(opened, Err("in flux"));
        assert!(made > 1, "{made}");
        assert_eq!(attempts(2, "another version"), (Err("another version"), 1));
    }
}
