//! Friction, Eq. (3.2): continuity, slopes, symmetry, passivity, and the discontinuity of the
//! printed form.

use crate::support::settings::config;
use proptest::prelude::*;
use supple_core::Friction;
use supple_core::friction::LoadTorque;

/// Parameters of the paper's shoulder pitch.
const SHOULDER: Friction = Friction::coulomb(1.9823, 1.4985);
const BAND: f64 = SHOULDER.band_rad_per_s;

const WITH_DIP: Friction = Friction {
    breakaway_nm: 2.1,
    stribeck_rad_per_s: 0.05,
    ..SHOULDER
};

fn any_friction() -> impl Strategy<Value = Friction> {
    (
        0.0..3.0,
        0.0..3.0,
        0.0..2.0,
        0.005..0.5,
        -1.0..1.0,
        0.001..0.1,
        // Up to three quarters of `V`, friction grows with speed in the band also without Coulomb friction.
        -0.7..0.7,
        -1.0..1.0,
    )
        .prop_map(
            |(viscous, coulomb, dip, stribeck, offset, band, asymmetry, at_rest)| Friction {
                viscous_nm_s_per_rad: viscous,
                viscous_asymmetry_nm_s_per_rad: viscous * asymmetry,
                coulomb_nm: coulomb,
                breakaway_nm: coulomb + dip,
                stribeck_rad_per_s: stribeck,
                offset_nm: offset,
                // A sum rounds.
                stribeck_offset_nm: 0.999 * dip * at_rest,
                band_rad_per_s: band,
                ..Friction::NONE
            },
        )
}

/// One-sided difference quotient: towards larger speeds if `h > 0`.
fn one_sided_slope(friction: &Friction, v: f64, h: f64) -> f64 {
    let d = |k: f64| friction.torque_nm(v + k * h);
    (-3.0 * d(0.0) + 4.0 * d(1.0) - d(2.0)) / (2.0 * h)
}

#[track_caller]
fn close(found: f64, expected: f64, tolerance: f64) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{found}, expected {expected}"
    );
}

#[test]
fn equals_coulomb_and_viscous_friction_at_the_edge_of_the_band() {
    let Friction {
        viscous_nm_s_per_rad: v,
        coulomb_nm: s,
        ..
    } = SHOULDER;
    let h = 1e-6 * BAND;
    for sign in [1.0, -1.0] {
        let edge = sign * BAND;
        close(SHOULDER.torque_nm(edge) - v * edge, sign * s, 1e-15);
        close(one_sided_slope(&SHOULDER, edge, h), v, 1e-6);
        close(one_sided_slope(&SHOULDER, edge, -h), v, 1e-6);
    }
    close(SHOULDER.torque_nm(0.0), 0.0, 0.0);
    close(
        one_sided_slope(&SHOULDER, 0.0, h),
        v + 2.0 * s / BAND,
        1e-6 * s / BAND,
    );
    close(
        one_sided_slope(&SHOULDER, 0.0, -h),
        v + 2.0 * s / BAND,
        1e-6 * s / BAND,
    );
    close(SHOULDER.torque_nm(1.5), v * 1.5 + s, 1e-15);
    close(SHOULDER.torque_nm(-1.5), -v * 1.5 - s, 1e-15);
}

/// The inner branch of (3.2) as printed gives `3 S` at the edge of the band, where the outer branch
/// gives `S`: therefore the sign of the parabola is reversed in this project.
#[test]
fn the_printed_parabola_jumps_by_twice_the_coulomb_torque() {
    let Friction {
        viscous_nm_s_per_rad: v,
        coulomb_nm: s,
        ..
    } = SHOULDER;
    let printed = |qd: f64| v * qd + s / BAND * (qd.signum() * qd * qd / BAND + 2.0 * qd);
    let outside = SHOULDER.torque_nm(BAND * (1.0 + 1e-9));
    close(printed(BAND) - outside, 2.0 * s, 1e-8);
    close(SHOULDER.torque_nm(BAND) - outside, 0.0, 1e-8);
    // Both have the same slope at rest: they differ only in the square.
    let h = 1e-9 * BAND;
    close(printed(h) / h, SHOULDER.torque_nm(h) / h, 1e-6 * s / BAND);
}

