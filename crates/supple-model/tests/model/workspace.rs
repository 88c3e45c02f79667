//! The `[workspace]` of a TOML: boundaries and zones of the tip, their defaults and errors.

use crate::common::{TOML, URDF};
use supple_core::config::{Border, Workspace, Zone};
use supple_core::math::Vector3;
use supple_model::Description;

/// The workspace of a TOML with this text at its end; the elbow is controlled by the law.
fn read(text: &str) -> Result<Workspace, String> {
    let start = TOML.find("held = ").unwrap();
    let end = start + TOML[start..].find('\n').unwrap();
    let toml = format!("{}{}\n{text}\n", &TOML[..start], &TOML[end..]);
    Description::from_text(&toml, URDF)
        .and_then(|description| description.config::<3>())
        .map(|config| config.workspace)
        .map_err(|error| error.to_string())
}

#[test]
fn without_a_workspace_the_tip_is_not_limited() {
    let workspace = read("").unwrap();
    assert!(workspace.is_unbounded());
}

#[test]
fn every_workspace_entry_reaches_the_configuration() {
    let workspace = read(
        "[workspace]
        margin_m = 0.03
        stiffness_n_per_m = 300.0
        damping_n_s_per_m = 15.0
        keep_in = { lower_m = [-0.5, -0.6, -0.7], upper_m = [0.8, 0.9, 1.0] }
        [[workspace.wall]]
        normal = [0.0, 0.0, -2.0]
        offset_m = 0.1
        [[workspace.keep_out]]
        lower_m = [0.1, 0.2, 0.3]
        upper_m = [0.4, 0.5, 0.6]
        [[workspace.zone]]
        lower_m = [-1.0, -1.0, -1.0]
        upper_m = [0.0, 0.0, 0.0]
        tip_speed_m_per_s = 0.2
        [[workspace.zone]]
        lower_m = [0.0, 0.0, 0.0]
        upper_m = [1.0, 1.0, 1.0]
        tip_force_n = 7.0",
    )
    .unwrap();
    let given = (
        workspace.margin_m,
        workspace.stiffness_n_per_m,
        workspace.damping_n_s_per_m,
    );
    assert_eq!(given, (0.03, 300.0, 15.0));
    // The normal gets length 1, the offset stays in metres along it.
    let mut expected = vec![Border::Wall {
        normal: -Vector3::z(),
        offset_m: 0.1,
    }];
    for (normal, offset_m) in [
        (Vector3::x(), 0.8),
        (-Vector3::x(), 0.5),
        (Vector3::y(), 0.9),
        (-Vector3::y(), 0.6),
        (Vector3::z(), 1.0),
        (-Vector3::z(), 0.7),
    ] {
        expected.push(Border::Wall { normal, offset_m });
    }
    expected.push(Border::KeepOut {
        lower_m: Vector3::new(0.1, 0.2, 0.3),
        upper_m: Vector3::new(0.4, 0.5, 0.6),
    });
    let found: Vec<Border> = workspace.borders.into_iter().flatten().collect();
    assert_eq!(found, expected);
    let zones: Vec<Zone> = workspace.zones.into_iter().flatten().collect();
    let limits: Vec<_> = zones
        .iter()
        .map(|zone| (zone.tip_speed_m_per_s, zone.tip_force_n))
        .collect();
    assert_eq!(limits, [(0.2, f64::MAX), (f64::MAX, 7.0)]);
    // The points are inside the box, beyond the wall of the floor, or in the forbidden box.
    let border = |x, y, z| {
        let found = workspace.violated_border(&Vector3::new(x, y, z));
        found.map(|(index, _)| index)
    };
    assert_eq!(border(0.0, 0.0, 0.0), None);
    assert_eq!(border(0.0, 0.0, -0.2), Some(0));
    assert_eq!(border(0.9, 0.0, 0.0), Some(1));
    assert_eq!(border(0.0, -0.7, 0.0), Some(4));
    assert_eq!(border(0.2, 0.3, 0.4), Some(7));
}

#[test]
fn missing_workspace_entries_have_the_documented_default() {
    let workspace = read("[[workspace.wall]]\nnormal = [0.0, 1.0, 0.0]\noffset_m = 0.4").unwrap();
    let defaults = (
        workspace.margin_m,
        workspace.stiffness_n_per_m,
        workspace.damping_n_s_per_m,
    );
    assert_eq!(defaults, (0.05, 400.0, 20.0));
}

/// Each error names the entry, the value and what is allowed.
#[test]
fn errors_name_entry_and_value() {
    let wall = |normal: &str| format!("[[workspace.wall]]\nnormal = {normal}\noffset_m = 0.1");
    let boxed = |entry: &str, more: &str| {
        format!(
            "[[workspace.{entry}]]\nlower_m = [0.0, 0.0, 0.0]\nupper_m = [1.0, -1.0, 1.0]{more}"
        )
    };
    let zone = |limit: &str| {
        format!("[[workspace.zone]]\nlower_m = [0.0, 0.0, 0.0]\nupper_m = [1.0, 1.0, 1.0]\n{limit}")
    };
    let cases: Vec<(String, [&str; 2])> = vec![
        (
            wall("[0.0, 0.0, 0.0]"),
            ["[[workspace.wall]] normal", "finite and not zero"],
        ),
        (
            wall("[0.0, inf, 0.0]"),
            ["[[workspace.wall]] normal", "inf"],
        ),
        (wall("[0.0, 0.0]"), ["line", "normal"]),
        (boxed("keep_out", ""), ["workspace border", "lower corner"]),
        (boxed("zone", ""), ["workspace zone", "lower corner"]),
        (
            zone("tip_speed_m_per_s = 0.0"),
            ["tip_speed_m_per_s", "positive"],
        ),
        (zone("tip_force_n = -1.0"), ["tip_force_n", "-1"]),
        (zone("force_n = 1.0"), ["force_n", "tip_force_n"]),
        (
            "[workspace]\nmargin_m = 2.0".into(),
            ["margin_m", "at most 1"],
        ),
        (
            "[workspace]\nstiffness_n_per_m = 1e300".into(),
            ["stiffness_n_per_m", "10,000"],
        ),
        (
            std::iter::repeat_n(wall("[0.0, 0.0, 1.0]"), 9)
                .collect::<Vec<_>>()
                .join("\n"),
            ["[workspace] wall", "the limit is 8; keep_in counts as six"],
        ),
    ];
    for (text, parts) in cases {
        let error = read(&text).unwrap_err();
        for part in parts {
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
