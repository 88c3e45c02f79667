//! `supple plant`.

use crate::console::{print_json, print_line};
use crate::exit::Failure;
use clap::Subcommand;
use serde::Serialize;
use std::collections::BTreeMap;
use supple_plant::PlantOptions;
use supple_plant::options::{OPTIONS, SETS};

/// Command of `supple plant`.
#[derive(Clone, Debug, Subcommand)]
pub enum PlantCommand {
    /// List all options of the simulated arm: unit, range, value in each built-in set, effect and source.
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
    /// Value in each set that has the option.
    sets: BTreeMap<&'static str, f64>,
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
    let mut lines: Vec<Line> = OPTIONS
        .iter()
        .map(|option| Line {
            name: option.name,
            unit: option.unit,
            min: option.min,
            max: option.max,
            sets: BTreeMap::new(),
            effect: option.effect,
            source: option.source,
        })
        .collect();
    for set in SETS {
        let options = PlantOptions::from_toml(PlantOptions::set(set)?, set)?;
        for (line, (_, value)) in lines.iter_mut().zip(options.values()) {
            line.sets.extend(value.map(|value| (set, value)));
        }
    }
    if as_json {
        return print_json(&lines);
    }
    for (line, option) in lines.iter().zip(OPTIONS) {
        let mut sets = line
            .sets
            .iter()
            .map(|(set, value)| format!("{set}: {value}"));
        let first = sets.next().unwrap_or_else(|| "in no set".to_owned());
        let sets = sets.fold(first, |all, set| format!("{all}, {set}"));
        print_line(&format!(
            "{}: {}\n    {sets}\n    {}\n    source: {}",
            line.name,
            option.range(),
            line.effect,
            line.source
        ))?;
    }
    Ok(())
}