#[test]
fn stribeck_friction_falls_from_breakaway_to_coulomb() {
    let without_viscous = Friction {
        viscous_nm_s_per_rad: 0.0,
        ..WITH_DIP
    };
    let narrow = Friction {
        band_rad_per_s: 1e-6,
        ..without_viscous
    };
    close(narrow.torque_nm(1e-6), WITH_DIP.breakaway_nm, 1e-8);
    close(narrow.torque_nm(10.0 * 0.05), WITH_DIP.coulomb_nm, 1e-12);
    let at_stribeck = WITH_DIP.coulomb_nm + 0.6015 * (-1.0_f64).exp();
    close(without_viscous.torque_nm(0.05), at_stribeck, 1e-12);
    // Stribeck effect: the torque falls with speed between the two.
    assert!(without_viscous.torque_nm(0.03) > without_viscous.torque_nm(0.06));
}

#[test]
fn no_friction_has_zero_torque() {
    for v in [-3.0, -0.005, 0.0, 0.005, 3.0] {
        assert_eq!(Friction::NONE.torque_nm(v), 0.0);
    }
    assert_eq!(Friction::NONE.validate(), Ok(()));
}

proptest! {
    #![proptest_config(config(256, 20_260_103))]

    #[test]
    fn is_odd_about_its_offset_and_asymmetry(friction in any_friction(), v in -3.0..3.0) {
        let asymmetry = friction.viscous_asymmetry_nm_s_per_rad;
        let asymmetric = |v| asymmetry * v * friction.direction(v);
        let centred = |v| friction.torque_nm(v) - friction.offset_at_nm(v) - asymmetric(v);
        prop_assert!((centred(v) + centred(-v)).abs() <= 1e-14);
        let inside = v * friction.band_rad_per_s / 3.0;
        prop_assert!((centred(inside) + centred(-inside)).abs() <= 1e-14);
    }

    #[test]
    fn friction_is_dissipative(friction in any_friction(), v in -3.0..3.0) {
        for v in [v, v * friction.band_rad_per_s, 0.0] {
            let dissipated_w = v * (friction.torque_nm(v) - friction.offset_at_nm(v));
            prop_assert!(dissipated_w >= -1e-15, "{dissipated_w} W at {v} rad/s");
        }
    }

    #[test]
    fn grows_with_speed_without_stribeck_effect(
        friction in any_friction(),
        slow in -3.0..3.0,
        more in 0.0..1.0,
    ) {
        let friction = Friction { breakaway_nm: friction.coulomb_nm, stribeck_offset_nm: 0.0, ..friction };
        for (slow, more) in [(slow, more), (slow * friction.band_rad_per_s, more * 1e-3)] {
            let gain = friction.torque_nm(slow + more) - friction.torque_nm(slow);
            prop_assert!(gain >= -1e-14, "{gain} N m");
        }
    }

    /// The slopes from both sides are equal at the edges of the band, at rest and anywhere else.
    #[test]
    fn is_smooth_across_the_band(friction in any_friction(), elsewhere in -2.0..2.0) {
        let band = friction.band_rad_per_s;
        for v in [-band, 0.0, band, elsewhere * band, elsewhere] {
            // Second-order one-sided slopes: their error is the third derivative times h^2, plus
            // the jump of the second derivative, 2 S_0 / band^2, times h.
            let h = 1e-6 * band.min(friction.stribeck_rad_per_s);
            let left = one_sided_slope(&friction, v, -h);
            let right = one_sided_slope(&friction, v, h);
            let steepest = 2.0 * friction.breakaway_nm / band
                + (friction.breakaway_nm + friction.stribeck_offset_nm.abs()) / friction.stribeck_rad_per_s;
            let allowed = 1e-5 * (1.0 + steepest) + 4e-15 / h;
            prop_assert!((left - right).abs() <= allowed, "{left} and {right} at {v} rad/s");
        }
    }

    #[test]
    fn valid_friction_is_accepted(friction in any_friction()) {
        prop_assert_eq!(friction.validate(), Ok(()));
    }
}

