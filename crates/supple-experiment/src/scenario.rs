//! The paper's experiments: trajectory, scene, gains and duration of each.

use supple_core::Trajectory;
use supple_core::config::Gains;
use supple_core::trajectory::{Probe, Quadrant};
pub use supple_model::PROBE_DWELL_S;
use supple_model::Paths;
use supple_plant::{FixedBlock, Layer, Scene};

/// Stiffness of the free-motion experiments \[N/m\].
pub const STIFFNESS_N_PER_M: f64 = 5.0;
/// Damping of the free-motion experiments \[N s/m\].
pub const DAMPING_N_S_PER_M: f64 = 1.5;
/// Stiffnesses of the probing runs \[N/m\].
pub const PROBING_STIFFNESS_N_PER_M: [f64; 9] =
    [0.5, 1.0, 2.0, 5.0, 25.0, 50.0, 75.0, 100.0, 125.0];
/// Stiffnesses of the paper's figure 5 \[N/m\], at which variants also run.
pub const PAPER_STIFFNESS_N_PER_M: [f64; 2] = [5.0, 125.0];
/// Damping with which the error after a corner decays within one segment at the paper's speed \[N s/m\].
pub const CORNER_DAMPING_N_S_PER_M: f64 = 15.0;
/// Time in which the speed falls and rises at a corner of the quadrant without velocity jumps \[s\].
pub const CORNER_RAMP_S: f64 = 0.3;
/// Apparent inertia of the runs that use the force sensor \[kg\].
pub const APPARENT_INERTIA_KG: f64 = 1.0;
/// Speed of the quadrant in the main run \[m/s\].
pub const QUADRANT_SPEED_M_PER_S: f64 = 0.02 * core::f64::consts::PI;
/// Maximum commanded speed in the paper \[m/s\].
pub const QUADRANT_PAPER_SPEED_M_PER_S: f64 = 0.1 * core::f64::consts::PI;
/// Height of the block's face above the base frame \[m\].
pub const FACE_M: f64 = 0.0;
/// Thickness of the rubber sheet \[m\].
const RUBBER_M: f64 = 0.005;

/// Returns the allowed error on the sinusoid at 5 N/m with the model errors of [`crate::Mismatch::identified`] \[m\], for an arm
/// of this weight at the tip \[N\]: 15 mm, and in proportion more for an arm that is heavier at the tip than the WAM (23 N). A
/// force error of the gravity model moves the tip by that error over the stiffness.
pub fn allowed_error_m(tip_weight_n: f64) -> f64 {
    const ALLOWED_M: f64 = 0.015;
    const WAM_N: f64 = 23.0;
    ALLOWED_M * (tip_weight_n / WAM_N).max(1.0)
}

/// Returns gains for a given stiffness \[N/m\]. The damping grows with the square root of the stiffness, from 1.5 N s/m
/// at 5 N/m, which keeps the damping ratio at the tip constant.
pub fn gains(stiffness_n_per_m: f64) -> Gains {
    let damping = DAMPING_N_S_PER_M * (stiffness_n_per_m / STIFFNESS_N_PER_M).sqrt();
    Gains::isotropic(stiffness_n_per_m, damping)
}

/// Returns gains for a given stiffness \[N/m\] with the damping ratio that `law` has along base axis x; for the paper's law these
/// are the gains of [`gains`].
pub fn gains_like(law: &Gains, stiffness_n_per_m: f64) -> Gains {
    let (stiffness, damping) = (law.stiffness_n_per_m.x, law.damping_n_s_per_m.x);
    if stiffness <= 0.0 {
        return gains(stiffness_n_per_m);
    }
    let damping = damping * (stiffness_n_per_m / stiffness).sqrt();
    Gains::isotropic(stiffness_n_per_m, damping)
}

/// Returns two periods of the sinusoid of figure 3a at the place of the paper, see [`Paths::sinusoid`].
pub fn sinusoid(speed: f64) -> (Trajectory, f64) {
    Paths::PAPER.sinusoid(speed)
}

/// Returns two periods of an arc at 0.65 m from the base axis, which moves the base joint by 0.4 rad to both sides.
pub fn arc() -> (Trajectory, f64) {
    Paths::PAPER.arc(1.0)
}

/// Returns two laps of the quadrant of figure 3b in the vertical plane: quadrant and duration \[s\].
pub fn quadrant(speed_m_per_s: f64) -> (Quadrant, f64) {
    Paths::PAPER.quadrant(speed_m_per_s)
}

/// Returns the probing cycle over the block for a cap of this radius, two columns of two strokes each: probe
/// and duration \[s\].
pub fn probe(tip_radius_m: f64) -> (Probe, f64) {
    Paths::PAPER.probe(tip_radius_m)
}

/// Returns the block of [`block_at`] with a sheet of rubber on its face, at the same height.
pub fn rubber_block_at(paths: &Paths) -> Scene {
    let mut scene = block_at(paths);
    for block in &mut scene.fixed_blocks {
        // The layer lies on top of the block.
        block.center_m[2] -= RUBBER_M;
        block.layer = Some(Layer {
            thickness_m: RUBBER_M,
            material: "rubber".to_owned(),
        });
    }
    scene
}

/// Returns the wooden block beneath the probing cycle.
pub fn block() -> Scene {
    block_at(&Paths::PAPER)
}

/// Returns the wooden block beneath the probing cycle of an arm with these paths.
pub fn block_at(paths: &Paths) -> Scene {
    let mut block = FixedBlock {
        name: "block".to_owned(),
        center_m: [0.70, 0.0, FACE_M - 0.05],
        size_m: [0.20, 0.40, 0.10],
        rpy_rad: [0.0; 3],
        material: "wood".to_owned(),
        layer: None,
    };
    if *paths != Paths::PAPER {
        let (probe, _) = paths.probe(0.0);
        let centre_m = paths.outward() * probe.radius_m;
        block.size_m = block.size_m.map(|length_m| length_m * paths.scale);
        block.center_m = [
            centre_m.x,
            centre_m.y,
            paths.face_m() - 0.5 * block.size_m[2],
        ];
        block.rpy_rad[2] = paths.azimuth_rad;
    }
    Scene {
        fixed_blocks: vec![block],
        ..Scene::default()
    }
}
