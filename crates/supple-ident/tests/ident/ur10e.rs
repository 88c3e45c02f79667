//! A real UR10e: fitted on one log, validated on three others.
//!
//! The logs may not be redistributed: `SUPPLE_UR10E_DIR` names the folder of
//! `dynamic_calibration/dataset_ur10e` with `ur10e.urdf` beside them.

use std::path::Path;
use supple_ident::{DMatrix, Log, Preparation, Procedure, identify};
use supple_model::Description;

/// N m/A.
const GAIN: [f64; 6] = [14.87, 13.26, 11.13, 10.62, 11.03, 11.47];
/// Relative error allowed: point to point, 40 s, 20 s.
const BOUNDS: [f64; 3] = [0.037, 0.025, 0.035];

pub(crate) fn log(folder: &Path, file: &str, rows: std::ops::Range<usize>) -> Log {
    let text = std::fs::read_to_string(folder.join(file)).expect(file);
    let lines: Vec<Vec<f64>> = text
        .lines()
        .take(rows.end)
        .skip(rows.start)
        .map(|line| {
            line.split(',')
                .map(|x| x.trim().parse().expect("a number"))
                .collect()
        })
        .collect();
    let columns = |first: usize, gain: [f64; 6]| {
        DMatrix::from_fn(lines.len(), 6, |i, j| gain[j] * lines[i][first + j])
    };
    Log {
        t_s: lines.iter().map(|line| line[0]).collect(),
        q_rad: columns(1, [1.0; 6]),
        qd_rad_per_s: Some(columns(7, [1.0; 6])),
        tau_nm: columns(13, GAIN),
    }
}

pub(crate) fn description(folder: &Path) -> Description {
    let urdf = folder.join("ur10e.urdf");
    let own = tempfile::tempdir().expect("a folder");
    let toml = own.path().join("ur10e.toml");
    let text = format!(
        "name = \"ur10e\"\nurdf = {:?}\ntip_frame = \"tool0\"\n",
        urdf.display().to_string()
    );
    std::fs::write(&toml, text).expect("a TOML");
    Description::load(&toml).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
#[ignore = "needs the logs of a UR10e, which may not be redistributed: SUPPLE_UR10E_DIR, `./ci.sh ur10e`"]
fn predicts_the_torques_of_other_motions() {
    let folder = std::env::var_os("SUPPLE_UR10E_DIR").expect("SUPPLE_UR10E_DIR names their folder");
    let folder = Path::new(&folder);
    let arm = description(folder).arm::<6>().expect("six joints");
    let fit_on = log(folder, "ur-20_02_10-30sec_12harm.csv", 635..3510);
    // Every choice uses only the fitted log.
    let procedure = Procedure {
        preparation: Preparation {
            rate_hz: Some(100.0),
            cutoff_hz: Some(8.0),
            ..Preparation::default()
        },
        ..Procedure::default()
    };
    let fit = identify(&arm, &[fit_on], &procedure).expect("a fit");
    for choice in &fit.choices {
        println!("{}\n{}", choice.subject, choice.table);
    }
    fit.arm().expect("every link is physically consistent");
    assert!(fit.friction().iter().all(|f| f.validate().is_ok()));
    let judge = [
        ("ur-20_01_17-ptp_10_points.csv", 700..4200),
        ("ur-20_02_12-40sec_12harm.csv", 500..4460),
        ("ur-20_02_05-20sec_8harm.csv", 320..2310),
    ];
    let mut worst = Vec::new();
    for ((file, rows), bound) in judge.into_iter().zip(BOUNDS) {
        let checked = fit.validate(&log(folder, file, rows)).expect("six joints");
        println!("{file}: {} {:.2?}", checked.verdict(), checked.rms_nm);
        assert_eq!(checked.positive_definite, 1.0);
        if checked.total_relative > bound {
            worst.push((file, checked.total_relative, bound));
        }
    }
    assert!(worst.is_empty(), "{worst:?}");
}