#[test]
fn invalid_friction_is_rejected() {
    type Entry = (&'static str, fn(&mut Friction, f64), &'static [f64]);
    const NAN: f64 = f64::NAN;
    const INF: f64 = f64::INFINITY;
    let entries: [Entry; 11] = [
        (
            "viscous_nm_s_per_rad",
            |f, x| f.viscous_nm_s_per_rad = x,
            &[-0.1, NAN, INF],
        ),
        (
            "viscous_asymmetry_nm_s_per_rad",
            |f, x| f.viscous_asymmetry_nm_s_per_rad = x,
            &[1.983, -1.983, NAN, INF],
        ),
        ("coulomb_nm", |f, x| f.coulomb_nm = x, &[-0.1, NAN, INF]),
        (
            "breakaway_nm",
            |f, x| f.breakaway_nm = x,
            &[1.4, -0.1, NAN, INF],
        ),
        (
            "stribeck_rad_per_s",
            |f, x| f.stribeck_rad_per_s = x,
            &[0.0, -0.1, NAN, INF],
        ),
        ("offset_nm", |f, x| f.offset_nm = x, &[NAN, INF, -INF]),
        (
            "stribeck_offset_nm",
            |f, x| f.stribeck_offset_nm = x,
            &[0.61, -0.61, NAN, INF, -INF],
        ),
        (
            "band_rad_per_s",
            |f, x| f.band_rad_per_s = x,
            &[0.0, -0.1, NAN, INF],
        ),
        (
            "presliding_rad",
            |f, x| f.presliding_rad = x,
            &[-0.1, NAN, INF],
        ),
        (
            "load_coefficient",
            |f, x| f.load_coefficient = x,
            &[-0.1, 0.51, NAN, INF],
        ),
        (
            "coulomb_at_nm",
            |f, x| f.coulomb_at_nm = x,
            &[-0.1, NAN, INF],
        ),
    ];
    for (entry, spoil, values) in entries {
        for &value in values {
            let mut friction = WITH_DIP;
            spoil(&mut friction, value);
            let error = friction.validate().expect_err(entry);
            assert_eq!(error.entry, entry);
            let text = error.to_string();
            let start = format!("{entry} is {value}, it must be f");
            assert!(text.starts_with(&start), "{text:?} against {start:?}");
        }
    }
}

/// Without a motor's torque there would be dry friction below zero.
#[test]
fn friction_below_zero_without_load_is_rejected() {
    let law = |coulomb_at_nm: f64| Friction {
        load_coefficient: 0.5,
        coulomb_at_nm,
        ..WITH_DIP
    };
    assert_eq!(law(2.0 * WITH_DIP.coulomb_nm).validate(), Ok(()));
    let error = law(2.1 * WITH_DIP.coulomb_nm).validate().unwrap_err();
    assert_eq!(error.entry, "coulomb_nm");
    assert!(
        error
            .to_string()
            .contains("load_coefficient times coulomb_at_nm")
    );
}

const WITH_LOAD: Friction = Friction {
    load_coefficient: 0.1,
    load_torque: LoadTorque::Motor,
    coulomb_at_nm: 4.0,
    breakaway_nm: WITH_DIP.coulomb_nm,
    offset_nm: 0.0,
    ..WITH_DIP
};

/// The sliding dry friction is the dry friction without load plus the coefficient times the motor's torque, which overcomes load
/// and friction.
#[test]
fn dry_friction_grows_with_the_torque_of_the_motor() {
    let unloaded_nm = WITH_LOAD.coulomb_nm - 0.1 * 4.0;
    for load_nm in [-9.0, -1.5, -0.3, 0.0, 0.4, 1.0, 1.1, 3.0, 12.0] {
        let loaded = WITH_LOAD.at_load(load_nm);
        assert_eq!(loaded.validate(), Ok(()));
        for v in [-1.0, -0.03, 0.02, 0.7] {
            let dry_nm = loaded.torque_nm(v) - loaded.viscous_torque_nm(v);
            let motor_nm = load_nm + dry_nm;
            let expected_nm = (unloaded_nm + 0.1 * motor_nm.abs()) * f64::signum(v);
            close(dry_nm, expected_nm, 1e-12);
        }
    }
    assert_eq!(WITH_DIP.at_load(9.0), WITH_DIP);
    let of_joint = Friction {
        load_torque: LoadTorque::Joint,
        ..WITH_LOAD
    };
    for load_nm in [-9.0, 0.0, 4.0] {
        let loaded = of_joint.at_load(load_nm);
        close(loaded.coulomb_nm, unloaded_nm + 0.1 * load_nm.abs(), 1e-12);
        close(loaded.offset_nm, 0.0, 1e-12);
    }
}

