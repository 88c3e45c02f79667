//! Tests of the freestanding program: it links without std, allocator and C library, computes bit-identical results to a hosted
//! build, and fails to link if any code allocates memory.

use std::env;
use std::path::PathBuf;
use std::process::{Command, Output};

/// Separate from the target folder of the outer build, which may hold the lock of that folder.
const TARGET_DIR: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/bare");
const CORTEX_M: &str = "thumbv7em-none-eabihf";
/// Builds the core library from source; a stable compiler needs RUSTC_BOOTSTRAP for this.
const BUILD_CORE: &str = "-Zbuild-std=core";

/// Builds the program with `features`; `arguments` are passed to cargo.
fn build(features: &str, arguments: &[&str]) -> Output {
    let mut cargo = Command::new(env!("CARGO"));
    if arguments.contains(&BUILD_CORE) {
        cargo.env("RUSTC_BOOTSTRAP", "1");
    }
    cargo
        .args(["build", "--locked", "--package", "supple-bare"])
        .args(["--profile", "bare", "--features", features])
        .args(["--target-dir", TARGET_DIR])
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .env("CARGO_TERM_COLOR", "never")
        .output()
        .expect("cargo starts")
}

/// Builds the program; returns its path in cargo's folder for `target` (empty: the host).
fn program(target: &str, arguments: &[&str]) -> PathBuf {
    let built = build("freestanding", arguments);
    assert!(built.status.success(), "{}", text(&built.stderr));
    PathBuf::from(TARGET_DIR)
        .join(target)
        .join("bare")
        .join("supple-bare")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn hosted() -> String {
    let mut report = String::new();
    supple_bare::report(&mut report).expect("the arms are physically consistent");
    for wrong in ["NaN", "inf"] {
        assert!(!report.contains(wrong), "{report}");
    }
    let followed = report.matches("mode track, fault none").count();
    assert_eq!(followed, 2, "{report}");
    report
}

#[test]
#[cfg_attr(
    not(all(target_arch = "x86_64", target_os = "linux")),
    ignore = "the freestanding program is written for Linux on x86-64"
)]
fn prints_the_same_bits_as_a_hosted_build() {
    let output = Command::new(program("", &[])).output().expect("it starts");
    assert!(output.status.success(), "{output:?}");
    assert_eq!(text(&output.stdout), hosted());
}

#[test]
#[cfg_attr(
    not(all(target_arch = "x86_64", target_os = "linux")),
    ignore = "the freestanding program is written for Linux on x86-64"
)]
fn needs_no_loader_and_no_shared_library() {
    const DYNAMIC: u32 = 2;
    const INTERPRETER: u32 = 3;
    let elf = std::fs::read(program("", &[])).expect("the program is readable");
    assert_eq!(&elf[..5], b"\x7fELF\x02", "64-bit ELF");
    let number = |at: usize, bytes: usize| {
        let bytes = elf[at..at + bytes].iter().rev();
        bytes.fold(0, |n, byte| n << 8 | usize::from(*byte))
    };
    let (start, size, count) = (number(32, 8), number(54, 2), number(56, 2));
    let kinds: Vec<u32> = (0..count)
        .map(|i| number(start + i * size, 4) as u32)
        .collect();
    assert!(!kinds.is_empty());
    assert!(
        !kinds.contains(&DYNAMIC) && !kinds.contains(&INTERPRETER),
        "program headers {kinds:?}"
    );
}

#[test]
#[cfg_attr(
    not(all(target_arch = "x86_64", target_os = "linux")),
    ignore = "the freestanding program is written for Linux on x86-64"
)]
fn one_allocation_makes_the_build_fail() {
    let built = build("freestanding,negative-control", &[]);
    assert!(
        !built.status.success(),
        "the build succeeded in spite of an allocation"
    );
    let stderr = text(&built.stderr);
    let errors: Vec<&str> = stderr.lines().filter(|l| l.starts_with("error")).collect();
    assert!(
        matches!(errors[..], [first, last]
            if first.contains("no global memory allocator found")
                && last.contains("could not compile `supple-bare` (bin")),
        "the build failed for another reason:\n{stderr}"
    );
}

/// With `SUPPLE_BUILD_STD` set, the core library is built from source, for machines on which the prebuilt one cannot
/// be installed.
#[test]
#[ignore = "needs the thumbv7em-none-eabihf target and QEMU: ./ci.sh cortex-m"]
fn prints_the_same_bits_on_a_cortex_m4() {
    let mut arguments = vec!["--target", CORTEX_M];
    if env::var_os("SUPPLE_BUILD_STD").is_some() {
        arguments.push(BUILD_CORE);
    }
    let output = Command::new("qemu-system-arm")
        .args(["-machine", "mps2-an386", "-cpu", "cortex-m4"])
        .args(["-display", "none", "-monitor", "none", "-serial", "none"])
        .args(["-chardev", "stdio,id=console", "-semihosting-config"])
        .arg("enable=on,target=native,chardev=console")
        .arg("-kernel")
        .arg(program(CORTEX_M, &arguments))
        .output()
        .expect("qemu-system-arm starts");
    assert!(output.status.success(), "{output:?}");
    assert_eq!(text(&output.stdout), hosted());
}
