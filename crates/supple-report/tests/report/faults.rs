//! Tests of a demo whose runs end with a fault: all results are written, and every fault is reported.

use crate::support::{arg, assert_one_clear_line, run};
use std::fs;
use supple_model::Description;

/// An arm name that must be escaped in HTML.
const NAME: &str = "timid <b>&";

/// Creates the 4-joint arm with a limit that the first millimetres of error exceed: all runs end before contact.
fn timid_arm(folder: &std::path::Path) -> std::path::PathBuf {
    let arm = Description::asset("wam4").expect("built in");
    let mut names = 0;
    let toml: String = arm
        .toml()
        .lines()
        .map(|line| match line.split_once('=') {
            Some((key, _)) if key.trim() == "name" && !line.starts_with(' ') => {
                names += 1;
                match names {
                    1 => format!("name = \"{NAME}\"\n"),
                    _ => format!("{line}\n"),
                }
            }
            Some((key, _)) if key.trim() == "tracking_error_m" => {
                "tracking_error_m = 0.002\n".into()
            }
            Some((key, _)) if key.trim() == "start_error_m" => "start_error_m = 0.002\n".into(),
            _ => format!("{line}\n"),
        })
        .collect();
    assert!(toml.contains("tracking_error_m = 0.002"));
    fs::write(folder.join("arm.toml"), toml).expect("written");
    fs::write(folder.join("arm.urdf"), arm.urdf()).expect("written");
    folder.to_owned()
}

#[test]
fn a_demo_with_runs_that_a_fault_ended_exits_with_code_5_and_all_results() {
    let folder = tempfile::tempdir().expect("a folder");
    let arm = timid_arm(folder.path());
    let out = folder.path().join("out");
    let answer = run(&[
        "demo",
        "--json",
        "--quiet",
        "--no-logs",
        "--realistic-seeds",
        "1",
        "--arm",
        arg(&arm),
        "--out",
        arg(&out),
    ]);
    assert_eq!(answer.code, Some(5), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["fault", "from its reference", arg(&out)]);

    let summary = fs::read_to_string(out.join("summary.json")).expect("the summary");
    assert_eq!(answer.stdout, summary, "the results, not an error object");
    let report = fs::read_to_string(out.join("report.html")).expect("the report");
    assert!(report.contains("Runs that a fault ended"));
    assert!(!report.contains(NAME) && report.contains("timid &#60;b&#62;&#38;"));
    assert!(report.contains("probing at 5 N/m, identified model"));
    for name in [
        "figure_3a",
        "figure_3b",
        "figure_4",
        "figure_5",
        "figure_6",
        "trade_off",
    ] {
        let svg = fs::read_to_string(out.join(format!("figures/{name}.svg"))).expect(name);
        assert!(roxmltree::Document::parse(&svg).is_ok(), "{name}");
        for gone in ["NaN", "inf", "2147483647"] {
            assert!(!svg.contains(gone), "{gone} in {name}");
        }
    }
}
