//! `supple new`: creates an arm from a URDF.

mod drawing;

use serde::Serialize;
use std::io::{IsTerminal, Write as _};
use std::path::{Path, PathBuf};
use supple_cli::arguments::NewArgs;
use supple_cli::console::{print_json, print_line, print_status};
use supple_cli::exit::Failure;
use supple_experiment::{Mismatch, Plan, Setup, Variant, run as simulate, scenario};
use supple_model::{Completed, Description, UrdfName, tip_weight_n, with_dof};
use supple_plant::Scene;

/// Duration of the first run on the sinusoid \[s\].
const RUN_S: f64 = 5.0;
/// Facts about an arm that must be known before it moves and that no URDF contains.
const BEFORE_A_REAL_ARM: [&str; 6] = [
    "sign and zero of every encoder and motor (`supple calibrate` checks the wiring first)",
    "torque constants and transmission: [motors]",
    "the real limits of position, speed and torque, not the URDF's",
    "how drives and brakes behave without commands, and whether the arm falls: [bus], stow_rad",
    "what stands around the arm: [workspace]",
    "where the arm collides with itself: supple checks no collision of links",
];
/// Files of the result.
const FILES: [&str; 3] = ["arm.toml", "arm.urdf", "arm.svg"];

/// Report of `supple new`.
#[derive(Debug, Serialize)]
struct Summary {
    arm: String,
    folder: PathBuf,
    tip: String,
    joints: Vec<String>,
    held: Vec<String>,
    tip_weight_n: f64,
    run_s: f64,
    rms_error_m: f64,
    max_error_m: f64,
    /// Allowed root mean square error, see [`scenario::allowed_error_m`].
    allowed_error_m: f64,
    fault: Option<String>,
    derived: Vec<Setting>,
    warnings: Vec<String>,
    estimated_rotors: Vec<String>,
    without_friction: Vec<String>,
}

/// A derived setting.
#[derive(Debug, Serialize)]
struct Setting {
    key: String,
    value: String,
    why: String,
}

/// Runs `supple new`.
///
/// # Errors
/// [`Failure`]; nothing is written unless the first run could be simulated.
pub fn run(args: &NewArgs) -> Result<(), Failure> {
    let name = args.urdf.name(&args.file.display().to_string());
    let Some(mut name) = UrdfName::parse(&name) else {
        return Err(supple_model::ModelError::NotUrdf { file: name }.into());
    };
    let folder = args
        .out
        .clone()
        .unwrap_or_else(|| PathBuf::from(args.file.file_stem().unwrap_or_else(|| "arm".as_ref())));
    let existing = FILES.map(|file| folder.join(file));
    if let (false, Some(path)) = (args.force, existing.into_iter().find(|path| path.exists())) {
        return Err(Failure::Exists { path });
    }
    let given = read(&mut name)?.strict_if(args.strict)?;
    let completed = given.completed()?;
    let arm = &completed.description;
    let mut summary = with_dof!(arm.dof(), N => first_run::<N>(&completed))??;
    summary.folder.clone_from(&folder);
    let svg = with_dof!(arm.dof(), N => drawing::svg::<N>(arm))??;
    arm.save(&folder)?;
    write(&folder.join("arm.toml"), &with_heading(arm, &folder, args)?)?;
    write(&folder.join("arm.svg"), &svg)?;
    // The written files are read back; the warnings of the summary are those of the written files.
    Description::load(&folder)?.completed()?;
    if args.json {
        return print_json(&summary);
    }
    print_line(&text(&summary))
}

/// Reads the URDF; asks for the tip on a terminal if it is ambiguous.
fn read(name: &mut UrdfName) -> Result<Description, Failure> {
    let found = Description::from_urdf(name);
    let asks = name.tip.is_none() && std::io::stdin().is_terminal();
    match found {
        Err(error) if asks && error.to_string().contains("--tip LINK") => {
            print_status(&error.to_string());
            let mut output = std::io::stderr();
            // Without a terminal, the answer is empty, which the reader rejects.
            let _ = output
                .write_all(b"tip link: ")
                .and_then(|()| output.flush());
            let mut answer = String::new();
            let _ = std::io::stdin().read_line(&mut answer);
            name.tip = Some(answer.trim().to_owned());
            Ok(Description::from_urdf(name)?)
        }
        found => Ok(found?),
    }
}

