//! The program's answers to arguments that it cannot use.

use std::process::{Command, Output};

fn run(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_supple-ros"));
    command
        .args([
            "--prefix",
            "ros_command_line",
            "--connect",
            "tcp/127.0.0.1:9",
        ])
        .args(arguments)
        .env_remove("ROS_DOMAIN_ID");
    command.output().expect("a program")
}

#[test]
fn what_it_cannot_use_is_named_with_the_remedy() {
    let cases = [
        (
            &["--connect", "nowhere"][..],
            "endpoints have the form tcp/127.0.0.1:7447",
        ),
        (
            &["--listen", "tcp/127.0.0.1:99999"],
            "endpoints have the form",
        ),
        (&["--namespace", "left"], "a name such as `/left`"),
        (&["--domain-id", "233"], "0..=232"),
        (&["--rate-hz", "0"], "from 1 to 1000"),
        (
            &["--arm", "nosuch"],
            "neither a built-in arm nor an existing file",
        ),
    ];
    for (arguments, expected) in cases {
        let output = run(arguments);
        let message = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{arguments:?}");
        assert!(message.contains(expected), "{arguments:?}: {message}");
    }
}
