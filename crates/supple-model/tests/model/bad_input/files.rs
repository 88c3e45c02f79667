//! Special files and oversized files are rejected quickly.

use crate::common::{TOML, URDF, with};
use std::fs;
use std::path::Path;
use supple_model::{Description, IdentifiedModel};

fn assert_rejected(toml: &str, urdf: &str, words: &[&str]) {
    let message = Description::from_text(toml, urdf)
        .expect_err("accepted")
        .to_string();
    assert!(message.len() < 2000, "{} bytes", message.len());
    for word in words {
        assert!(message.contains(word), "no `{word}` in: {message}");
    }
}

/// The test arm with additional content in its URDF.
fn more(text: &str) -> String {
    with(URDF, "</robot>", &format!("{text}</robot>"))
}

#[test]
fn elements_nested_deeper_than_the_stack_are_rejected() {
    let deep = |element: &str, depth: usize| {
        let open = format!("<{element}>").repeat(depth);
        more(&(open + &format!("</{element}>").repeat(depth)))
    };
    for depth in [64, 100_000] {
        let text = deep("gazebo", depth);
        assert_rejected(
            TOML,
            &text,
            &[
                "small.urdf",
                "<gazebo>",
                "at most 64 levels deep",
                "without elements of other programs",
            ],
        );
    }
    Description::from_text(TOML, &deep("gazebo", 60)).expect("maximum allowed depth");
    let in_link = with(
        URDF,
        "<link name=\"base\"/>",
        &format!(
            "<link name=\"base\">{}{}</link>",
            "<visual>".repeat(100_000),
            "</visual>".repeat(100_000)
        ),
    );
    assert_rejected(
        TOML,
        &in_link,
        &["link `base` <visual>", "at most 64 levels deep"],
    );
}

#[test]
fn too_many_links_are_rejected() {
    let fixed = |count: usize| {
        let mut text = String::new();
        let mut parent = "base".to_owned();
        for i in 0..count {
            let link = format!("frame{i}");
            text += &format!(
                "<link name=\"{link}\"/><joint name=\"at{i}\" type=\"fixed\"><parent \
                 link=\"{parent}\"/><child link=\"{link}\"/></joint>"
            );
            parent = link;
        }
        more(&text)
    };
    assert_rejected(
        TOML,
        &fixed(20_000),
        &["small.urdf", "<robot>", "at most 1000 of <link>", "20007"],
    );
    let many = Description::from_text(TOML, &fixed(900)).expect("900 frames in a row");
    let few = Description::from_text(TOML, URDF).expect("valid");
    assert_eq!(many.parts::<3>().unwrap(), few.parts::<3>().unwrap());
}

#[test]
fn too_many_attributes_and_elements_are_rejected() {
    let attributes: String = (0..100_000).map(|i| format!(" a{i}=\"\"")).collect();
    assert_rejected(
        TOML,
        &more(&format!("<gazebo{attributes}/>")),
        &["<gazebo>", "at most 256 attributes", "100000"],
    );
    let elements = more(&"<gazebo/>".repeat(600_000));
    assert_rejected(TOML, &elements, &["<robot>", "at most 500000 elements"]);
    let visuals = format!("<link name=\"base\">{}</link>", "<visual/>".repeat(100_000));
    let visuals = with(URDF, "<link name=\"base\"/>", &visuals);
    Description::from_text(TOML, &visuals).expect("visuals without shape are ignored");
}

#[cfg(unix)]
#[test]
fn special_files_are_neither_read_nor_replaced() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().expect("a folder");
    let at = |name: &str| folder.path().join(name);
    let fifo = |path: &Path| {
        let made = std::process::Command::new("mkfifo").arg(path).status();
        assert!(made.expect("mkfifo is there").success());
    };
    fifo(&at("fifo.toml"));
    fs::write(at("arm.toml"), TOML).expect("written");
    fifo(&at("small.urdf"));
    fs::write(at("zero.toml"), with(TOML, "small.urdf", "/dev/zero")).expect("written");
    for (path, file, word) in [
        (at("fifo.toml"), "fifo.toml", "a FIFO"),
        (at("arm.toml"), "small.urdf", "a FIFO"),
        (at("zero.toml"), "/dev/zero", "a character device"),
        ("/dev/zero".into(), "/dev/zero", "a character device"),
    ] {
        let message = Description::load(path).expect_err("rejected").to_string();
        for word in [file, word, "cannot be read"] {
            assert!(message.contains(word), "no `{word}` in: {message}");
        }
    }
    let long = fs::File::create(at("long.toml")).expect("made");
    long.set_len(1 << 40).expect("a sparse file");
    let message = Description::load(at("long.toml")).expect_err("rejected");
    let message = message.to_string();
    assert!(message.contains("at most 16777216 are read"), "{message}");

    // A model neither replaces a special file nor is written partially.
    let out = at("out");
    fs::create_dir(&out).expect("made");
    fifo(&out.join("arm.toml"));
    let arm = Description::from_text(TOML, URDF).expect("valid");
    let message = arm.save(&out).expect_err("rejected").to_string();
    assert!(message.contains("a FIFO"), "{message}");
    assert!(!out.join("arm.urdf").exists(), "incomplete arm");
    let kind = fs::metadata(out.join("arm.toml"))
        .expect("there")
        .file_type();
    assert!(kind.is_fifo());
}

/// An identified model can also be written into a URDF with extensions of other programs.
#[test]
fn an_identified_model_keeps_extensions_of_other_programs() {
    let urdf = more("<gazebo reference=\"link1\"><mu1>0.2</mu1></gazebo>");
    let arm = Description::from_text(TOML, &urdf).expect("valid");
    let friction: [supple_core::Friction; 3] = arm.friction().try_into().expect("three");
    let replaced = arm
        .with_model(&IdentifiedModel {
            arm: &arm.arm::<3>().expect("three"),
            friction: &friction,
            ripple: None,
            source: "test",
        })
        .expect("valid");
    assert!(replaced.urdf().contains("<mu1>0.2</mu1>"));
    assert_eq!(replaced.warnings().len(), 1);
}
