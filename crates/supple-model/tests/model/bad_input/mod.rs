//! Invalid input is rejected, and each message names file, element, value and remedy.

mod files;
mod published;
mod toml;
mod urdf;

use crate::common::{TOML, URDF, with_toml, with_urdf};
use supple_model::{Description, ModelError};

/// Text to replace, its replacement, and fragments that the message must contain: element, value, remedy.
type Case = (&'static str, &'static str, [&'static str; 3]);

fn check(file: &str, cases: &[Case], load: fn(&str, &str) -> Result<Description, ModelError>) {
    for (from, to, fragments) in cases {
        let error = load(from, to).err();
        let message = error
            .unwrap_or_else(|| panic!("accepted: {to}"))
            .to_string();
        assert!(message.contains(file), "no file name in: {message}");
        for fragment in fragments {
            assert!(message.contains(fragment), "no `{fragment}` in: {message}");
        }
    }
}

#[test]
fn the_unchanged_texts_are_accepted() {
    Description::from_text(TOML, URDF).unwrap();
}

#[test]
fn numbers_that_would_overflow_are_rejected() {
    check(
        "small.urdf",
        &[
            (
                "<mass value=\"1.5\"/>",
                "<mass value=\"1e300\"/>",
                ["`link2` <mass>", "1e300", "SI units"],
            ),
            (
                "<origin xyz=\"0 0 0.3\" rpy=\"0 0 0\"/>",
                "<origin xyz=\"0 -1e200 0\"/>",
                ["`yaw` <origin>", "-1e200", "SI units"],
            ),
        ],
        with_urdf,
    );
    check(
        "arm.toml",
        &[
            (
                "mass_kg = 0.2",
                "mass_kg = 1e200",
                ["[tool]", "mass 1000", "SI units"],
            ),
            (
                "com_m = [0.0, 0.0, -0.01]",
                "com_m = [0.0, 0.0, -1e200]",
                ["[tool]", "-1e200", "SI units"],
            ),
        ],
        with_toml,
    );
}

#[test]
fn missing_files_are_errors() {
    let message = Description::find("nowhere/arm.toml")
        .unwrap_err()
        .to_string();
    for fragment in ["nowhere/arm.toml", "cannot be read", "give the TOML"] {
        assert!(message.contains(fragment), "{message}");
    }
    let message = Description::load("/nowhere/arm.toml")
        .unwrap_err()
        .to_string();
    for fragment in ["/nowhere/arm.toml", "cannot be read", "give the TOML"] {
        assert!(message.contains(fragment), "{message}");
    }
    let folder = std::env::temp_dir().join(format!("supple-model-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("arm.toml"), TOML).unwrap();
    let message = Description::load(&folder).unwrap_err().to_string();
    for fragment in ["small.urdf", "cannot be read", "correct `urdf`"] {
        assert!(message.contains(fragment), "{message}");
    }
    std::fs::write(folder.join("small.urdf"), URDF).unwrap();
    let loaded = Description::load(&folder).unwrap();
    assert_eq!((loaded.toml(), loaded.urdf()), (TOML, URDF));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn the_error_of_an_unknown_asset_lists_the_assets() {
    assert_eq!(Description::find("wam3").unwrap().name(), "wam3");
    let message = Description::find("wam5").unwrap_err().to_string();
    assert!(
        message.contains("`wam5`") && message.contains("openarm, paper3, wam3, wam4, wam7, yam"),
        "{message}"
    );
}

#[test]
fn the_error_of_a_wrong_joint_count_names_both_numbers() {
    let message = Description::asset("wam4")
        .unwrap()
        .config::<7>()
        .unwrap_err()
        .to_string();
    for fragment in [
        "assets/wam4/arm.toml",
        "`wam4`",
        "4 moving joints",
        "expects 7",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
    let two = supple_model::with_dof!(2, N => N).unwrap_err().to_string();
    for fragment in ["2 moving joints", "3 to 7", "[fixed_joints_rad]"] {
        assert!(two.contains(fragment), "{two}");
    }
    for dof in 3..=7 {
        assert_eq!(supple_model::with_dof!(dof, N => N).unwrap(), dof);
    }
}

#[test]
fn errors_of_the_controller_name_the_file() {
    let description = Description::from_text(TOML, URDF).unwrap();
    let message = description.config::<3>().unwrap_err().to_string();
    for fragment in [
        "arm.toml",
        "active joints",
        "found 2",
        "at least 3",
        "correct it",
    ] {
        assert!(message.contains(fragment), "{message}");
    }
}
