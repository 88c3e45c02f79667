//! `supple plant`.

use crate::console::{print_json, print_line};
use crate::exit::Failure;
use clap::Subcommand;
use serde::Serialize;
use supple_plant::PlantOptions;
use supple_plant::options::OPTIONS;

/// Command of `supple plant`.
#[derive(Clone, Debug, Subcommand)]
pub enum PlantCommand {
    /// List all options of the simulated arm: unit, range, size in the set `realistic`, effect and source.
    List {
        /// Print the result as JSON.
        #[arg(long)]
        json: bool,
    },
    /// Print a built-in set of options as TOML, as a template for your own file.
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
