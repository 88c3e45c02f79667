//! `supple demo`: runs the experiments and writes figures, report, summary and logs.

use crate::progress::ProgressReporter;
use crate::{figures, report, table};
use supple_cli::arguments::DemoArgs;
use supple_cli::arms;
use supple_cli::console::{json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_cli::out::Staging;
use supple_experiment::summary::Summary;
use supple_experiment::{Demo, DemoOptions};
use supple_model::Description;
use supple_plant::PlantOptions;

/// Runs `supple demo`.
///
/// # Errors
/// [`Failure`]; if a fault ended a run, [`Failure::Fault`] after all results are written.
pub fn run(args: &DemoArgs) -> Result<(), Failure> {
    let summary = perform(args, None)?;
    if args.json {
        print_line(&json(&summary)?)?;
    } else {
        print(&summary)?;
    }
    finish(args, &summary)
}

/// Prints the summary as a table.
///
/// # Errors
/// [`Failure`] if standard output cannot be written.
pub fn print(summary: &Summary) -> Result<(), Failure> {
    print_line(&format!("{}\n", table::table(summary)))?;
    let notes = table::arm_notes(summary);
    match notes.is_empty() {
        true => Ok(()),
        false => print_line(&format!("Notes for this arm:\n  {}\n", notes.join("\n  "))),
    }
}

/// Prints the path of the report, and fails if faults ended runs early.
///
/// # Errors
/// [`Failure::Fault`].
pub fn finish(args: &DemoArgs, summary: &Summary) -> Result<(), Failure> {
    if !args.quiet {
        print_status(&format!(
            "report: {}",
            args.out.join("report.html").display()
        ));
    }
    let faults = report::fault_lines(summary);
    if faults.is_empty() {
        return Ok(());
    }
    Err(Failure::Fault {
        runs: faults.join("; "),
        out: args.out.clone(),
    })
}

/// Runs the experiments on an arm with the effects `plant` instead of those of `args`, and writes all results.
///
/// # Errors
/// [`Failure`].
pub fn perform(args: &DemoArgs, plant: Option<PlantOptions>) -> Result<Summary, Failure> {
    let arm = arms::find(&args.urdf.name(&args.arm), args.strict)?;
    let plant = plant.map_or_else(|| args.plant.options(&arm), Ok)?;
    let model = args
        .model
        .as_ref()
        .map(|path| arms::load(path, args.strict));
    let model = model.transpose()?;
    let staging = Staging::new(&args.out, &["report.html", "summary.json"])?;
    let options = DemoOptions {
        plant,
        realistic_seeds: args.realistic_seeds,
        seed: args.seed,
        model,
        log_dir: match args.no_logs {
            true => None,
            false => Some(staging.folder("logs")?),
        },
    };
    let meter = ProgressReporter::new(args.quiet);
    let demo = supple_experiment::demo(&arm, &options, &|progress| meter.show(progress));
    meter.finish();
    let demo = demo?;

    write(&staging, &demo, &arm, &json(&demo.summary)?, !args.no_logs)?;
    staging.publish()?;
    Ok(demo.summary)
}

/// Writes figures, report and summary of a demo.
fn write(
    staging: &Staging,
    demo: &Demo,
    arm: &Description,
    summary: &str,
    logs: bool,
) -> Result<(), Failure> {
    let drawn = figures::all(demo)?;
    staging.folder("figures")?;
    for figure in &drawn {
        staging.write(
            &format!("figures/{}.svg", figure.name),
            figure.svg.as_bytes(),
        )?;
        staging.write(&format!("figures/{}.png", figure.name), &figure.png()?)?;
    }
    let report = report::html(demo, arm, &drawn, logs)?;
    staging.write("report.html", report.as_bytes())?;
    staging.write("summary.json", format!("{summary}\n").as_bytes())
}
