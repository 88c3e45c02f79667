//! Tests with inputs that are made to exhaust a parser: each is refused within one second of processor time. The Linux
//! kernel measures this time (`ulimit -t`) and kills a program that exceeds it, so that the load of the machine does not matter.

use crate::support::{Answer, PROGRAM, arg, assert_one_clear_line};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// Processor time that a refusal may take \[s\].
const LIMIT_S: u32 = 1;

/// Exit codes of a wrong command line, an invalid arm, an unreadable file.
const INVALID_ARM: [i32; 3] = [2, 3, 6];
/// Exit codes of a log: these, and those of an experiment, a fault or a replay.
const INVALID_MCAP: [i32; 6] = [2, 3, 4, 5, 6, 7];
/// Exit codes of an unreadable file, and of a log without a model.
const INVALID_CSV: [i32; 2] = [6, 9];

/// Checks that the program ends with one of these exit codes and one error line.
fn refused(folder: &Path, args: &[&str], allowed_exit_codes: &[i32]) {
    let script = format!("ulimit -t {LIMIT_S}; exec \"$0\" \"$@\"");
    let output = Command::new("sh")
        .args(["-c", &script, PROGRAM])
        .args(args)
        .current_dir(folder)
        .output()
        .expect("a shell");
    let answer = Answer::from(output);
    // A program that a signal ended, because of the limit or of a crash, has no exit code.
    let code = answer.code.unwrap_or_else(|| {
        panic!("{args:?}: ended by a signal: more than {LIMIT_S} s, or a crash")
    });
    assert!(
        allowed_exit_codes.contains(&code),
        "{args:?}: {code}: {}",
        answer.stderr
    );
    assert_one_clear_line(&answer, &[]);
}

/// Returns a URDF with a chain of links that fixed joints connect.
fn chain(links: usize) -> String {
    let mut urdf = "<robot name=\"chain\"><link name=\"l0\"/>".to_owned();
    for link in 1..links {
        let _ = write!(
            urdf,
            "<link name=\"l{link}\"/><joint name=\"j{link}\" type=\"fixed\"><parent link=\"l{}\"/><child \
             link=\"l{link}\"/></joint>",
            link - 1
        );
    }
    urdf + "</robot>"
}

#[test]
fn each_hostile_description_is_refused_within_a_second_of_processor_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let nested = |open: &str, close: &str, depth: usize| {
        format!(
            "<robot name=\"r\">{}{}</robot>",
            open.repeat(depth),
            close.repeat(depth)
        )
    };
    for (name, text) in [
        ("links.urdf", chain(20_000)),
        ("deep.urdf", nested("<link>", "</link>", 100_000)),
        ("open.urdf", "<robot>".repeat(200_000)),
        (
            "name.urdf",
            format!("<robot name=\"{}\"/>", "r".repeat(4_000_000)),
        ),
        (
            "entities.urdf",
            format!("<robot name=\"r\">{}</robot>", "&amp;".repeat(500_000)),
        ),
        ("empty.urdf", String::new()),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
        refused(
            folder.path(),
            &["demo", "--urdf", name, "--out", "out"],
            &INVALID_ARM,
        );
    }
    for (name, text) in [
        ("deep.toml", format!("a = {}", "[".repeat(100_000))),
        ("tables.toml", "[a]\n".repeat(100_000)),
        ("keys.toml", format!("{}a = 1", "a.".repeat(100_000))),
        ("text.toml", format!("a = \"{}", "x".repeat(4_000_000))),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
        let path = format!("./{name}");
        refused(
            folder.path(),
            &["demo", "--arm", &path, "--out", "out"],
            &INVALID_ARM,
        );
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
fn each_hostile_log_is_refused_within_a_second_of_processor_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let magic = b"\x89MCAP0\r\n";
    // A file with one record: its type, the length that the file states, and its body, which is shorter.
    let record = |kind: u8, length: u64, body: &[u8]| {
        let mut log = magic.to_vec();
        log.push(kind);
        log.extend(length.to_le_bytes());
        log.extend(body);
        log
    };
    for (name, bytes) in [
        ("endless.mcap", record(1, u64::MAX, &[0; 64])),
        ("huge_chunk.mcap", record(6, 1 << 62, &[0xFF; 4096])),
        ("zeros.mcap", [&magic[..], &vec![0; 8_000_000]].concat()),
        (
            "repeated_0f.mcap",
            [&magic[..], &[0x0F; 4_000_000]].concat(),
        ),
    ] {
        std::fs::write(folder.path().join(name), bytes).expect("written");
        for command in [&["log", "info"][..], &["log", "replay"], &["log", "export"]] {
            let out = ["--out", "out.csv"];
            let args = match command {
                ["log", "export"] => [command, &[name], &out].concat(),
                _ => [command, &[name]].concat(),
            };
            refused(folder.path(), &args, &INVALID_MCAP);
        }
    }
    for (name, text) in [
        ("line.csv", "1,".repeat(2_000_000)),
        ("columns.csv", format!("{}\n", "time_s,".repeat(500_000))),
        ("rows.csv", format!("a\n{}", "\n".repeat(4_000_000))),
    ] {
        std::fs::write(folder.path().join(name), text).expect("written");
        let file = folder.path().join(name);
        let args = ["identify", "--arm", "wam4", arg(&file), "--out", "out"];
        refused(folder.path(), &args, &INVALID_CSV);
    }
    assert!(!folder.path().join("out").exists());
}
