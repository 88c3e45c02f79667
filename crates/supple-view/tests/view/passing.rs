//! Tests that an unanswered command delays neither idle nor the emergency stop of the same page.

use crate::client::Client;
use crate::controller::System;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::os::unix::net::UnixListener;
use supple_bus::Address;
use supple_ipc::Domain;
use supple_view::Options;

/// A pendant that answers only a press of the emergency stop; dropping this value removes it and its folder.
struct Pendant(std::path::PathBuf);

impl Pendant {
    fn new(domain: &Domain) -> Pendant {
        let address = Address::of_system(domain.prefix()).expect("a folder");
        let Address::Folder(folder) = address else {
            panic!("the address of the bus is a folder");
        };
        std::fs::create_dir(&folder).expect("a folder");
        let listener = UnixListener::bind(folder.join("pendant")).expect("a socket");
        std::thread::spawn(move || {
            let mut silent = Vec::new();
            for stream in listener.incoming() {
                let mut stream = stream.expect("a press");
                let mut line = String::new();
                let read = BufReader::new(&stream).read_line(&mut line);
                read.expect("a press");
                match line.trim() {
                    "e-stop" => writeln!(stream, r#"{{"pressed":"e-stop"}}"#).expect("answered"),
                    _ => silent.push(stream),
                }
            }
        });
        Pendant(folder)
    }
}

impl Drop for Pendant {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn urgent_call_is_answered(options: &Options, first: &[Value], urgent: &Value, mode: &str) {
    let (system, addresses) = System::start(options.clone());
    let _pendant = Pendant::new(system.domain());
    let mut client = Client::connect(&addresses.foxglove_url, "").expect("accepted");
    client.wait_for_op(&mut || system.step(), "advertiseServices");
    // The page has received telemetry, so that its commands reach the controller.
    for _ in 0..200 {
        system.step();
    }
    system.mute.set(true);
    for command in first {
        client.begin_call(1, command);
    }
    client.begin_call(2, urgent);
    let (call, answer) = client.wait_for_answer(&mut || system.step());
    assert_eq!(call, 2, "{urgent} waited behind {first:?}: {answer:?}");
    assert_eq!(answer, Ok(json!({"accepted": true, "mode": mode})));
    // The other commands are answered too, with the error that the controller or the pendant does not answer.
    for _ in first {
        let (call, answer) = client.wait_for_answer(&mut || system.step());
        assert_eq!(call, 1);
        assert!(answer.is_err_and(|reason| reason.contains("not answer")));
    }
}

fn pendant(button: &str) -> Value {
    json!({"request": "pendant", "button": button})
}

#[test]
fn idle_is_answered_while_other_commands_are_unanswered() {
    let first = [json!({"request": "reset"}), pendant("activate")];
    urgent_call_is_answered(
        &Options::default(),
        &first,
        &json!({"request": "idle"}),
        "idle",
    );
}

#[test]
fn the_emergency_stop_is_answered_while_other_commands_are_unanswered() {
    let first = [json!({"request": "hold_tip"}), pendant("release")];
    urgent_call_is_answered(&Options::default(), &first, &pendant("e-stop"), "pendant");
}
