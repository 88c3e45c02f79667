//! A real Stäubli TX40, joints 5 and 6 coupled by a gear: fitted on the first half of its log, validated on the
//! second. See `data/tx40/README.md`.

use std::f64::consts::FRAC_PI_2;
use supple_ident::{DMatrix, Log, Preparation, Procedure, identify};
use supple_model::Description;

const GEAR: [f64; 6] = [32.0, 32.0, 45.0, -48.0, 45.0, 32.0];
const RATE_HZ: f64 = 5000.0;

fn table(text: &str) -> Vec<[f64; 6]> {
    let row = |line: &str| {
        let mut cells = line.split(',').map(|x| x.trim().parse().expect("a number"));
        std::array::from_fn(|_| cells.next().expect("six cells"))
    };
    text.lines().skip(1).map(row).collect()
}

pub(crate) fn log() -> Log {
    let p = table(include_str!("../data/tx40/pos_read_data.csv"));
    let m = table(include_str!("../data/tx40/curr_data.csv"));
    let offset = [0.0, -FRAC_PI_2, FRAC_PI_2, 0.0, 0.0, 0.0];
    let samples = p.len().min(m.len());
    let alone = |i: usize, j: usize| p[i][j] / GEAR[j];
    Log {
        t_s: (0..samples).map(|i| i as f64 / RATE_HZ).collect(),
        q_rad: DMatrix::from_fn(samples, 6, |i, j| match j {
            5 => alone(i, 5) - alone(i, 4),
            _ => alone(i, j) + offset[j],
        }),
        qd_rad_per_s: None,
        tau_nm: DMatrix::from_fn(samples, 6, |i, j| match j {
            4 => GEAR[4] * m[i][4] + GEAR[5] * m[i][5],
            _ => GEAR[j] * m[i][j],
        }),
    }
}

fn part(log: &Log, rows: std::ops::Range<usize>) -> Log {
    let cut = |m: &DMatrix<f64>| m.rows_range(rows.clone()).into_owned();
    Log {
        t_s: log.t_s[rows.clone()].to_vec(),
        q_rad: cut(&log.q_rad),
        qd_rad_per_s: None,
        tau_nm: cut(&log.tau_nm),
    }
}

pub(crate) fn description() -> Description {
    let urdf = include_str!("../data/tx40/tx40.urdf");
    let none = r#"ixx="0.000" ixy="0.000" ixz="0.000" iyy="0.000" iyz="0.000" izz="0.000""#;
    let some = r#"ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4""#;
    assert!(urdf.contains(none));
    Description::from_text(
        "name = \"tx40\"\nurdf = \"tx40.urdf\"\ntip_frame = \"tool0\"\n",
        &urdf.replace(none, some),
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_second_half_is_predicted_from_the_first() {
    let arm = description().arm::<6>().expect("six joints");
    let procedure = Procedure {
        couplings: vec![(4, 5)],
        preparation: Preparation {
            rate_hz: Some(RATE_HZ),
            cutoff_hz: Some(40.0),
            decimation_factor: 10,
            ..Preparation::default()
        },
        ..Procedure::default()
    };
    let whole = log();
    let half = whole.t_s.len() / 2;
    let first = part(&whole, 0..half);
    let second = part(&whole, half..whole.t_s.len());
    let fit = identify(&arm, &[first], &procedure).unwrap();
    for choice in &fit.choices {
        println!("{}\n{}", choice.subject, choice.table);
    }
    let checked = fit.validate(&second).unwrap();
    println!("{} {:.2?}", checked.verdict(), checked.relative);
    fit.arm().expect("every link is physically consistent");
    assert_eq!(checked.positive_definite, 1.0);
    assert!(checked.total_relative < 0.105, "{}", checked.total_relative);
}
