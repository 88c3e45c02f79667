//! The paper's experiments: trajectory, scene, gains and duration of each.

use supple_core::Trajectory;
use supple_core::config::Gains;
use supple_core::trajectory::{Arc, Probe, Quadrant, Sinusoid};
use supple_plant::{FixedBlock, Layer, Scene};

/// Stiffness of the free-motion experiments \[N/m\].
pub const STIFFNESS_N_PER_M: f64 = 5.0;
/// Damping of the free-motion experiments \[N s/m\].
pub const DAMPING_N_S_PER_M: f64 = 1.5;
/// Stiffnesses of the probing runs \[N/m\].
pub const PROBING_STIFFNESS_N_PER_M: [f64; 9] =
    [0.5, 1.0, 2.0, 5.0, 25.0, 50.0, 75.0, 100.0, 125.0];
/// Stiffnesses of the paper's figure 5 \[N/m\], at which variants are run too.
pub const PAPER_STIFFNESS_N_PER_M: [f64; 2] = [5.0, 125.0];
/// Damping with which the error after a corner dies out within an edge at the paper's speed \[N s/m\].
pub const CORNER_DAMPING_N_S_PER_M: f64 = 15.0;
/// Time in which the speed falls and rises at a corner of the quadrant that has no velocity jumps \[s\].
pub const CORNER_RAMP_S: f64 = 0.3;
/// Apparent inertia of the runs that use the force sensor \[kg\].
pub const APPARENT_INERTIA_KG: f64 = 1.0;
/// Speed of the quadrant in the headline run \[m/s\].
pub const QUADRANT_SPEED_M_PER_S: f64 = 0.02 * core::f64::consts::PI;
/// Maximum commanded speed in the paper \[m/s\].
pub const QUADRANT_PAPER_SPEED_M_PER_S: f64 = 0.1 * core::f64::consts::PI;
/// Height of the block's face above the base frame \[m\].
pub const FACE_M: f64 = 0.0;
/// Length of the stroke before the cap meets the face \[m\].
const FACE_INTO_STROKE_M: f64 = 0.06;
/// Rest at the bottom of the stroke, over whose last half the force while pressing is averaged \[s\].
pub const PROBE_DWELL_S: f64 = 1.0;
/// Thickness of the rubber sheet \[m\].
const RUBBER_M: f64 = 0.005;
/// Number of columns of a probing run; the base rotates by one step between them.
const COLUMNS: u32 = 2;

/// Gains for a given stiffness \[N/m\]. The damping grows with the square root of the stiffness, from 1.5 N s/m
/// at 5 N/m, which keeps the damping ratio at the tip constant.
pub fn gains(stiffness_n_per_m: f64) -> Gains {
    let damping = DAMPING_N_S_PER_M * (stiffness_n_per_m / STIFFNESS_N_PER_M).sqrt();
    Gains::isotropic(stiffness_n_per_m, damping)
}

/// Two periods of the sinusoid of figure 3a, at `speed` times its speed. Returns trajectory and duration \[s\].
pub fn sinusoid(speed: f64) -> (Trajectory, f64) {
    let sinusoid = Sinusoid::paper(speed);
    let duration_s = 2.0 * sinusoid.period_s() + 0.5 * sinusoid.ramp_s;
    (Trajectory::Sinusoid(sinusoid), duration_s)
}

/// Two periods of an arc at 0.65 m from the base axis, which moves the base joint by 0.4 rad to both sides.
pub fn arc() -> (Trajectory, f64) {
    let arc = Arc {
        radius_m: 0.65,
        height_m: 0.0,
        centre_rad: 0.0,
        amplitude_rad: 0.4,
        angular_frequency_rad_per_s: core::f64::consts::FRAC_PI_4,
        ramp_s: 1.0,
    };
    let period_s = core::f64::consts::TAU / arc.angular_frequency_rad_per_s;
    (Trajectory::Arc(arc), 2.0 * period_s + 0.5 * arc.ramp_s)
}

/// Two rounds of the quadrant of figure 3b in the vertical plane. Its velocity jumps at the corners if
/// `corner_ramp_s` is zero, see [`Quadrant::with_corner_ramp`]. Returns quadrant and duration \[s\].
pub fn quadrant(speed_m_per_s: f64, corner_ramp_s: f64) -> (Quadrant, f64) {
    let quadrant = Quadrant::vertical(speed_m_per_s).with_corner_ramp(corner_ramp_s);
    let duration_s = 2.0 * quadrant.period_s() + 0.25;
    (quadrant, duration_s)
}

/// The probing cycle over the block for a cap of this radius: two columns of two strokes each. Returns probe
/// and duration \[s\].
pub fn probe(tip_radius_m: f64) -> (Probe, f64) {
    let probe = Probe {
        radius_m: 0.70,
        strokes: 2,
        radial_step_m: 6.67e-3,
        top_m: FACE_M + tip_radius_m + FACE_INTO_STROKE_M,
        stroke_m: 0.10,
        azimuth_rad: 0.0,
        azimuth_step_rad: 0.05,
        speed_m_per_s: 0.04,
        ramp_s: 0.25,
        dwell_s: PROBE_DWELL_S,
    };
    (probe, probe.column_s() * f64::from(COLUMNS))
}

/// The block with a sheet of rubber on its face, at the same height.
pub fn rubber_block() -> Scene {
    let mut scene = block();
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

/// The wooden block beneath the probing cycle.
pub fn block() -> Scene {
    Scene {
        fixed_blocks: vec![FixedBlock {
            name: "block".to_owned(),
            center_m: [0.70, 0.0, FACE_M - 0.05],
            size_m: [0.20, 0.40, 0.10],
            rpy_rad: [0.0; 3],
            material: "wood".to_owned(),
            layer: None,
        }],
        ..Scene::default()
    }
}