/// Simulates the sinusoid at 5 N/m with a model that has errors of 0.1 % and 3 %.
fn first_run<const N: usize>(completed: &Completed) -> Result<Summary, Failure> {
    let arm = &completed.description;
    let setup = Setup::<N>::new(arm, 0)?;
    let variant = Variant {
        mismatch: Some(Mismatch::identified(0)),
        ..Variant::EXACT
    };
    let mut config = setup.config(&variant)?;
    config.law.gains = scenario::gains_like(&config.law.gains, scenario::STIFFNESS_N_PER_M);
    let plan = Plan {
        name: "sinusoid".to_owned(),
        config,
        plant: setup.plant(&variant, Scene::default()),
        trajectory: setup.paths().sinusoid(1.0).0,
        duration_s: RUN_S,
        learning: false,
        gain_change: None,
    };
    let found = simulate(&plan, &mut |_, _| Ok(()))?;
    let joints = &arm.settings().joints;
    let names = |is: &dyn Fn(usize) -> bool| -> Vec<String> {
        let chosen = (0..N).filter(|i| is(*i));
        chosen.map(|i| arm.joint_names()[i].clone()).collect()
    };
    let of_joint = |i: usize| {
        joints
            .iter()
            .find(|joint| joint.name == arm.joint_names()[i])
    };
    let tip_weight_n = tip_weight_n::<N>(arm)?;
    Ok(Summary {
        arm: arm.name().to_owned(),
        folder: PathBuf::new(),
        tip: arm.settings().tip_frame.clone(),
        joints: arm.joint_names().to_vec(),
        held: names(&|i| of_joint(i).is_some_and(|joint| joint.held.is_some())),
        tip_weight_n,
        run_s: RUN_S,
        rms_error_m: found.rms_error_m,
        max_error_m: found.max_error_m,
        allowed_error_m: scenario::allowed_error_m(tip_weight_n),
        fault: found.ended.map(|ended| ended.fault),
        derived: completed
            .derived
            .iter()
            .map(|derived| Setting {
                key: derived.key.clone(),
                value: derived.value.clone(),
                why: derived.why.clone(),
            })
            .collect(),
        warnings: arm.warnings().iter().map(ToString::to_string).collect(),
        estimated_rotors: names(&|i| of_joint(i).is_some_and(|joint| joint.armature_is_estimate)),
        without_friction: names(&|i| {
            let friction = &arm.friction()[i];
            friction.coulomb_nm == 0.0 && friction.viscous_nm_s_per_rad == 0.0
        }),
    })
}

/// Returns the TOML with a heading that explains it.
fn with_heading(arm: &Description, folder: &Path, args: &NewArgs) -> Result<String, Failure> {
    let path = folder.join("arm.toml");
    let saved = supple_files::read_text(&path, Description::MAX_BYTES)
        .map_err(|error| Failure::file("read", &path, error))?;
    Ok(format!(
        "# {}: written by `supple new` from {}.\n\
         # A line with `derived:` is computed from the URDF, for simulation; replace it by a datum of the arm, or remove it\n\
         # to have it computed again. Rotor inertias are estimates. Keys and units: the schema in `supple`'s assets.\n\n{saved}",
        arm.name(),
        args.file.display()
    ))
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    supple_files::write_atomic(path, text.as_bytes())
        .map_err(|error| Failure::file("write", path, error))
}

/// Formats the derived settings, one line for each key and reason, with the values of all joints that share them.
fn settings_lines(derived: &[Setting]) -> Vec<String> {
    // Key, reason, and the values by joint.
    let mut groups: Vec<(&str, &str, Vec<String>)> = Vec::new();
    for setting in derived {
        let of_joint = setting.key.strip_prefix("joint `");
        let (joint, key) = match of_joint.and_then(|rest| rest.split_once("` ")) {
            Some((joint, key)) => (Some(joint), key),
            None => (None, setting.key.as_str()),
        };
        // The line of the inertia itself already contains this information.
        if key == "armature_is_estimate" {
            continue;
        }
        let value = match joint {
            Some(joint) => format!("{joint} {}", setting.value),
            None => setting.value.clone(),
        };
        let known =
            |group: &&mut (&str, &str, Vec<String>)| group.0 == key && group.1 == setting.why;
        match groups.iter_mut().find(known) {
            Some(group) => group.2.push(value),
            None => groups.push((key, &setting.why, vec![value])),
        }
    }
    let groups = groups.into_iter();
    groups
        .map(|(key, why, values)| format!("  {key}: {}  ({why})", values.join(", ")))
        .collect()
}

