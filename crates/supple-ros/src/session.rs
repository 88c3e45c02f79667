//! The bridge's Zenoh session: one ROS 2 node with its publishers and its subscription.

use crate::attachment::Attachments;
use crate::error::RosError;
use crate::names::{Endpoint, EndpointKind, Node};
use crate::type_hash::type_hash;
use std::sync::mpsc::{Receiver, sync_channel};
use supple_cli::arguments::RosArgs;
use zenoh::Wait;
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::CongestionControl;
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig};

/// Messages of a subscription that wait to be read; more are dropped.
const WAITING_MESSAGES: usize = 8;

/// A node in the ROS 2 graph.
pub(crate) struct Session {
    session: zenoh::Session,
    node: Node,
    endpoints: u32,
    // Tokens, and subscriptions, which end when they are dropped.
    held: Vec<LivelinessToken>,
    subscriptions: Vec<zenoh::pubsub::Subscriber<()>>,
}

/// A publisher of one topic.
pub(crate) struct Publisher {
    publisher: AdvancedPublisher<'static>,
    attachments: Attachments,
    topic: String,
}

/// A topic with its message type.
pub(crate) struct Topic<'a> {
    /// Name without the namespace, `/joint_states`.
    pub name: &'a str,
    /// Message type, `sensor_msgs/msg/JointState`.
    pub type_name: &'a str,
    /// Definition of the message type.
    pub definition: &'a str,
}

impl Session {
    /// Opens the session and declares the node.
    ///
    /// # Errors
    /// [`RosError::Zenoh`].
    pub fn open(args: &RosArgs) -> Result<Session, RosError> {
        let mut config = zenoh::Config::default();
        let endpoints = |list: &[String]| serde_json::json!(list).to_string();
        for (key, value) in [
            ("mode", "\"peer\"".to_owned()),
            ("connect/endpoints", endpoints(&args.connect)),
            ("listen/endpoints", endpoints(&args.listen)),
            // Others are found through the router of rmw_zenoh, without multicast.
            ("scouting/multicast/enabled", "false".to_owned()),
            ("scouting/gossip/enabled", "true".to_owned()),
            // Needed to keep the last message for later subscriptions.
            ("timestamping/enabled", "true".to_owned()),
            ("queries_default_timeout", "1000".to_owned()),
        ] {
            config
                .insert_json5(key, &value)
                .map_err(RosError::zenoh(format!("setting {key} to {value}")))?;
        }
        let session = zenoh::open(config)
            .wait()
            .map_err(RosError::zenoh("opening the session"))?;
        let node = Node {
            domain_id: args.domain_id,
            session: session.zid().to_string(),
            namespace: args.namespace.clone(),
            name: "supple",
        };
        let mut opened = Session {
            session,
            node,
            endpoints: 0,
            held: Vec::new(),
            subscriptions: Vec::new(),
        };
        let token = opened.node.token();
        opened.declare(&token)?;
        Ok(opened)
    }

    /// Declares a publisher; later subscriptions receive its last message if `keeps_last` is set.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn publisher(
        &mut self,
        topic: &Topic<'_>,
        keeps_last: bool,
    ) -> Result<Publisher, RosError> {
        let endpoint = self.endpoint(topic, EndpointKind::Publisher, keeps_last)?;
        let (key, token) = (
            self.node.key(&endpoint),
            self.node.endpoint_token(&endpoint),
        );
        // A slow subscription loses messages; nobody waits for it.
        let congestion = match keeps_last {
            true => CongestionControl::Block,
            false => CongestionControl::Drop,
        };
        let builder = self
            .session
            .declare_publisher(key)
            .congestion_control(congestion)
            .advanced();
        let builder = match keeps_last {
            true => builder
                .cache(CacheConfig::default().max_samples(1))
                .publisher_detection(),
            false => builder,
        };
        let publisher = builder
            .wait()
            .map_err(RosError::zenoh(format!("declaring {}", endpoint.topic)))?;
        self.declare(&token)?;
        Ok(Publisher {
            publisher,
            attachments: Attachments::new(&token),
            topic: endpoint.topic,
        })
    }

    /// Declares a subscription; its messages arrive at the returned receiver.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn subscription(&mut self, topic: &Topic<'_>) -> Result<Receiver<Vec<u8>>, RosError> {
        let endpoint = self.endpoint(topic, EndpointKind::Subscription, false)?;
        let (sender, receiver) = sync_channel(WAITING_MESSAGES);
        let subscription = self
            .session
            .declare_subscriber(self.node.key(&endpoint))
            .callback(move |sample| {
                // Full: the bridge is behind by several messages.
                let _ = sender.try_send(sample.payload().to_bytes().into_owned());
            })
            .wait()
            .map_err(RosError::zenoh(format!(
                "subscribing to {}",
                endpoint.topic
            )))?;
        self.subscriptions.push(subscription);
        let token = self.node.endpoint_token(&endpoint);
        self.declare(&token)?;
        Ok(receiver)
    }

    fn endpoint(
        &mut self,
        topic: &Topic<'_>,
        kind: EndpointKind,
        keeps_last: bool,
    ) -> Result<Endpoint, RosError> {
        self.endpoints += 1;
        Ok(Endpoint {
            id: self.endpoints,
            kind,
            topic: self.node.topic(topic.name),
            type_name: topic.type_name.to_owned(),
            type_hash: type_hash(topic.type_name, topic.definition)?,
            transient_local: keeps_last,
        })
    }

    fn declare(&mut self, token: &str) -> Result<(), RosError> {
        let declared = self
            .session
            .liveliness()
            .declare_token(token.to_owned())
            .wait();
        self.held
            .push(declared.map_err(RosError::zenoh(format!("declaring {token}")))?);
        Ok(())
    }
}

impl Publisher {
    /// Publishes a message; `time_ns` counts from the epoch.
    ///
    /// # Errors
    /// [`RosError::Zenoh`].
    pub fn put(&mut self, time_ns: u64, message: Vec<u8>) -> Result<(), RosError> {
        self.publisher
            .put(message)
            .attachment(self.attachments.next(time_ns))
            .wait()
            .map_err(RosError::zenoh(format!("publishing {}", self.topic)))
    }
}
