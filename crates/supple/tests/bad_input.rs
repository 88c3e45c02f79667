//! Wrong descriptions, experiments that an arm cannot do, folders that cannot be written, a full disk:
//! a clear line, a documented code, and nothing left behind.

mod support;

use std::fs;
use std::path::{Path, PathBuf};
use supple_model::Description;
use support::{Answer, arg, assert_one_clear_line, run, supple, tree};

/// The 4-joint arm in a folder of its own, both files changed.
fn arm_in(
    folder: &Path,
    toml: impl Fn(String) -> String,
    urdf: impl Fn(String) -> String,
) -> PathBuf {
    let arm = Description::asset("wam4").expect("built in");
    let place = folder.join("arm");
    fs::create_dir(&place).expect("a folder");
    fs::write(place.join("arm.toml"), toml(arm.toml().to_owned())).expect("written");
    fs::write(place.join("arm.urdf"), urdf(arm.urdf().to_owned())).expect("written");
    place
}

fn demo_of(arm: &Path, out: &Path) -> Answer {
    run(&[
        "demo",
        "--quiet",
        "--no-logs",
        "--arm",
        arg(arm),
        "--out",
        arg(out),
    ])
}

/// Replaces what is there at least once.
fn replaced(text: String, from: &str, to: &str) -> String {
    assert!(text.contains(from), "{from} is in the file");
    text.replacen(from, to, 1)
}

fn same(text: String) -> String {
    text
}

#[test]
fn a_number_that_is_none_in_a_urdf_is_code_3() {
    let folder = tempfile::tempdir().expect("a folder");
    let mass = |urdf: String| {
        let at = urdf.find("<mass value=\"").expect("a mass") + "<mass value=\"".len();
        let end = at + urdf[at..].find('"').expect("its end");
        format!("{}NaN{}", &urdf[..at], &urdf[end..])
    };
    let arm = arm_in(folder.path(), same, mass);
    let out = folder.path().join("out");
    let answer = demo_of(&arm, &out);
    assert_eq!(answer.code, Some(3), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["arm.urdf", "mass", "NaN"]);
    assert!(!out.exists());
}

#[test]
fn a_wrong_number_of_joints_is_code_3() {
    let folder = tempfile::tempdir().expect("a folder");
    let one_more = |toml: String| replaced(toml, "home_rad = [0.0,", "home_rad = [0.0, 0.0,");
    let arm = arm_in(folder.path(), one_more, same);
    let out = folder.path().join("out");
    let answer = demo_of(&arm, &out);
    assert_eq!(answer.code, Some(3), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["arm.toml", "home_rad"]);
    assert!(!out.exists());
}

#[test]
fn a_file_that_is_not_there_is_code_3() {
    let answer = run(&["demo", "--arm", "no/such/arm.toml"]);
    assert_eq!(answer.code, Some(3));
    assert_one_clear_line(&answer, &["no/such/arm.toml"]);
}

#[test]
fn a_trajectory_out_of_reach_is_code_4() {
    let folder = tempfile::tempdir().expect("a folder");
    // The elbow's origin is the length of the upper arm: half of it is not enough.
    let shorter = |urdf: String| replaced(urdf, "0.55", "0.15");
    let arm = arm_in(folder.path(), same, shorter);
    let out = folder.path().join("out");
    let answer = demo_of(&arm, &out);
    assert_eq!(answer.code, Some(4), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["cannot reach"]);
    assert!(!out.exists());
}

#[test]
fn a_folder_that_cannot_be_written_is_code_6_before_anything_is_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "someone else's").expect("written");
    let beneath = file.join("out");
    for out in [beneath.as_path(), &file, Path::new("/proc/supple-out")] {
        let answer = run(&["demo", "--out", arg(out)]);
        assert_eq!(answer.code, Some(6), "{}: {}", out.display(), answer.stderr);
        assert_one_clear_line(&answer, &[arg(out), "--out"]);
        assert!(
            !answer.stderr.contains('%'),
            "no progress: {}",
            answer.stderr
        );
    }
    assert_eq!(
        fs::read_to_string(&file).expect("still there"),
        "someone else's"
    );
    assert_eq!(tree(folder.path()), [Path::new("file")]);
}

#[cfg(unix)]
#[test]
fn a_disk_that_fills_up_is_code_6_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    // A file may grow to 64 blocks: the first log does not fit.
    let script = "trap '' XFSZ; ulimit -f 64; exec \"$0\" \"$@\"";
    let output = std::process::Command::new("sh")
        .args([
            "-c",
            script,
            env!("CARGO_BIN_EXE_supple"),
            "demo",
            "--quiet",
        ])
        .args(["--out", arg(&out)])
        .output()
        .expect("it starts");
    let answer = Answer::from(output);
    assert_eq!(answer.code, Some(6), "{}", answer.stderr);
    assert_one_clear_line(&answer, &["File too large"]);
    assert!(tree(folder.path()).is_empty(), "{:?}", tree(folder.path()));
}

#[cfg(unix)]
#[test]
#[expect(clippy::disallowed_methods, reason = "another process is waited for")]
fn an_interrupt_is_code_130_and_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("out");
    let mut child = supple(&["demo", "--quiet", "--out", arg(&out)])
        .stderr(std::process::Stdio::null())
        .spawn()
        .expect("it starts");
    let pid = child.id().to_string();
    while tree(folder.path())
        .iter()
        .all(|path| !path.ends_with("logs"))
    {
        assert!(
            child.try_wait().expect("a child").is_none(),
            "it ended by itself"
        );
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    let sent = std::process::Command::new("kill")
        .args(["-INT", &pid])
        .status();
    assert!(sent.expect("kill is there").success());
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130));
    assert!(tree(folder.path()).is_empty(), "{:?}", tree(folder.path()));
}
