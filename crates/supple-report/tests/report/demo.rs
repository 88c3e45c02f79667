//! Runs the complete demo once into a folder with an older run and another file, and checks the contents of the
//! folder.

use crate::support::{Answer, arg, assert_one_clear_line, run, tree};
use resvg::tiny_skia::Pixmap;
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

const FIGURES: [&str; 9] = [
    "arc",
    "figure_3a",
    "figure_3b",
    "figure_4",
    "figure_5",
    "figure_6",
    "law_as_printed",
    "perturbed_models",
    "trade_off",
];

/// The log that the tests read; the other logs take half a gigabyte and are not kept.
const LOG: &str = "logs/sinusoid_law_as_printed.mcap";

struct DemoRun {
    out: PathBuf,
    answer: Answer,
    /// All files that were written.
    files: Vec<PathBuf>,
}

/// Returns the demo run; the first test that needs it runs the demo.
fn demo_run() -> &'static DemoRun {
    static RAN: OnceLock<DemoRun> = OnceLock::new();
    RAN.get_or_init(|| {
        let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("demo");
        let _ = fs::remove_dir_all(&out);
        fs::create_dir_all(out.join("figures")).expect("a folder");
        for old in ["report.html", "summary.json", "figures/figure_6.svg"] {
            fs::write(out.join(old), "old").expect("written");
        }
        fs::write(out.join("notes.txt"), "someone else's").expect("written");
        let answer = run(&[
            "demo",
            "--json",
            "--realistic-seeds",
            "2",
            "--out",
            arg(&out),
        ]);
        let files = tree(&out);
        let logs = files
            .iter()
            .filter(|file| file.extension().is_some_and(|e| e == "mcap"));
        for log in logs.filter(|log| log.as_path() != Path::new(LOG)) {
            fs::remove_file(out.join(log)).expect("removed");
        }
        DemoRun { out, answer, files }
    })
}

fn read(name: &str) -> String {
    fs::read_to_string(demo_run().out.join(name)).expect(name)
}

fn summary() -> Value {
    serde_json::from_str(&read("summary.json")).expect("JSON")
}

#[test]
fn the_demo_succeeds_and_prints_the_summary_and_the_path_of_the_report() {
    let DemoRun { out, answer, .. } = demo_run();
    assert_eq!(answer.code, Some(0), "{}", answer.stderr);
    assert_eq!(answer.stdout, read("summary.json"));
    let report = out.join("report.html");
    assert!(answer.stderr.contains(arg(&report)), "{}", answer.stderr);
    let progress_lines = answer.stderr.lines().filter(|line| line.contains('%'));
    assert!(
        (1..=10).contains(&progress_lines.count()),
        "a few progress lines: {}",
        answer.stderr
    );
}

#[test]
fn all_results_are_complete() {
    let files = &demo_run().files;
    let has = |name: &str| files.iter().any(|file| file == Path::new(name));
    for name in [
        "report.html",
        "summary.json",
        "logs/arc.mcap",
        "logs/probing_5_n_per_m.mcap",
    ] {
        assert!(has(name), "{name}");
    }
    for figure in FIGURES {
        for ending in ["svg", "png"] {
            assert!(
                has(&format!("figures/{figure}.{ending}")),
                "{figure}.{ending}"
            );
        }
    }
    let odd = files
        .iter()
        .find(|file| file.to_string_lossy().contains("part"));
    assert_eq!(odd, None);
}

#[test]
fn other_files_are_kept_and_the_older_run_is_replaced() {
    assert_eq!(read("notes.txt"), "someone else's");
    for replaced in ["report.html", "figures/figure_6.svg"] {
        assert!(read(replaced).len() > 1000, "{replaced}");
    }
}

