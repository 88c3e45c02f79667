//! Runs every target over its committed inputs and a seeded stream of their mutations, and checks that every target
//! has a cargo-fuzz program.

use std::path::{Path, PathBuf};
use supple_fuzz::arms;
use supple_fuzz::bytes::{value_of, with_file};
use supple_fuzz::mutate::{Random, mutated};
use supple_fuzz::{TARGETS, Target, seeds};
use supple_ipc::message::OperatorRequest;
use supple_log::{LogError, Reader};
use supple_model::Description;

/// Factor for the number of mutations, for a longer run.
const FACTOR: &str = "SUPPLE_FUZZ_FACTOR";

/// Output folder of `write_seeds`. Default: the committed corpus.
const WRITE: &str = "SUPPLE_FUZZ_WRITE";

fn committed(target: &Target) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = std::fs::read_dir(target.corpus()).expect("a folder of inputs");
    let mut files: Vec<PathBuf> = folder
        .map(|entry| entry.expect("an entry").path())
        .collect();
    files.sort();
    let read = |path: PathBuf| {
        let bytes = std::fs::read(&path).expect("readable");
        (path, bytes)
    };
    files.into_iter().map(read).collect()
}

/// Runs the target; reports and saves an input that makes it fail.
fn survives(target: &Target, input: &[u8], what: &dyn Fn() -> String) {
    let body = target.body;
    if let Err(panic) = std::panic::catch_unwind(|| body(input)) {
        let kept = std::env::temp_dir().join(format!("supple-fuzz-{}", target.name));
        let _ = std::fs::write(&kept, input);
        eprintln!(
            "target {} fails on {}; kept as {}",
            target.name,
            what(),
            kept.display()
        );
        std::panic::resume_unwind(panic);
    }
}

fn run(name: &str) {
    let target = TARGETS.iter().find(|target| target.name == name);
    let target = target.expect("a target");
    let mut inputs = vec![Vec::new()];
    for (path, bytes) in committed(target) {
        survives(target, &bytes, &|| path.display().to_string());
        inputs.push(bytes);
    }
    for (name, bytes) in seeds::of(target.name) {
        survives(target, &bytes, &|| format!("seed {name}"));
        inputs.push(bytes);
    }
    let factor = std::env::var(FACTOR)
        .ok()
        .and_then(|factor| factor.parse().ok());
    let mut random = Random::new(20_261_122);
    for k in 0..target.mutations.saturating_mul(factor.unwrap_or(1)) {
        let input = mutated(&mut random, &inputs);
        survives(target, &input, &|| format!("mutation {k}"));
    }
}

macro_rules! targets {
    ($($name:ident)*) => {
        $(
            #[test]
            fn $name() {
                run(stringify!($name));
            }
        )*

        #[test]
        fn every_target_has_a_test() {
            let run = [$(stringify!($name)),*];
            assert_eq!(run, TARGETS.map(|target| target.name));
        }
    };
}

targets! {
    inbound property position torque force_torque pendant values
    arm_state torque_command telemetry operator_request
    log log_schema urdf toml csv pendant_line arm_bus damiao_reply damiao_request
}

/// Writes the valid inputs of every target, one folder per target.
#[test]
#[ignore = "writes: see supple_fuzz::seeds"]
fn write_seeds() {
    let folder = std::env::var_os(WRITE).map(PathBuf::from);
    for target in TARGETS {
        let folder = match &folder {
            Some(folder) => folder.join(target.name),
            None => target.corpus(),
        };
        std::fs::create_dir_all(&folder).expect("a folder");
        for (name, bytes) in seeds::of(target.name) {
            std::fs::write(folder.join(format!("seed-{name}")), bytes).expect("room");
        }
    }
}

#[test]
fn every_target_has_valid_inputs_committed() {
    for target in TARGETS {
        let files = committed(&target);
        for (name, _) in seeds::of(target.name) {
            let name = format!("seed-{name}");
            let found = files.iter().any(|(path, _)| path.ends_with(&name));
            assert!(found, "{} lacks {name}: run write_seeds", target.name);
        }
        let most = files.iter().map(|(_, bytes)| bytes.len()).max();
        assert!(most.is_some_and(|most| most < 1 << 17), "{}", target.name);
    }
}

/// The targets must accept the seeds, because a fuzzer that starts from rejected inputs does not get past the validation.
#[test]
fn the_targets_accept_their_seeds() {
    for (name, bytes) in seeds::of("log_schema") {
        let table = supple_fuzz::logs::exported(&bytes);
        assert!(table.is_ok(), "{name}: {table:?}");
    }
    let described = Description::from_text(arms::TOML, arms::URDF);
    assert!(described.is_ok_and(|arm| arm.config::<3>().is_ok()));
    for (name, bytes) in seeds::of("operator_request") {
        let message: OperatorRequest = value_of(&bytes);
        assert!(matches!(message.request::<4>(), Ok(Some(_))), "{name}");
    }
    for (name, bytes) in seeds::of("log") {
        let opened = with_file("seed.mcap", &bytes, |path| {
            let reader = Reader::open(path)?;
            let whole = reader.records::<3>()?.flatten().count();
            Ok::<_, LogError>((reader.config::<3>().is_ok(), whole))
        });
        match opened {
            Ok(opened) => assert_eq!(opened, (true, 6), "{name}"),
            Err(error) => assert!(name == "cut" && matches!(error, LogError::Incomplete { .. })),
        }
    }
}

#[test]
fn every_target_has_a_cargo_fuzz_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("libfuzzer");
    let manifest = std::fs::read_to_string(folder.join("Cargo.toml")).expect("a manifest");
    for target in TARGETS {
        let name = target.name;
        assert!(manifest.contains(&format!("name = \"{name}\"\n")), "{name}");
        let program = folder.join(format!("fuzz_targets/{name}.rs"));
        let program = std::fs::read_to_string(&program).expect("a program");
        assert!(program.contains(&format!("::{name}(data)")), "{program}");
    }
    assert_eq!(manifest.matches("[[bin]]").count(), TARGETS.len());
}
