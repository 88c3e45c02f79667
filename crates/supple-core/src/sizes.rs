//! Compiles the generic code once, in this crate, for each number of joints that `supple_model::with_dof` accepts. At
//! optimisation levels 0, 1, s and z crates share compiled generic code; enabled debug assertions indicate these levels (`dev`,
//! `test`). At other levels each crate compiles the generic code that it uses, and this module is left out.

use crate::codes::RequestCode;
use crate::controller::{Controller, CycleRecord, State, check_motion, limit, step};
use crate::dynamics::inverse_kinematics::inverse_kinematics;
use crate::dynamics::{
    aba, coriolis, coriolis_matrix, crba, gravity, jacobian, jacobian_dot_qd, joint_poses,
    kinetic_energy, momentum, potential_energy, regressor, rnea, terms, tip_pose,
};
use core::hint::black_box;

/// Is never called; rustc compiles the functions that it names, and all functions that these call.
fn compile<const N: usize>() {
    black_box([
        step::<N> as *const (),
        Controller::<N>::new as *const (),
        State::<N>::new as *const (),
        CycleRecord::<N>::new as *const (),
        CycleRecord::<N>::pack as *const (),
        CycleRecord::<N>::unpack as *const (),
        RequestCode::new::<N> as *const (),
        RequestCode::request::<N> as *const (),
        check_motion::<N> as *const (),
        limit::<N> as *const (),
        aba::<N> as *const (),
        coriolis::<N> as *const (),
        coriolis_matrix::<N> as *const (),
        crba::<N> as *const (),
        gravity::<N> as *const (),
        inverse_kinematics::<N> as *const (),
        jacobian::<N> as *const (),
        jacobian_dot_qd::<N> as *const (),
        joint_poses::<N> as *const (),
        kinetic_energy::<N> as *const (),
        momentum::<N> as *const (),
        potential_energy::<N> as *const (),
        regressor::<N> as *const (),
        rnea::<N> as *const (),
        terms::<N> as *const (),
        tip_pose::<N> as *const (),
    ]);
}

/// One for each number of joints.
pub static COMPILED: [fn(); 5] = [
    compile::<3>,
    compile::<4>,
    compile::<5>,
    compile::<6>,
    compile::<7>,
];
