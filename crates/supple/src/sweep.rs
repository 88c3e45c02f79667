//! `supple sweep`: runs many experiments with the Python package, which distributes them with Dask.
//!
//! This process replaces itself with the interpreter (exec). [`SweepArgs`] is parsed for validation, help, completions and manual
//! pages; the Python program parses the same arguments again.

use clap::Args;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;
use supple_cli::exit::Failure;
use supple_cli::sibling::python;

/// Python program that starts the package's command with all arguments, including `sweep`; without the package it reports an
/// error with exit code 10.
const START: &str = "import sys
try:
    from supple.__main__ import main
except ImportError as error:
    print(f'error: {sys.executable}: {error}; install the Python package: pip install ./python', file=sys.stderr)
    sys.exit(10)
sys.exit(main())";

/// Arguments of `sweep`.
#[derive(Clone, Debug, Args)]
pub struct SweepArgs {
    /// The experiments, TOML: arm, experiment, seed, number of repetitions, fixed and varied arguments; see docs/sweeps.md.
    pub spec: PathBuf,
    /// Folder of the results, one Parquet file for each chunk of tasks. Tasks whose results are in it are not run again.
    #[arg(long, value_name = "DIR", default_value = "out/sweep")]
    pub results: PathBuf,
    /// Number of worker processes on this machine. Default: one per processor.
    #[arg(long, value_name = "N", conflicts_with = "scheduler", value_parser = clap::value_parser!(u16).range(1..))]
    pub workers: Option<u16>,
    /// Address of the Dask scheduler of a cluster, such as tcp://host:8786. Default: a local Dask cluster, on loopback.
    #[arg(long, value_name = "ADDRESS")]
    pub scheduler: Option<String>,
    /// Print the summary as JSON.
    #[arg(long)]
    pub json: bool,
    /// Print no progress.
    #[arg(long)]
    pub quiet: bool,
}

/// Replaces this process with the interpreter. Returns only if that fails.
pub fn exec() -> Failure {
    let interpreter = python();
    let error = std::process::Command::new(&interpreter)
        .args(["-c", START])
        .args(std::env::args_os().skip(1))
        .exec();
    Failure::file("start", &interpreter, error)
}
