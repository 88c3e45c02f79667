//! Key expressions of ROS 2 topics and of the tokens by which nodes, publishers and subscriptions are known to others.
//!
//! Source: the design document of rmw_zenoh, <https://github.com/ros2/rmw_zenoh/blob/rolling/docs/design.md>.

use std::fmt::Write;

/// A node in the ROS 2 graph.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    /// `ROS_DOMAIN_ID`.
    pub domain_id: u32,
    /// Id of the Zenoh session.
    pub session: String,
    /// Namespace, `/` or `/left`.
    pub namespace: String,
    /// Name of the node.
    pub name: &'static str,
}

/// Kind of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EndpointKind {
    /// A publisher.
    Publisher,
    /// A subscription.
    Subscription,
}

/// A publisher or subscription.
#[derive(Clone, Debug)]
pub(crate) struct Endpoint {
    /// Unique number in the node; the node itself is 0.
    pub id: u32,
    /// Kind.
    pub kind: EndpointKind,
    /// Topic with its namespace, `/joint_states`.
    pub topic: String,
    /// Message type, `sensor_msgs/msg/JointState`.
    pub type_name: String,
    /// Hash of the message type.
    pub type_hash: String,
    /// Whether later subscriptions receive the last message.
    pub transient_local: bool,
}

/// Number of messages that a subscription keeps, in the tokens; the default of `rclcpp`.
const DEPTH: u32 = 10;

impl Node {
    /// Returns the topic in the node's namespace.
    pub fn topic(&self, name: &str) -> String {
        format!("{}{name}", self.namespace.trim_end_matches('/'))
    }

    /// Returns the token of the node.
    pub fn token(&self) -> String {
        self.token_of(0, "NN")
    }

    /// Returns the token of an endpoint.
    pub fn endpoint_token(&self, endpoint: &Endpoint) -> String {
        let kind = match endpoint.kind {
            EndpointKind::Publisher => "MP",
            EndpointKind::Subscription => "MS",
        };
        let mut token = self.token_of(endpoint.id, kind);
        // Reliability and durability, history, deadline, lifespan, liveliness; what is empty has its default.
        let durability = if endpoint.transient_local { "1" } else { "" };
        let depth = if endpoint.transient_local { 1 } else { DEPTH };
        // Writing to a string does not fail.
        let _ = write!(
            token,
            "/{}/{}/{}/:{durability}:,{depth}:,:,:,,",
            in_token(&endpoint.topic),
            dds_type(&endpoint.type_name),
            endpoint.type_hash,
        );
        token
    }

    /// Returns the key of an endpoint's messages.
    pub fn key(&self, endpoint: &Endpoint) -> String {
        let topic = endpoint.topic.trim_start_matches('/');
        let type_name = dds_type(&endpoint.type_name);
        format!(
            "{}/{topic}/{type_name}/{}",
            self.domain_id, endpoint.type_hash
        )
    }

    fn token_of(&self, id: u32, kind: &str) -> String {
        // The node is number 0, its enclave `/`.
        format!(
            "@ros2_lv/{}/{}/0/{id}/{kind}/%/{}/{}",
            self.domain_id,
            self.session,
            in_token(&self.namespace),
            self.name
        )
    }
}

/// A name as one part of a token.
fn in_token(name: &str) -> String {
    name.replace('/', "%")
}

/// `sensor_msgs/msg/JointState` as `sensor_msgs::msg::dds_::JointState_`.
fn dds_type(name: &str) -> String {
    let (package, name) = name.rsplit_once('/').unwrap_or(("", name));
    format!("{}::dds_::{name}_", package.replace('/', "::"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node(namespace: &str) -> Node {
        Node {
            domain_id: 7,
            session: "a1b2".to_owned(),
            namespace: namespace.to_owned(),
            name: "supple",
        }
    }

    fn endpoint(topic: String) -> Endpoint {
        Endpoint {
            id: 3,
            kind: EndpointKind::Publisher,
            topic,
            type_name: "sensor_msgs/msg/JointState".to_owned(),
            type_hash: "RIHS01_ab".to_owned(),
            transient_local: false,
        }
    }

    #[test]
    fn keys_and_tokens_have_the_form_of_rmw_zenoh() {
        let node = node("/");
        let mut endpoint = endpoint(node.topic("/joint_states"));
        assert_eq!(node.token(), "@ros2_lv/7/a1b2/0/0/NN/%/%/supple");
        assert_eq!(
            node.key(&endpoint),
            "7/joint_states/sensor_msgs::msg::dds_::JointState_/RIHS01_ab"
        );
        assert_eq!(
            node.endpoint_token(&endpoint),
            "@ros2_lv/7/a1b2/0/3/MP/%/%/supple/%joint_states/sensor_msgs::msg::dds_::JointState_/RIHS01_ab/::,10:,:,:,,"
        );
        endpoint.kind = EndpointKind::Subscription;
        endpoint.transient_local = true;
        let token = node.endpoint_token(&endpoint);
        assert!(
            token.contains("/MS/") && token.ends_with("/:1:,1:,:,:,,"),
            "{token}"
        );
    }

    #[test]
    fn topics_are_in_the_namespace() {
        let node = node("/left/arm");
        let endpoint = endpoint(node.topic("/tf"));
        assert!(node.key(&endpoint).starts_with("7/left/arm/tf/"));
        assert!(
            node.endpoint_token(&endpoint)
                .contains("/%left%arm/supple/%left%arm%tf/")
        );
    }
}
