//! `supple demo`: runs the experiments and leaves figures, report, summary and logs.

use crate::cli::DemoArgs;
use crate::console::{json, remark, say};
use crate::exit::Failure;
use crate::out::Staging;
use crate::progress::Meter;
use crate::{arms, figures, report, table};
use supple_experiment::{Demo, DemoOptions};
use supple_model::Description;

/// Runs it.
///
/// # Errors
/// [`Failure`]; [`Failure::Fault`] once everything is written.
pub fn run(args: &DemoArgs) -> Result<(), Failure> {
    let arm = arms::find(&args.arm, args.strict)?;
    let model = args
        .model
        .as_ref()
        .map(|path| arms::load(path, args.strict));
    let model = model.transpose()?;
    let staging = Staging::new(&args.out, &["report.html", "summary.json"])?;
    let options = DemoOptions {
        seed: args.seed,
        model,
        log_dir: match args.no_logs {
            true => None,
            false => Some(staging.folder("logs")?),
        },
    };
    let meter = Meter::new(args.quiet);
    let demo = supple_experiment::demo(&arm, &options, &|progress| meter.show(progress));
    meter.finish();
    let demo = demo?;

    let summary = json(&demo.summary)?;
    write(&staging, &demo, &arm, &summary, !args.no_logs)?;
    staging.publish()?;

    if args.json {
        say(&summary)?;
    } else {
        say(&format!("{}\n", table::table(&demo.summary)))?;
    }
    let report = args.out.join("report.html");
    if !args.quiet {
        remark(&format!("report: {}", report.display()));
    }
    let faults = report::fault_lines(&demo.summary);
    if faults.is_empty() {
        return Ok(());
    }
    Err(Failure::Fault {
        runs: faults.join("; "),
        out: args.out.clone(),
    })
}

/// Writes everything that is made from a demo.
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
