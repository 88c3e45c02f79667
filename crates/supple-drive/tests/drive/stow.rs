//! Tests of laying down: limit of the spring torque.

use supple_core::Vector;
use supple_core::dynamics::gravity;
use supple_drive::{StowConfig, Stowing};
use supple_model::Description;

fn stowing(stow_rad: Vector<4>) -> (Stowing<4>, Vector<4>) {
    let config = Description::asset("wam4").unwrap().config::<4>().unwrap();
    let pose_rad = Vector::from([0.1, 0.4, 0.0, 1.2]);
    let mut stowing = Stowing::new(
        config.arm,
        StowConfig {
            stow_rad: Some(stow_rad),
            damping_nm_s_per_rad: Vector::repeat(1.0),
            stiffness_nm_per_rad: Vector::repeat(50.0),
            speed_rad_per_s: 0.4,
            hold_s: 0.5,
        },
    );
    stowing.observe(&core::array::from_fn(|joint| Some(pose_rad[joint])));
    (stowing, gravity(&config.arm, &pose_rad))
}

/// The reference continues while the arm is blocked: the spring torque is limited to that of 0.2 rad.
#[test]
fn the_spring_torque_on_a_blocked_arm_is_limited() {
    let (mut stowing, gravity_nm) = stowing(Vector::zeros());
    let mut max = 0.0_f64;
    for ms in 0..5000 {
        let torque_nm = stowing.stow_nm(f64::from(ms) * 1e-3);
        // The checks end with the reference: afterwards the torque fades.
        if f64::from(ms) * 1e-3 < 1.875 * 1.2 / 0.4 {
            max = max.max((torque_nm - gravity_nm).amax());
        }
    }
    assert!(max > 9.9 && max < 10.0 + 1e-9, "{max} N m");
}
