//! Arguments of `supple demo`.

use super::{PlantArgs, UrdfArgs};
use std::path::PathBuf;

/// Arguments of `demo`.
#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML, of its folder, or of a URDF.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// What a URDF alone does not contain.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// The controller's model of the arm, for example the output of `supple identify`: path of its TOML or folder.
    /// Default: the plant's own parameters, with the perturbations that each experiment defines, and for contact a model that is identified on the arm. Without options of
    /// the simulated arm, the arm of each of --realistic-seeds is calibrated and uses its own model instead of this one.
    #[arg(long, value_name = "PATH")]
    pub model: Option<PathBuf>,
    /// Folder for all results. Existing files of the same names are replaced, other files are kept.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out: PathBuf,
    /// Seed of the perturbed models and of all noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the summary as JSON instead of a table; an error is then also an object on standard output.
    #[arg(long)]
    pub json: bool,
    /// Print results only, no progress.
    #[arg(long)]
    pub quiet: bool,
    /// Write no logs; together they take about half a gigabyte.
    #[arg(long)]
    pub no_logs: bool,
    /// Number of calibrated arms with the effects of a real one; 0 leaves these runs out.
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = clap::value_parser!(u64).range(0..=1000))]
    pub realistic_seeds: u64,
    /// The simulated arm.
    #[command(flatten)]
    pub plant: PlantArgs,
}
