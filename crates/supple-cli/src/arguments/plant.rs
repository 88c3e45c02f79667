//! Options of the simulated arm, and `supple plant`.

use crate::console::{print_json, print_line};
use crate::exit::Failure;
use clap::{Args, Subcommand};
use serde::Serialize;
use std::path::PathBuf;
use supple_model::Description;
use supple_plant::PlantOptions;
use supple_plant::options::OPTIONS;

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
    /// [`Failure::PlantOptions`].
    pub fn options(&self, arm: &Description) -> Result<PlantOptions, Failure> {
        let file = self.plant_options.as_deref();
        Ok(PlantOptions::chosen(arm, file, self.realistic)?)
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

/// Command of `supple plant`.
#[derive(Clone, Debug, Subcommand)]
pub enum PlantCommand {
    /// List all options of the simulated arm: unit, range, size in the set `realistic`, effect and source.
    List {
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Print a built-in set of options as TOML, to start an own file from.
    Show {
        /// Name of the set.
        #[arg(value_name = "SET", default_value = "realistic")]
        name: String,
    },
}

#[derive(Serialize)]
struct Line {
    name: &'static str,
    unit: &'static str,
    min: f64,
    max: f64,
    realistic: Option<f64>,
    effect: &'static str,
    source: &'static str,
}

impl PlantCommand {
    /// Whether the command prints JSON on standard output.
    pub fn json(&self) -> bool {
        matches!(self, PlantCommand::List { json: true })
    }

    /// Runs the command.
    ///
    /// # Errors
    /// [`Failure::PlantOptions`] for an unknown set; [`Failure`] if standard output cannot be written.
    pub fn run(&self) -> Result<(), Failure> {
        match self {
            PlantCommand::List { json } => list(*json),
            PlantCommand::Show { name } => print_line(PlantOptions::set(name)?.trim_end()),
        }
    }
}

fn list(as_json: bool) -> Result<(), Failure> {
    let realistic = PlantOptions::realistic();
    let lines: Vec<Line> = OPTIONS
        .iter()
        .zip(realistic.values())
        .map(|(option, (_, realistic))| Line {
            name: option.name,
            unit: option.unit,
            min: option.min,
            max: option.max,
            realistic,
            effect: option.effect,
            source: option.source,
        })
        .collect();
    if as_json {
        return print_json(&lines);
    }
    for (line, option) in lines.iter().zip(OPTIONS) {
        let realistic = line
            .realistic
            .map_or("not set".to_owned(), |x| x.to_string());
        print_line(&format!(
            "{}: {}; realistic: {realistic}\n    {}\n    source: {}",
            line.name,
            option.range(),
            line.effect,
            line.source
        ))?;
    }
    Ok(())
}
