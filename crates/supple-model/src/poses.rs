//! Evenly spread poses of an arm.

use supple_core::{Config, Vector};

/// Returns one of the evenly spread poses over the joint ranges; a range wider than one turn counts as one turn.
pub(crate) fn pose_rad<const N: usize>(config: &Config<N>, pose: u32) -> Vector<N> {
    const ROOTS: [f64; 7] = [
        core::f64::consts::SQRT_2,
        1.732_050_807_568_877_2,
        2.236_067_977_499_79,
        2.645_751_311_064_590_7,
        3.316_624_790_355_4,
        3.605_551_275_463_989,
        4.123_105_625_617_661,
    ];
    Vector::from_fn(|joint, _| {
        let turn = core::f64::consts::PI;
        let lower = config.limits.position_lower_rad[joint].max(-turn);
        let upper = config.limits.position_upper_rad[joint].min(turn).max(lower);
        let multiple = f64::from(pose + 1) * ROOTS[joint % ROOTS.len()];
        lower + (multiple - multiple.floor()) * (upper - lower)
    })
}
