//! Options of the simulated arm on a command line.

use crate::config::PlantConfig;
use crate::error::PlantError;
use crate::injection::Injection;
use crate::options::{PlantOptions, PlantOptionsError};
use crate::scene::Scene;
use clap::Args;
use std::path::PathBuf;
use supple_model::Description;

/// Effects of a real arm in the simulated one.
#[derive(Clone, Debug, Default, Args)]
pub struct PlantArgs {
    /// Effects of a real arm in the simulated one, as TOML, or a built-in set by name; `supple plant list` has all options.
    #[arg(long, value_name = "FILE", conflicts_with = "realistic")]
    pub plant_options: Option<PathBuf>,
    /// Give the simulated arm all effects of a real one, each of modest size: the set `realistic`, `openarm-realistic` or
    /// `urdf-realistic` of `supple plant show`, for motors with cables, motors with gears on a bus, or motors that the arm's
    /// TOML does not describe.
    #[arg(long)]
    pub realistic: bool,
}

impl PlantArgs {
    /// Reads and checks the options for `arm`.
    ///
    /// # Errors
    /// As [`PlantOptions::chosen`].
    pub fn options(&self, arm: &Description) -> Result<PlantOptions, PlantOptionsError> {
        PlantOptions::chosen(arm, self.plant_options.as_deref(), self.realistic)
    }

    /// The same on the command line of another process.
    pub fn to_arguments(&self) -> Vec<String> {
        let mut arguments = Vec::new();
        if let Some(file) = &self.plant_options {
            arguments.extend(["--plant-options".to_owned(), file.display().to_string()]);
        }
        arguments.extend(self.realistic.then(|| "--realistic".to_owned()));
        arguments
    }
}

/// What a process with a simulated arm simulates, injects and writes.
#[derive(Clone, Debug, Default, Args)]
pub struct SimulationArgs {
    /// Its effects.
    #[command(flatten)]
    pub plant: PlantArgs,
    /// Adds a wooden block below the workspace; its top face is at this height above the base frame (m).
    #[arg(long, value_name = "M", allow_negative_numbers = true, value_parser = height)]
    pub block_m: Option<f64>,
    /// Injects a fault: KIND or KIND:key=value,..., for example encoder-stuck:joint=1,at-s=2; see --help. May be
    /// repeated.
    #[arg(long, value_name = "SPEC", long_help = crate::injection::HELP)]
    pub inject: Vec<Injection>,
    /// Writes joint torques and tip forces to a CSV file every millisecond.
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
}

impl SimulationArgs {
    /// The plant of `arm` with these effects and this block.
    ///
    /// # Errors
    /// [`SimulationArgsError`].
    pub fn config<const N: usize>(
        &self,
        arm: &Description,
    ) -> Result<PlantConfig<N>, SimulationArgsError> {
        let effects = self.plant.options(arm)?;
        let mut config = effects.apply(PlantConfig::<N>::from_description(arm)?)?;
        if let Some(face_m) = self.block_m {
            config.scene = Scene::with_block_at(face_m);
        }
        Ok(config)
    }
}

/// Why the options of a simulated arm give no plant.
#[derive(Debug, thiserror::Error)]
pub enum SimulationArgsError {
    /// Invalid effects.
    #[error(transparent)]
    Options(#[from] PlantOptionsError),
    /// The description of the arm.
    #[error(transparent)]
    Model(#[from] supple_model::ModelError),
    /// The plant.
    #[error("the plant: {0}")]
    Plant(#[from] PlantError),
}

fn height(text: &str) -> Result<f64, String> {
    let height = text.parse().ok();
    let height = height.filter(|m| (-10.0..=10.0).contains(m));
    height.ok_or_else(|| "give a height from -10 to 10 m".to_owned())
}
