//! `supple demo`: runs the experiments and writes figures, report, summary and logs.

use crate::console::{json, print_line, print_status};
use crate::exit::Failure;
use crate::out::Staging;
use crate::progress::ProgressReporter;
use crate::{arms, figures, report, table};
use std::path::PathBuf;
use supple_experiment::{Demo, DemoOptions};
use supple_model::Description;

/// Arguments of `demo`.
#[derive(Clone, Debug, clap::Args)]
pub struct DemoArgs {
    /// A built-in arm (see `supple arms`), or the path of an arm's TOML or of its folder.
    #[arg(long, value_name = "NAME|PATH", default_value = "wam4")]
    pub arm: String,
    /// Reject a URDF with elements or attributes that supple does not read, instead of only warning.
    #[arg(long)]
    pub strict: bool,
    /// The controller's model of the arm, for example the output of `supple identify`: path of its TOML or folder.
    /// Default: the plant's own parameters, with the perturbations that each experiment defines.
    #[arg(long, value_name = "PATH")]
    pub model: Option<PathBuf>,
    /// Folder for all results. Files in it of the same names are replaced, others are left alone.
    #[arg(long, value_name = "DIR", default_value = "out/demo")]
    pub out: PathBuf,
    /// Seed of the perturbed models and of all noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Print the summary as JSON instead of a table; an error is then an object on standard output too.
    #[arg(long)]
    pub json: bool,
    /// Print results only, no progress.
    #[arg(long)]
    pub quiet: bool,
    /// Write no logs; all of them take about half a gigabyte.
    #[arg(long)]
    pub no_logs: bool,
}

/// Runs `supple demo`.
///
/// # Errors
/// [`Failure`]; [`Failure::Fault`] after all results are written.
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
    let meter = ProgressReporter::new(args.quiet);
    let demo = supple_experiment::demo(&arm, &options, &|progress| meter.show(progress));
    meter.finish();
    let demo = demo?;

    let summary = json(&demo.summary)?;
    write(&staging, &demo, &arm, &summary, !args.no_logs)?;
    staging.publish()?;

    if args.json {
        print_line(&summary)?;
    } else {
        print_line(&format!("{}\n", table::table(&demo.summary)))?;
    }
    let report = args.out.join("report.html");
    if !args.quiet {
        print_status(&format!("report: {}", report.display()));
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
