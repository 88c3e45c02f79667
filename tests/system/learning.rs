//! Tests of learning in a complete system: it is switched, shown, logged and saved, and equal in every run in virtual time.

use crate::running::{Up, json, run, stderr_of, temporary_folder};
use std::path::Path;
use supple_core::controller::Request;
use supple_log::{Reader, replay};
use supple_model::Description;

fn learned_requests(log: &Path) -> Vec<(u64, Request<4>)> {
    let reader = Reader::open(log).expect("a log");
    let records = reader.records::<4>().expect("records");
    let requests = records.filter_map(|record| {
        let record = record.expect("readable").value;
        let request = record.input().expect("known").request?;
        let learned = matches!(
            request,
            Request::LearnedParameters(_) | Request::LearnedMap { .. }
        );
        (learned && record.refusal == 0).then_some((record.input_cycle, request))
    });
    requests.collect()
}

/// In virtual time, two runs learn the same terms in the same cycles, and a replay is bit-identical.
#[test]
fn runs_in_virtual_time_give_equal_logs_with_learning() {
    let folder = temporary_folder();
    let run_once = |name: &str| {
        let arguments = [
            "up",
            "--plant",
            "sim",
            "--virtual-time",
            "--for",
            "14",
            "--learn",
            "--json",
            "--log",
            name,
        ];
        let output = run(folder.path(), &arguments);
        assert!(output.status.success(), "{}", stderr_of(&output));
        folder.path().join(name)
    };
    let (first, second) = (run_once("a.mcap"), run_once("b.mcap"));
    let requests = learned_requests(&first);
    assert!(requests.len() >= 6, "{} requests", requests.len());
    assert_eq!(requests, learned_requests(&second));
    let again = replay(&first).expect("replayed");
    assert_eq!(again.different_steps, 0, "{again}");
    // Without --learn, no terms are learned.
    let output = run(
        folder.path(),
        &[
            "up",
            "--plant",
            "sim",
            "--virtual-time",
            "--for",
            "6",
            "--json",
            "--log",
            "c.mcap",
        ],
    );
    assert!(output.status.success(), "{}", stderr_of(&output));
    assert!(learned_requests(&folder.path().join("c.mcap")).is_empty());
}

#[test]
fn learning_is_switched_shown_saved_and_reset() {
    Up::while_tracking(&["--plant", "sim", "--no-log"], |up| {
        switch_show_save_and_reset(up);
    });
}

fn switch_show_save_and_reset(up: &Up) {
    let status = json(&up.run(&["status", "--json"]));
    assert_eq!(status["learning"]["on"], false);
    assert_eq!(status["learning"]["frozen"], "off");
    assert_eq!(status["learning"]["payload_kg"], 0.0);

    let early = up.run(&["learning", "save", "early"]);
    assert_eq!(early.status.code(), Some(11), "{}", stderr_of(&early));
    assert!(stderr_of(&early).contains("nothing is learned yet"));
    assert!(!up.folder.path().join("early").exists());

    let on = up.run(&["learning", "on", "--json"]);
    assert_eq!(json(&on)["accepted"], true, "{}", stderr_of(&on));
    let learned = |status: &serde_json::Value| {
        let torque = status["learning"]["torque_nm"].as_array().expect("a list");
        torque.iter().any(|nm| nm.as_f64() != Some(0.0))
    };
    let status = up.wait_until("something learned", learned);
    assert_eq!(status["learning"]["on"], true);
    let text = up.run(&["status"]);
    let text = String::from_utf8_lossy(&text.stdout).into_owned();
    assert!(text.contains("learning  on"), "{text}");

    let off = up.run(&["learning", "off"]);
    assert!(off.status.success(), "{}", stderr_of(&off));
    let saved = up.run(&["learning", "save", "arm", "--json"]);
    assert!(saved.status.success(), "{}", stderr_of(&saved));
    let source = json(&saved)["source"]
        .as_str()
        .expect("a source")
        .to_owned();
    assert!(source.starts_with("learned while moving"), "{source}");
    let arm = Description::load(up.folder.path().join("arm")).expect("an arm");
    let learned = arm.config::<4>().expect("four joints").learned;
    assert_ne!(learned, supple_core::learned::LearnedTerms::zero());

    let reset = up.run(&["learning", "reset"]);
    assert!(reset.status.success(), "{}", stderr_of(&reset));
    up.wait_until("the description's model", |status| {
        status["learning"]["coulomb_nm"]
            .as_array()
            .is_some_and(|all| all.iter().all(|nm| nm.as_f64() == Some(0.0)))
    });
    let help = up.run(&["learning", "--help"]);
    let help = String::from_utf8_lossy(&help.stdout).into_owned();
    for word in ["on", "off", "reset", "save", "prediction error"] {
        assert!(help.contains(word), "{word}: {help}");
    }
}
