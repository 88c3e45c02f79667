//! Options of the demo.

use std::path::PathBuf;
use supple_model::Description;
use supple_plant::PlantOptions;

/// Options of the demo.
#[derive(Clone, Debug)]
pub struct DemoOptions {
    /// Seed of the perturbed models and of all noise.
    pub seed: u64,
    /// Existing folder for one MCAP for each run; `None` writes no logs.
    pub log_dir: Option<PathBuf>,
    /// Model of every controller, unperturbed; `None` uses the arm's own parameters, perturbed if the run
    /// requires it. Each seed on the realistic plant is calibrated there instead, unless `plant` has options.
    pub model: Option<Description>,
    /// Effects of a real arm in the plant of every run.
    pub plant: PlantOptions,
    /// Number of seeds on the realistic plant, or on the plant of `plant` if that has options; zero leaves these runs out.
    pub realistic_seeds: u64,
}
