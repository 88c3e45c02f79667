//! Every configuration entry that can be invalid is rejected with its name and value.

use crate::support::configs::{four, held, seven, three};
use crate::support::property::{check, per_joint};
use proptest::prelude::*;
use supple_core::config::{ApparentInertia, Role};
use supple_core::math::Matrix3;
use supple_core::{Config, Controller, Matrix};

const NOT_POSITIVE: [f64; 5] = [0.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
const NEGATIVE: [f64; 4] = [-1e-9, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

/// `change` makes a valid configuration invalid; the error names entry, joint and value.
#[track_caller]
fn refused(entry: &str, joint: Option<usize>, value: f64, change: impl FnOnce(&mut Config<4>)) {
    let mut config = four();
    assert!(Controller::new(config).is_ok());
    change(&mut config);
    let error = Controller::new(config).expect_err(entry);
    assert_eq!((error.entry, error.joint), (entry, joint), "{value}");
    let same = error.value == value || error.value.is_nan() && value.is_nan();
    assert!(same, "{entry}: {} is not {value}", error.value);
    let message = error.to_string();
    assert!(
        message.contains(entry) && message.contains(error.must),
        "{message}"
    );
    assert!(message.contains(&format!("{value}")), "{message}");
    if let Some(joint) = joint {
        assert!(message.contains(&format!("joint {joint}")), "{message}");
    }
}

/// Entries with one value each.
macro_rules! refuses {
    ($values:expr, $($name:literal => $($field:ident).+),* $(,)?) => {$(
        for value in $values {
            refused($name, None, value, |config| config.$($field).+ = value);
        }
    )*};
}

/// Entries with one value per joint.
macro_rules! refuses_per_joint {
    ($values:expr, $($name:literal => $($field:ident).+),* $(,)?) => {$(
        for value in $values {
            for joint in 0..4 {
                refused($name, Some(joint), value, |config| config.$($field).+[joint] = value);
            }
        }
    )*};
}

#[test]
fn valid_configurations_are_accepted() {
    assert!(Controller::new(three()).is_ok());
    assert!(Controller::new(four()).is_ok());
    let controller = Controller::new(seven()).expect("valid");
    assert_eq!(controller.config().period_s, 1e-3);
}

#[test]
fn entries_must_be_positive() {
    refuses!(NOT_POSITIVE,
        "period_s" => period_s,
        "estimator_rad_per_s" => estimator_rad_per_s,
        "handover_s" => handover_s,
        "observer_rad_per_s" => latch.observer_rad_per_s,
        "threshold_n" => latch.threshold_n,
        "fade_s" => latch.fade_s,
        "restore_s" => latch.restore_s,
        "soft_zone_rad" => limits.soft_zone_rad,
        "tip_speed_m_per_s" => limits.tip_speed_m_per_s,
        "tracking_error_m" => limits.tracking_error_m,
        "joint_tracking_error_rad" => limits.joint_tracking_error_rad,
        "start_error_m" => limits.start_error_m,
        "stiffness limit" => limits.stiffness_n_per_m,
        "damping limit" => limits.damping_n_s_per_m,
        "rotational stiffness limit" => pose.max_stiffness_nm_per_rad,
        "rotational damping limit" => pose.max_damping_nm_s_per_rad,
        "angular_speed_rad_per_s" => pose.angular_speed_rad_per_s,
        "rotation_error_rad" => pose.rotation_error_rad,
    );
    refuses_per_joint!(NOT_POSITIVE,
        "move stiffness_nm_per_rad" => move_gains.stiffness_nm_per_rad,
        "joint_speed_rad_per_s" => limits.joint_speed_rad_per_s,
        "joint_torque_nm" => limits.joint_torque_nm,
        "motor_torque_nm" => limits.motor_torque_nm,
        "torque_rate_nm_per_s" => limits.torque_rate_nm_per_s,
    );
}

#[test]
fn entries_must_not_be_negative() {
    refuses!(NEGATIVE,
        "nullspace_damping_nm_s_per_rad" => law.nullspace_damping_nm_s_per_rad,
        "reversal_s" => latch.reversal_s,
        "friction_error" => latch.friction_error,
    );
    refuses_per_joint!(NEGATIVE,
        "move damping_nm_s_per_rad" => move_gains.damping_nm_s_per_rad,
        "hold_damping_nm_s_per_rad" => hold_damping_nm_s_per_rad,
        "soft_stiffness_nm_per_rad" => limits.soft_stiffness_nm_per_rad,
        "soft_damping_nm_s_per_rad" => limits.soft_damping_nm_s_per_rad,
        "posture_stiffness_nm_per_rad" => pose.posture_stiffness_nm_per_rad,
        "posture_torque_nm" => pose.posture_torque_nm,
    );
}

#[test]
fn fractions_must_be_from_0_to_1() {
    for value in [-1e-9, 1.000_000_1, f64::NAN, f64::INFINITY] {
        refused("contact_share", None, value, |config| {
            config.latch.contact_share = value;
        });
    }
    for value in [0.0, 1.0] {
        let mut config = four();
        config.latch.contact_share = value;
        assert!(Controller::new(config).is_ok());
    }
    for value in [0.0, -0.5, 1.000_000_1, f64::NAN] {
        refused("presliding_share", None, value, |config| {
            config.law.presliding_share = value;
        });
    }
}

#[test]
fn gains_must_be_within_their_limits() {
    for axis in 0..3 {
        for value in [-1e-9, 1000.1, f64::NAN, f64::INFINITY] {
            refused("stiffness_n_per_m", None, value, |config| {
                config.law.gains.stiffness_n_per_m[axis] = value;
            });
        }
        for value in [-1e-9, 100.1, f64::NAN, f64::INFINITY] {
            refused("damping_n_s_per_m", None, value, |config| {
                config.law.gains.damping_n_s_per_m[axis] = value;
            });
        }
    }
}

#[test]
fn invalid_friction_is_rejected() {
    for joint in 0..4 {
        for value in NEGATIVE {
            refused("viscous_nm_s_per_rad", Some(joint), value, |config| {
                config.friction[joint].viscous_nm_s_per_rad = value;
            });
            refused("coulomb_nm", Some(joint), value, |config| {
                config.friction[joint].coulomb_nm = value;
            });
        }
        refused("breakaway_nm", Some(joint), 0.9, |config| {
            config.friction[joint].coulomb_nm = 1.0;
            config.friction[joint].breakaway_nm = 0.9;
        });
        for value in NOT_POSITIVE {
            refused("stribeck_rad_per_s", Some(joint), value, |config| {
                config.friction[joint].stribeck_rad_per_s = value;
            });
            refused("band_rad_per_s", Some(joint), value, |config| {
                config.friction[joint].band_rad_per_s = value;
            });
        }
        refused("offset_nm", Some(joint), f64::INFINITY, |config| {
            config.friction[joint].offset_nm = f64::INFINITY;
        });
    }
}

#[test]
fn held_joints_are_validated() {
    let with = |position_rad, stiffness_nm_per_rad, damping_nm_s_per_rad| {
        move |config: &mut Config<4>| {
            config.roles[2] = Role::Held {
                position_rad,
                stiffness_nm_per_rad,
                damping_nm_s_per_rad,
            };
        }
    };
    for value in [2.81, -2.81, f64::NAN, f64::INFINITY] {
        refused(
            "held position_rad",
            Some(2),
            value,
            with(value, 600.0, 10.0),
        );
    }
    for value in NOT_POSITIVE {
        let change = with(0.0, value, 10.0);
        refused("held stiffness_nm_per_rad", Some(2), value, change);
    }
    for value in NEGATIVE {
        let change = with(0.0, 600.0, value);
        refused("held damping_nm_s_per_rad", Some(2), value, change);
    }
}

#[test]
fn ranges_must_be_wider_than_their_soft_zones() {
    for joint in 0..4 {
        refused("position range", Some(joint), 0.1875, |config| {
            config.limits.position_lower_rad[joint] = 1.0;
            config.limits.position_upper_rad[joint] = 1.1875;
        });
        refused("position range", Some(joint), f64::NAN, |config| {
            config.limits.position_upper_rad[joint] = f64::NAN;
        });
        refused("position range", Some(joint), f64::INFINITY, |config| {
            config.limits.position_lower_rad[joint] = f64::NEG_INFINITY;
        });
    }
}

#[test]
fn fewer_than_three_active_joints_are_rejected() {
    refused("number of active joints", None, 2.0, |config| {
        config.roles[0] = held(0.0);
    });
}

#[test]
fn an_invalid_apparent_inertia_is_rejected() {
    let refuse = |mass: Matrix3<f64>| {
        let mut config = four();
        config.law.inertia = ApparentInertia::Chosen(mass);
        let error = Controller::new(config).expect_err("not an inertia");
        assert_eq!(error.entry, "apparent inertia");
        assert!(error.to_string().contains("positive definite"), "{error}");
    };
    refuse(Matrix3::zeros());
    refuse(Matrix3::from_diagonal_element(-1.0));
    refuse(Matrix3::from_diagonal_element(f64::NAN));
    refuse(Matrix3::from_diagonal_element(f64::INFINITY));
    refuse(Matrix3::new(1.0, 0.1, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    refuse(Matrix3::new(1.0, 2.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0, 1.0));
    let mut config = four();
    config.law.inertia = ApparentInertia::Chosen(Matrix3::from_diagonal_element(0.5));
    assert!(Controller::new(config).is_ok());
}

#[test]
fn singular_transmissions_are_rejected() {
    let refuse = |matrix: Matrix<4, 4>| {
        let mut config = four();
        config.joint_from_motor = matrix;
        let error = Controller::new(config).expect_err("not invertible");
        assert_eq!(error.entry, "joint_from_motor");
    };
    refuse(Matrix::zeros());
    refuse(Matrix::from_diagonal_element(f64::NAN));
    refuse(Matrix::from_diagonal_element(f64::INFINITY));
    refuse(Matrix::from_element(1.0));
    // Three motors for four joints.
    check(
        300,
        (per_joint::<4>(1.0), 0..4_usize, -3.0..3.0),
        |(row, k, power)| {
            let mut matrix = four().joint_from_motor * 10.0_f64.powf(power);
            let mix = row.transpose() * matrix;
            let others = mix - matrix.row(k) * row[k];
            matrix.set_row(k, &others);
            let mut config = four();
            config.joint_from_motor = matrix;
            let error = Controller::new(config)
                .map(|_| ())
                .map_err(|error| error.entry);
            prop_assert_eq!(error, Err("joint_from_motor"));
            // An invertible matrix of any magnitude is accepted.
            config.joint_from_motor = four().joint_from_motor * 10.0_f64.powf(power);
            prop_assert!(Controller::new(config).is_ok());
            Ok(())
        },
    );
}

/// With several invalid entries the first is named, a limit before the entries that it limits.
#[test]
fn an_invalid_limit_is_named_before_the_limited_entries() {
    refused("soft_zone_rad", None, f64::NAN, |config| {
        config.limits.soft_zone_rad = f64::NAN;
    });
    refused("stiffness limit", None, -5.0, |config| {
        config.limits.stiffness_n_per_m = -5.0;
    });
}