fn text(summary: &Summary) -> String {
    let list = |names: &[String]| match names {
        [] => "none".to_owned(),
        names => names.join(", "),
    };
    let folder = summary.folder.display();
    let mut lines: Vec<String> = summary
        .warnings
        .iter()
        .map(|line| format!("warning: {line}"))
        .collect();
    let free: Vec<String> = summary
        .joints
        .iter()
        .filter(|joint| !summary.held.contains(joint))
        .cloned()
        .collect();
    lines.push(format!(
        "{}: {} joints from the base to the tip `{}` (another: --tip LINK)",
        summary.arm,
        summary.joints.len(),
        summary.tip
    ));
    lines.push(format!("  the law controls: {}", list(&free)));
    lines.push(format!("  held at an angle: {}", list(&summary.held)));
    lines.push(format!(
        "{} settings derived; {folder}/arm.toml has each with its reason:",
        summary.derived.len()
    ));
    lines.extend(settings_lines(&summary.derived));
    let ending = match &summary.fault {
        None => "no fault".to_owned(),
        Some(fault) => format!("it ended with a fault: {fault}"),
    };
    lines.push(format!(
        "simulated {} s of the sinusoid at 5 N/m, model 0.1 % and 3 % off: {:.1} mm RMS of {:.1} mm allowed, {:.1} mm at most, \
         {ending}",
        summary.run_s,
        1e3 * summary.rms_error_m,
        1e3 * summary.allowed_error_m,
        1e3 * summary.max_error_m
    ));
    lines.push(format!(
        "tip weight (the force at the tip that carries the arm) along the sinusoid: {:.0} N RMS; each percent of error in the \
         gravity model is {:.0} mm at 5 N/m",
        summary.tip_weight_n,
        1e3 * 0.01 * summary.tip_weight_n / scenario::STIFFNESS_N_PER_M
    ));
    lines.push(
        "identification (`supple excite`, `supple identify`) finds masses, centres of mass, inertias and friction, as torques \
         show them"
            .to_owned(),
    );
    lines.push(format!(
        "  rotor inertias that are estimates until then: {}",
        list(&summary.estimated_rotors)
    ));
    lines.push(format!(
        "  joints without friction in the URDF: {}",
        list(&summary.without_friction)
    ));
    lines.push(
        "before a real arm moves, determine the following, which no URDF contains:".to_owned(),
    );
    lines.extend(BEFORE_A_REAL_ARM.map(|line| format!("  - {line}")));
    lines.push(format!(
        "written: {folder}/arm.toml, {folder}/arm.urdf, {folder}/arm.svg (open it in a browser)\n\
         next: supple demo --arm {folder}, or supple up --plant sim --arm {folder}; docs/own_arm.md describes the next steps"
    ));
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::{Setting, settings_lines};

    #[test]
    fn settings_of_joints_with_one_reason_share_a_line() {
        let setting = |key: &str, value: &str, why: &str| Setting {
            key: key.to_owned(),
            value: value.to_owned(),
            why: why.to_owned(),
        };
        let lines = settings_lines(&[
            setting("joint `a` armature_kg_m2", "0.1", "an estimate"),
            setting("joint `a` armature_is_estimate", "true", "see above"),
            setting("joint `b` armature_kg_m2", "0.2", "an estimate"),
            setting("[paths] scale", "0.5", "the largest"),
        ]);
        assert_eq!(
            lines,
            [
                "  armature_kg_m2: a 0.1, b 0.2  (an estimate)",
                "  [paths] scale: 0.5  (the largest)",
            ]
        );
    }
}
