//! Runs the paper's experiments without logs and prints their numbers as JSON.
//! Arguments: the arm, by default `wam4`, and the seed, by default 0.

use supple_experiment::{DemoOptions, demo};
use supple_model::Description;
use supple_plant::PlantOptions;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let arm = arguments.next().unwrap_or_else(|| "wam4".to_owned());
    let seed = arguments.next().map_or(Ok(0), |seed| seed.parse())?;
    let options = DemoOptions {
        seed,
        log_dir: None,
        model: None,
        plant: PlantOptions::default(),
        realistic_seeds: 0,
    };
    let demo = demo(&Description::asset(&arm)?, &options, &|progress| {
        eprintln!(
            "{:5.1} of {:5.1} s: {}",
            progress.done_s, progress.total_s, progress.finished
        );
    })?;
    println!("{}", serde_json::to_string_pretty(&demo.summary)?);
    Ok(())
}
