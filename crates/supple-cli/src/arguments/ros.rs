//! Arguments of `supple ros`, which `supple` passes to `supple-ros`.

use crate::range::between;
use clap::Args;
use supple_model::UrdfArgs;

/// Arguments of `supple ros`.
#[derive(Clone, Debug, Args)]
pub struct RosArgs {
    /// Prefix of the system. Default: SUPPLE_PREFIX or `supple`.
    #[arg(long, value_name = "NAME")]
    pub prefix: Option<String>,
    /// The arm of the running system. Default: the arm of its `supple up`, otherwise wam4.
    #[arg(long, value_name = "NAME|PATH")]
    pub arm: Option<String>,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Domain of the ROS 2 graph.
    #[arg(long, env = "ROS_DOMAIN_ID", value_name = "ID", default_value_t = 0, value_parser = clap::value_parser!(u32).range(0..=232))]
    pub domain_id: u32,
    /// Namespace of the topics, for several arms in one domain: `/left`.
    #[arg(long, value_name = "NAME", default_value = "/", value_parser = namespace)]
    pub namespace: String,
    /// Endpoint to connect to, tried until it answers; may be repeated. Default: the router of rmw_zenoh on this machine.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    pub connect: Vec<String>,
    /// Endpoint to listen on; may be repeated. Other machines reach only what is not on 127.0.0.1.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:0")]
    pub listen: Vec<String>,
    /// Messages per second on each topic (Hz).
    #[arg(long, value_name = "HZ", default_value_t = 100.0, value_parser = between(1.0, 1000.0))]
    pub rate_hz: f64,
    /// Move the arm as messages on `/joint_trajectory` ask. Zenoh does not ask who sends them.
    #[arg(long)]
    pub accept_trajectories: bool,
    /// Print what has started as JSON.
    #[arg(long)]
    pub json: bool,
}

/// A name of ROS 2: `/`, `/left`, `/lab/left`.
fn namespace(text: &str) -> Result<String, String> {
    let valid = |part: &str| {
        let mut letters = part.chars();
        letters
            .next()
            .is_some_and(|first| first.is_ascii_alphabetic() || first == '_')
            && letters.all(|other| other.is_ascii_alphanumeric() || other == '_')
    };
    match text.strip_prefix('/') {
        Some("") => Ok(text.to_owned()),
        Some(rest) if rest.split('/').all(valid) => Ok(text.to_owned()),
        _ => Err("expected `/` or a name such as `/left`: letters, digits and underscores after each slash".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::namespace;

    #[test]
    fn a_namespace_is_a_name_of_ros() {
        for good in ["/", "/left", "/lab_2/left"] {
            assert_eq!(namespace(good).as_deref(), Ok(good));
        }
        for bad in ["", "left", "/left/", "//left", "/2", "/a-b", "/a b", "/a*"] {
            assert!(namespace(bad).is_err(), "{bad}");
        }
    }
}