#[test]
fn the_summary_has_every_promised_number() {
    let summary = summary();
    let numbers = [
        "sinusoid.rms_error_m",
        "sinusoid.max_error_m",
        "sinusoid_by_speed.0.speed",
        "sinusoid_by_speed.2.rms_error_m",
        "arc.rms_error_m",
        "torque_rms.shoulder_pitch.gravity",
        "torque_rms.shoulder_pitch.friction",
        "torque_rms.shoulder_pitch.inertial",
        "torque_rms.shoulder_pitch.feedback",
        "torque_rms.elbow.gravity",
        "torque_rms.elbow.friction",
        "torque_rms.elbow.inertial",
        "torque_rms.elbow.feedback",
        "quadrant.rms_error_m",
        "realistic.sinusoid_rms_m.1",
        "realistic.arc_rms_m.1",
        "realistic.warm_rms_m.1",
        "realistic.soft_rms_m.1",
        "realistic.false_latches",
        "probing.6.stiffness_n_per_m",
        "probing.6.approach_m_per_s",
        "probing.6.peak_filtered_n",
        "probing.6.contact_s",
        "probing.6.impulse_newton_s",
        "probing.6.impulse_first_50ms_newton_s",
        "probing.6.rest_force_n",
        "probing.6.free_rms_m",
        "probing.8.pressing_force_n",
        "probing.8.spring_force_n",
        "probing.8.impact_newton_s",
        "probing.8.impact_theory_newton_s",
        "probing.8.spring_impulse_newton_s",
        "probing_exact_model.1.pressing_force_n",
        "probing_rubber.1.peak_filtered_n",
        "probing_apparent_inertia.1.peak_filtered_n",
        "sinusoid_apparent_inertia.rms_error_m",
        "quadrant_damped.rms_error_m",
        "quadrant_corner_ramp.rms_error_m",
        "impulse_slopes.7.slope",
        "impulse_fit.slope",
        "impulse_fit.intercept",
        "impulse_fit.r2",
        "peak_spread",
        "peak_per_approach_speed_spread",
        "fade_off.impulse_fit.slope",
        "fade_off.impulse_fit.intercept",
        "fade_off.impulse_fit.r2",
        "fade_off.peak_spread",
        "fade_off.peak_per_approach_speed_spread",
        "sinusoid_exact_model.coulomb.rms_error_m",
        "sinusoid_exact_model.stribeck.rms_error_m",
        "law_as_printed.rms_error_m",
        "perturbed_rms_m.9",
    ];
    for name in numbers {
        let found = name
            .split('.')
            .fold(&summary, |value, key| match key.parse::<usize>() {
                Ok(index) => &value[index],
                Err(_) => &value[key],
            });
        assert!(
            found.as_f64().is_some_and(f64::is_finite),
            "{name} is {found}"
        );
    }
    let letter = &summary["law_as_printed"];
    assert_eq!(letter["ended_s"].is_number(), letter["fault"].is_string());
    let stiffnesses: Vec<_> = summary["probing"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|line| line["stiffness_n_per_m"].as_f64())
        .collect();
    assert_eq!(
        stiffnesses,
        [0.5, 1.0, 2.0, 5.0, 25.0, 50.0, 75.0, 100.0, 125.0]
    );
}

/// Asserts that the page loads no other file and runs no script.
fn assert_self_contained(page: &str) {
    for outside in [
        "<script", "<link", "<img", "<iframe", "<object", "<use", "url(", "@import", "src=",
        "href=",
    ] {
        assert!(!page.contains(outside), "{outside}");
    }
    let addresses = page.matches("://").count();
    let names = page.matches("xmlns=\"http://www.w3.org/2000/svg\"").count();
    assert_eq!(addresses, names, "no address except the SVG namespace");
}

#[test]
fn the_report_needs_no_other_file_and_no_network() {
    let report = read("report.html");
    assert_self_contained(&report);
    assert!(report.contains("prefers-color-scheme: dark") && report.contains("@media print"));
    assert_eq!(report.matches("<svg").count(), FIGURES.len());
    assert_eq!(report.matches("</svg>").count(), FIGURES.len());
}

#[test]
fn the_report_contains_the_measured_values_and_their_source() {
    let (report, summary) = (read("report.html"), summary());
    let mm = |value: &Value| format!("{:.1} mm", 1e3 * value.as_f64().expect("a number"));
    for error in ["sinusoid", "arc", "quadrant", "quadrant_perturbed"] {
        let error = mm(&summary[error]["rms_error_m"]);
        assert!(report.contains(&error), "{error}");
    }
    for line in summary["probing"].as_array().expect("a list") {
        let impulse = line["impulse_newton_s"].as_f64().expect("a number");
        assert!(
            report.contains(&format!("<td>{impulse:.3}</td>")),
            "{impulse}"
        );
    }
    for part in [
        "simulation",
        "wam4",
        "0.1",
        "3.00 %",
        "1.4 \u{d7} 10\u{2078}",
        "figure 3a",
    ] {
        assert!(report.contains(part), "{part}");
    }
}

#[test]
fn every_figure_is_complete_as_svg_and_png() {
    for figure in FIGURES {
        let svg = read(&format!("figures/{figure}.svg"));
        let document = roxmltree::Document::parse(&svg).expect(figure);
        let root = document.root_element();
        assert_eq!(root.attribute("role"), Some("img"), "{figure}");
        let units = document
            .descendants()
            .filter_map(|node| node.text())
            .filter(|text| text.contains('[') && text.contains(']'));
        assert!(units.count() >= 1, "{figure} has axes with units");
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{figure}");

        let size = |name| root.attribute(name).and_then(|v| v.parse::<u32>().ok());
        let png = fs::read(demo_run().out.join(format!("figures/{figure}.png"))).expect(figure);
        let bitmap = Pixmap::decode_png(&png).expect(figure);
        assert_eq!(
            Some(bitmap.width()),
            size("width").map(|w| 2 * w),
            "{figure}"
        );
        assert_eq!(
            Some(bitmap.height()),
            size("height").map(|h| 2 * h),
            "{figure}"
        );
        let ink = |red: u8, green: u8, blue: u8| {
            let found = bitmap.pixels().iter();
            found
                .filter(|p| (p.red(), p.green(), p.blue()) == (red, green, blue))
                .count()
        };
        assert!(ink(0x1F, 0x24, 0x30) > 500, "{figure} has axes and text");
        assert!(ink(0x00, 0x72, 0xB2) > 200, "{figure} has a blue series");
    }
}

