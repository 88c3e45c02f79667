//! Data that the page must receive before the first snapshot, as JSON.

use crate::error::ViewError;
use crate::protocol::Channel;
use serde_json::{Value, json};
use supple_core::torques::TERMS;
use supple_log::LiveEncoder;
use supple_model::{Description, with_dof};

/// Content of the page and its options.
pub struct PageContent<'a> {
    /// The arm.
    pub description: &'a Description,
    /// Title.
    pub title: String,
    /// Description of the log; `None` for a running system.
    pub log: Option<Value>,
    /// Height of the top face of a block \[m\].
    pub block_m: Option<f64>,
    /// Whether the page offers commands.
    pub commands: bool,
    /// Whether the system has an emulated pendant.
    pub pendant: bool,
}

/// Encodes the page's description as JSON.
///
/// # Errors
/// [`ViewError::Model`] if the arm's configuration is invalid.
pub fn info(content: &PageContent<'_>) -> Result<Vec<u8>, ViewError> {
    let description = content.description;
    let limits = with_dof!(description.dof(), N => description.config::<N>().map(|config| {
        (config.limits.stiffness_n_per_m, config.limits.damping_n_s_per_m, config.period_s)
    }))??;
    let (stiffness, damping, period_s) = limits;
    let terms: Vec<&str> = TERMS.iter().map(|term| term.name).collect();
    let info = json!({
        "title": content.title,
        "version": env!("CARGO_PKG_VERSION"),
        "arm": description.name(),
        "joints": description.joint_names(),
        "urdf": description.urdf(),
        "fixed_joints_rad": description.settings().fixed_joints_rad,
        "home_rad": description.home_rad(),
        "period_s": period_s,
        "max_stiffness_n_per_m": stiffness,
        "max_damping_n_s_per_m": damping,
        "terms": terms,
        "block_m": content.block_m,
        "commands": content.commands,
        "pendant": content.pendant,
        "log": content.log,
    });
    Ok(info.to_string().into_bytes())
}

/// Returns the channels of a running system: the channel of snapshots, and the channels of a log.
///
/// # Errors
/// [`ViewError::Log`] if the arm's configuration is invalid.
pub fn channels(description: &Description) -> Result<Vec<Channel>, ViewError> {
    let of_log = with_dof!(description.dof(), N => LiveEncoder::<N>::channels())??;
    let of_log = of_log.into_iter().map(|channel| Channel {
        topic: channel.topic,
        encoding: "cdr",
        schema_name: channel.schema_name,
        schema_encoding: "ros2msg",
        schema: channel.schema,
    });
    let snapshots = Channel {
        topic: "/view".to_owned(),
        encoding: "json",
        schema_name: "supple.View".to_owned(),
        schema_encoding: "jsonschema",
        schema: r#"{"type":"object"}"#.to_owned(),
    };
    Ok([snapshots].into_iter().chain(of_log).collect())
}