/// The motor's torque also overcomes the viscous friction, in both directions of a load that is greater than all friction.
#[test]
fn viscous_friction_is_part_of_the_torque_of_the_motor() {
    let law = Friction {
        viscous_asymmetry_nm_s_per_rad: 0.3,
        ..WITH_LOAD
    };
    let unloaded_nm = law.coulomb_nm - 0.1 * 4.0;
    for load_nm in [-9.0, 7.0] {
        let loaded = law.at_load(load_nm);
        assert_eq!(loaded.validate(), Ok(()));
        for v in [-1.0, -0.03, 0.02, 0.7] {
            let friction_nm = loaded.torque_nm(v);
            let size_nm = (1.9823 + 0.3 * v.signum()) * v.abs() + unloaded_nm;
            let expected_nm = size_nm + 0.1 * (load_nm + friction_nm).abs();
            close(friction_nm, expected_nm * v.signum(), 1e-12);
        }
    }
    // The torque is continuous over the load.
    for v in [-0.5, 0.3] {
        let torque_nm = |load_nm: f64| law.at_load(load_nm).torque_nm(v);
        for k in -300..300 {
            let load_nm = 0.02 * f64::from(k);
            let step_nm = torque_nm(load_nm + 0.02) - torque_nm(load_nm);
            // Friction grows by less than half of the step of the load.
            assert!(step_nm.abs() < 0.01, "{step_nm} N m at {load_nm} N m");
        }
    }
}

#[test]
fn scaled_dry_friction_is_scaled_without_load() {
    for factor in [0.5, 1.3, 0.0] {
        let scaled = WITH_LOAD.with_dry_scaled(factor);
        assert_eq!(scaled.validate(), Ok(()));
        close(scaled.coulomb_nm, factor * WITH_LOAD.coulomb_nm, 1e-12);
        close(scaled.load_coefficient, factor * 0.1, 1e-12);
        assert_eq!(scaled.viscous_nm_s_per_rad, WITH_LOAD.viscous_nm_s_per_rad);
    }
}

/// What yields in presliding has a stiffness that does not depend on the load: friction starts to reverse with the same slope.
#[test]
fn presliding_has_the_same_stiffness_at_every_load() {
    let law = Friction {
        presliding_rad: 1e-3,
        ..WITH_LOAD
    };
    let stiffness_nm_per_rad = |load_nm: f64| {
        let loaded = law.at_load(load_nm);
        let travel_rad = 1e-9;
        loaded.coulomb_nm * (1.0 + loaded.direction_after(-1.0, travel_rad)) / travel_rad
    };
    let expected = stiffness_nm_per_rad(0.0);
    for load_nm in [-12.0, -3.0, 0.7, 5.0, 30.0] {
        close(stiffness_nm_per_rad(load_nm) / expected, 1.0, 1e-6);
    }
    assert_eq!(
        WITH_DIP.at_load(9.0).presliding_rad,
        WITH_DIP.presliding_rad
    );
    // Without a load this one has no dry friction; its direction is still a number.
    let none = Friction {
        coulomb_nm: 0.4,
        breakaway_nm: 0.4,
        ..law
    };
    assert_eq!(none.at_load(0.0).coulomb_nm, 0.0);
    let direction = |travel_rad: f64| none.at_load(0.0).direction_after(0.3, travel_rad);
    close(direction(0.0), 0.3, 1e-12);
    close(direction(-1e-3), -1.0, 1e-12);
}

const WITH_TRAVEL: Friction = Friction {
    presliding_rad: 1e-3,
    ..WITH_DIP
};

/// The direction depends only on the distance, not on the steps into which it is divided, and tends to the direction of the
/// motion.
#[test]
fn direction_after_a_reversal_depends_only_on_the_distance() {
    let law = WITH_TRAVEL;
    for from in [-1.0, -0.3, 0.0, 0.8] {
        for travel in [2e-4, 1e-3, -7e-4] {
            let once = law.direction_after(from, travel);
            let twice = law.direction_after(law.direction_after(from, 0.3 * travel), 0.7 * travel);
            close(once, twice, 1e-12);
            assert!(once.abs() <= 1.0);
        }
        close(law.direction_after(from, 0.02), 1.0, 1e-7);
        close(law.direction_after(from, -0.02), -1.0, 1e-7);
    }
    // In steady sliding the law is the same with and without presliding.
    let (sliding, v) = (law.direction_after(0.0, 0.1), 0.2);
    close(
        law.torque_in_direction_nm(v, sliding, 1.0),
        WITH_DIP.torque_nm(v),
        1e-12,
    );
}

/// Over any closed motion presliding removes energy.
#[test]
fn presliding_removes_energy() {
    for size_rad in [1e-4, 5e-4, 2e-3, 2e-2] {
        let (mut direction, mut last, mut energy) = (0.0, 0.0_f64, 0.0);
        for k in 1..=20_000 {
            let at = size_rad * (f64::from(k) * core::f64::consts::TAU / 1000.0).sin();
            let travel = at - last;
            let before = direction;
            direction = WITH_TRAVEL.direction_after(direction, travel);
            energy += 0.5 * (before + direction) * travel;
            last = at;
        }
        assert!(energy > 0.0, "{size_rad}: {energy}");
    }
}
