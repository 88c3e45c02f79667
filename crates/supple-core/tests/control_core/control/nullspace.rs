//! Damping in the null space of the position task, with the delay of the loop.

use crate::support::configs::{four, seven_active};
use crate::support::inverse;
use crate::support::property::{check, per_joint};
use proptest::prelude::*;
use supple_core::config::{Config, Role};
use supple_core::dynamics::crba;
use supple_core::{Controller, Vector};

/// `B delay / mass` at which damping with a delayed velocity is no longer stable.
const STABILITY_LIMIT: f64 = core::f64::consts::FRAC_PI_2;

fn stays_stable<const N: usize>(config: Config<N>) -> Vector<N> {
    let controller = Controller::new(config).expect("a valid configuration");
    let damping = *controller.nullspace_damping_nm_s_per_rad();
    check(300, per_joint::<N>(1.0), |share| {
        let q = config.limits.position_upper_rad.component_mul(&share);
        let mass = crba(&config.arm, &q);
        let inverse = inverse(&mass);
        let root = damping.map(f64::sqrt);
        let rate_per_s = Vector::<N>::from_fn(|i, _| {
            // The greatest eigenvalue is at most the greatest sum of a row.
            (0..N)
                .map(|j| (root[i] * inverse[(i, j)] * root[j]).abs())
                .sum()
        });
        prop_assert!(
            rate_per_s.max() * controller.delay_s() < STABILITY_LIMIT,
            "{} at {q}",
            rate_per_s.max() * controller.delay_s()
        );
        Ok(())
    });
    damping
}

#[test]
fn the_delay_limits_the_damping_of_light_joints() {
    let config = seven_active();
    let damping = stays_stable(config);
    let wanted = config.law.nullspace_damping_nm_s_per_rad;
    assert!(damping[6] < 0.1 * wanted, "{damping}");
    assert!(damping[0] > 0.5 * wanted, "{damping}");
}

#[test]
fn heavy_joints_have_the_damping_of_the_law() {
    let config = Config {
        roles: [Role::Active; 4],
        ..four()
    };
    let damping = stays_stable(config);
    assert!(
        damping[0] == config.law.nullspace_damping_nm_s_per_rad,
        "{damping}"
    );
}
