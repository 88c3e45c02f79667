//! Fuzz targets: all parsers of external bytes, as functions of a byte slice.
//!
//! A [`Target`] must accept any bytes: it returns in bounded time and memory, and its assertions hold. cargo-fuzz
//! runs the targets with coverage (`libfuzzer/`, one program each); a test on the stable compiler runs them over the
//! committed inputs in `corpus/` and over a seeded stream of their mutations (`tests/corpus.rs`).
//!
//! `./ci.sh fuzz` runs cargo-fuzz if a nightly compiler and cargo-fuzz are installed, and the test otherwise. An
//! input that made a target fail is committed in `corpus/<target>/` after the bug is fixed, under a descriptive name;
//! [`seeds`] writes the `seed-` files there, see `tests/corpus.rs`.

pub mod arms;
pub mod bytes;
pub mod damiao;
pub mod emulated;
pub mod logs;
pub mod messages;
pub mod mutate;
pub mod pucks;
pub mod requests;
pub mod seed;
pub mod seeds;
pub mod tables;

use std::path::PathBuf;

/// A fuzz target: a parser of external bytes.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Name of the target, of its program and of its folder in `corpus`.
    pub name: &'static str,
    /// Function that processes the bytes.
    pub body: fn(&[u8]),
    /// Number of mutations in the test on the stable compiler, chosen so that each target takes about a second.
    pub mutations: u32,
}

/// All targets.
pub const TARGETS: [Target; 20] = [
    target("inbound", pucks::inbound, 100_000),
    target("property", pucks::property, 100_000),
    target("position", pucks::position, 100_000),
    target("torque", pucks::torque, 100_000),
    target("force_torque", pucks::force_torque, 100_000),
    target("pendant", pucks::pendant, 100_000),
    target("values", pucks::values, 100_000),
    target("arm_state", messages::arm_state, 3_000),
    target("torque_command", messages::torque_command, 50_000),
    target("telemetry", messages::telemetry, 20_000),
    target("operator_request", requests::operator_request, 3_000),
    target("log", logs::log, 500),
    target("log_schema", logs::log_schema, 1_000),
    target("urdf", arms::urdf, 1_000),
    target("toml", arms::toml, 1_000),
    target("csv", tables::csv, 3_000),
    target("pendant_line", emulated::pendant_line, 300),
    target("arm_bus", emulated::arm_bus, 300),
    target("damiao_reply", damiao::damiao_reply, 100_000),
    target("damiao_request", damiao::damiao_request, 100_000),
];

const fn target(name: &'static str, body: fn(&[u8]), mutations: u32) -> Target {
    Target {
        name,
        body,
        mutations,
    }
}

impl Target {
    /// Folder of the committed inputs.
    pub fn corpus(&self) -> PathBuf {
        let root = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
        root.join("corpus").join(self.name)
    }
}