#[test]
fn a_log_is_inspected_and_exported() {
    let log = demo_run().out.join(LOG);
    let info = run(&["log", "info", arg(&log)]);
    assert_eq!(info.code, Some(0), "{}", info.stderr);
    assert!(info.stdout.contains("wam4") && info.stdout.contains("/joint_states"));
    let json = run(&["log", "info", "--json", arg(&log)]);
    let json: Value = serde_json::from_str(&json.stdout).expect("JSON");
    assert_eq!(json["incomplete"], Value::Null);
    let channels = json["channels"].as_array().expect("a list");
    let states = channels.iter().find(|c| c["topic"] == "/joint_states");
    let states = states
        .and_then(|c| c["messages"].as_u64())
        .expect("joint states");

    let table = run(&[
        "log",
        "export",
        arg(&log),
        "--channel",
        "/joint_states",
        "--every",
        "10",
    ]);
    assert_eq!(table.code, Some(0), "{}", table.stderr);
    assert_eq!(table.stdout.lines().count() as u64, 1 + states.div_ceil(10));

    let folder = tempfile::tempdir().expect("a folder");
    let csv = folder.path().join("states.csv");
    let args = [
        "--channel",
        "/joint_states",
        "--every",
        "10",
        "--out",
        arg(&csv),
    ];
    let written = run(&[&["log", "export", arg(&log)][..], &args].concat());
    assert_eq!(written.code, Some(0), "{}", written.stderr);
    assert_eq!(fs::read_to_string(&csv).expect("the table"), table.stdout);
    assert_eq!(tree(folder.path()), [Path::new("states.csv")]);

    let unknown = run(&["log", "export", arg(&log), "--channel", "/no_such"]);
    assert_eq!(unknown.code, Some(6));
    assert_one_clear_line(&unknown, &["/no_such", "/joint_states"]);
}

#[test]
fn a_replayed_log_is_bit_identical() {
    let log = demo_run().out.join(LOG);
    let replay = run(&["log", "replay", arg(&log), "--json"]);
    assert_eq!(replay.code, Some(0), "{}", replay.stderr);
    let replay: Value = serde_json::from_str(&replay.stdout).expect("JSON");
    assert!(replay["steps"].as_u64().expect("steps") > 1_000);
    assert_eq!(replay["different_steps"], 0);
    assert!(replay["first_difference"].is_null());
}

#[test]
fn a_truncated_log_gives_no_table_and_is_recovered() {
    let folder = tempfile::tempdir().expect("a folder");
    let log = fs::read(demo_run().out.join(LOG)).expect("the log");
    let cut = folder.path().join("run.mcap.part");
    fs::write(&cut, &log[..log.len() / 2]).expect("written");

    let csv = folder.path().join("states.csv");
    let table = run(&["log", "export", arg(&cut), "--out", arg(&csv)]);
    assert_eq!(table.code, Some(6));
    assert_one_clear_line(&table, &["incomplete", "supple log recover"]);
    assert_eq!(
        tree(folder.path()),
        [Path::new("run.mcap.part")],
        "no partial table"
    );

    let recovered = run(&["log", "recover", arg(&cut)]);
    assert_eq!(recovered.code, Some(0), "{}", recovered.stderr);
    let whole = folder.path().join("run.recovered.mcap");
    let info = run(&["log", "info", "--json", arg(&whole)]);
    let info: Value = serde_json::from_str(&info.stdout).expect("JSON");
    assert_eq!(info["incomplete"], Value::Null);
    assert!(info["steps"].as_u64().is_some_and(|steps| steps > 1000));

    let again = run(&["log", "recover", arg(&cut)]);
    assert_eq!(again.code, Some(6));
    assert_one_clear_line(&again, &["run.recovered.mcap", "--force"]);
    assert_eq!(run(&["log", "recover", arg(&cut), "--force"]).code, Some(0));

    let noise = folder.path().join("noise.mcap");
    fs::write(&noise, vec![7_u8; 5000]).expect("written");
    let none = run(&["log", "recover", arg(&noise)]);
    assert_eq!(none.code, Some(6));
    assert_one_clear_line(&none, &["noise.mcap"]);
}
