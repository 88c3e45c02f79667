//! Arguments of `supple new`.

use super::UrdfArgs;
use std::path::PathBuf;

/// Arguments of `new`.
#[derive(Clone, Debug, clap::Args)]
pub struct NewArgs {
    /// The arm's URDF. A xacro file is expanded first: `xacro FILE > robot.urdf`.
    #[arg(value_name = "URDF")]
    pub file: PathBuf,
    /// Tip and repair.
    #[command(flatten)]
    pub urdf: UrdfArgs,
    /// Folder for arm.toml, arm.urdf and arm.svg. Default: the name of the URDF without its ending.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace files of an existing arm.
    #[arg(long)]
    pub force: bool,
    /// Reject a URDF with content that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// Print the result as JSON.
    #[arg(long)]
    pub json: bool,
}
