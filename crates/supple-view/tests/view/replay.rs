//! Tests of the page of a log: its snapshots cover the whole log, including peaks.

use crate::client::get_url;
use crate::controller::N;
use serde_json::Value;
use std::sync::mpsc::channel;
use std::time::Duration;
use supple_core::controller::{CycleRecord, Mode};
use supple_log::{Extras, RunInfo, Writer};
use supple_model::Description;
use supple_realtime::Stop;
use supple_view::{Options, Source};

/// Number of cycles of the log, at 1 kHz.
const CYCLES: u64 = 3000;
/// Only cycle in which a force acts.
const IMPACT: u64 = 1234;

#[test]
fn a_log_is_shown_with_its_peaks() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("run.mcap");
    let description = Description::asset("wam4").expect("a built-in arm");
    let config = description.config::<N>().expect("four joints");
    let run = RunInfo {
        experiment: "a test".to_owned(),
        ..RunInfo::default()
    };
    let mut writer = Writer::create(&file, &description, &config, &run).expect("a log");
    for step in 0..CYCLES {
        let mut record = CycleRecord::<N>::unpack(&[0; CycleRecord::<N>::words(N)], N);
        record.step = step;
        record.cycle = step;
        record.mode = Mode::Track as u8;
        if step == IMPACT {
            record.external_force_n = [0.0, 0.0, 40.0];
        }
        let written = writer.write_record(1_000_000 * step, &record, &Extras::default());
        written.expect("written");
    }
    writer.finish().expect("whole");

    let (stop, (sender, receiver)) = (Stop::default(), channel());
    let stopped = stop.clone();
    let view = std::thread::spawn(move || {
        let announce = |addresses: &supple_view::Addresses| {
            sender.send(addresses.clone()).expect("a test");
        };
        supple_view::run(&Source::Log(file), &Options::default(), &stopped, announce)
    });
    let addresses = receiver
        .recv_timeout(Duration::from_secs(60))
        .expect("an address");
    let json = |name: &str| -> Value {
        let (status, body) = get_url(&format!("{}{name}", addresses.url));
        assert_eq!(status, 200, "{name}");
        serde_json::from_str(&body).expect("JSON")
    };
    assert_eq!(json("info.json")["log"]["experiment"], "a test");
    let snapshots = json("log.json");
    let snapshots = snapshots.as_array().expect("snapshots");
    let time = |snapshot: &Value| snapshot["time_s"].as_f64().expect("a time");
    assert!(time(&snapshots[0]) < 1e-9);
    assert!((time(&snapshots[snapshots.len() - 1]) - 2.999).abs() < 1e-6);
    let gap = snapshots
        .windows(2)
        .map(|pair| time(&pair[1]) - time(&pair[0]));
    assert!(gap.fold(0.0, f64::max) < 0.0201);
    let hit: Vec<_> = snapshots
        .iter()
        .filter(|f| f["force_n"][2] == 40.0)
        .collect();
    assert_eq!(hit.len(), 1, "the impact is in one snapshot");
    let impact_s = 1e-3 * IMPACT as f64;
    assert!((0.0..0.0201).contains(&(time(hit[0]) - impact_s)));
    stop.request_shutdown();
    view.join().expect("no panic").expect("served");
}
