//! Arguments of `supple effects`.

use super::UrdfArgs;
use std::path::PathBuf;

/// Arguments of `effects`.
#[derive(Clone, Debug, clap::Args)]
pub struct EffectsArgs {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Number of seeds of each effect.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    pub seeds: u64,
    /// Only effects whose name contains this text. May be repeated.
    #[arg(long, value_name = "TEXT")]
    pub only: Vec<String>,
    /// Folder for effects.md and effects.json.
    #[arg(long, value_name = "DIR", default_value = "out/effects")]
    pub out: PathBuf,
    /// Print the results as JSON instead of the table.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}
