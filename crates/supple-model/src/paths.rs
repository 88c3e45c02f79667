//! The paper's trajectories, placed and scaled to an arm.

use crate::settings::PathSettings;
use core::f64::consts::{FRAC_PI_4, TAU};
use serde::Serialize;
use supple_core::Trajectory;
use supple_core::math::{Vector3, sin_cos};
use supple_core::trajectory::{Arc, Probe, Quadrant, Sinusoid};

/// Centre of the paper's sinusoid, to which all other lengths below are relative \[m\].
const CENTRE_M: f64 = 0.6;
/// Rest at the bottom of a probing stroke \[s\]; the pressing force is averaged over its last half second.
pub const PROBE_DWELL_S: f64 = 1.0;
/// Length of the stroke before the cap meets the face \[m\].
const FACE_INTO_STROKE_M: f64 = 0.06;
/// Number of columns of a probing run; the base rotates by one step between them.
const COLUMNS: u32 = 2;

/// Place and size of the paper's trajectories in the arm's workspace. Lengths and speeds are those of the paper times `scale`;
/// durations are those of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Paths {
    /// Distance of their centre from the base's vertical axis \[m\].
    pub radius_m: f64,
    /// Direction of their centre about that axis \[rad\].
    pub azimuth_rad: f64,
    /// Height of their centre above the base frame \[m\].
    pub height_m: f64,
    /// Their lengths as a multiple of the paper's.
    pub scale: f64,
}

impl From<PathSettings> for Paths {
    fn from(given: PathSettings) -> Paths {
        Paths {
            radius_m: given.radius_m,
            azimuth_rad: given.azimuth_rad,
            height_m: given.height_m,
            scale: given.scale,
        }
    }
}

impl Paths {
    /// Place and size of the paper.
    pub const PAPER: Paths = Paths {
        radius_m: CENTRE_M,
        azimuth_rad: 0.0,
        height_m: 0.0,
        scale: 1.0,
    };

    /// Returns the unit vector from the base's vertical axis to the centre.
    pub fn outward(&self) -> Vector3<f64> {
        let (sin, cos) = sin_cos(self.azimuth_rad);
        Vector3::new(cos, sin, 0.0)
    }

    /// Returns the point that is `out_m` beyond and `up_m` above the centre in the paper \[m\].
    fn point_m(&self, out_m: f64, up_m: f64) -> Vector3<f64> {
        let radius_m = self.radius_m + self.scale * out_m;
        let height_m = self.height_m + self.scale * up_m;
        self.outward() * radius_m + Vector3::z() * height_m
    }

    /// Returns two periods of the sinusoid of figure 3a at `speed` times its speed: trajectory and duration \[s\].
    pub fn sinusoid(&self, speed: f64) -> (Trajectory, f64) {
        let mut sinusoid = Sinusoid::paper(speed);
        if *self != Paths::PAPER {
            let amplitude_m = sinusoid.amplitude_m.x * self.scale;
            sinusoid.centre_m = self.point_m(0.0, 0.0);
            sinusoid.amplitude_m = self.outward() * amplitude_m;
        }
        let duration_s = 2.0 * sinusoid.period_s() + 0.5 * sinusoid.ramp_s;
        (Trajectory::Sinusoid(sinusoid), duration_s)
    }

    /// Returns two periods of an arc about the base's vertical axis, 0.05 m beyond the centre, at `speed` times 0.2 m/s:
    /// trajectory and duration \[s\]. With the centre of the paper, the arc moves the base joint by 0.4 rad to both sides.
    pub fn arc(&self, speed: f64) -> (Trajectory, f64) {
        let mut arc = Arc {
            radius_m: 0.65,
            height_m: self.height_m,
            centre_rad: self.azimuth_rad,
            amplitude_rad: 0.4,
            angular_frequency_rad_per_s: FRAC_PI_4,
            ramp_s: 1.0,
        };
        if speed != 1.0 {
            arc.angular_frequency_rad_per_s *= speed;
            arc.ramp_s /= speed;
        }
        if *self != Paths::PAPER {
            let length_m = arc.radius_m * arc.amplitude_rad * self.scale;
            arc.radius_m = self.radius_m + 0.05 * self.scale;
            arc.amplitude_rad = length_m / arc.radius_m;
        }
        let period_s = TAU / arc.angular_frequency_rad_per_s;
        (Trajectory::Arc(arc), 2.0 * period_s + 0.5 * arc.ramp_s)
    }

    /// Returns two laps of the quadrant of figure 3b in the vertical plane: quadrant and duration \[s\]. `speed_m_per_s` is the
    /// speed at the paper's size.
    pub fn quadrant(&self, speed_m_per_s: f64) -> (Quadrant, f64) {
        let mut quadrant = Quadrant::vertical(speed_m_per_s);
        if *self != Paths::PAPER {
            let corner = quadrant.centre_m();
            quadrant = Quadrant::new(
                self.point_m(corner.x - CENTRE_M, corner.z),
                self.outward() * (quadrant.first_m().x * self.scale),
                quadrant.second_m() * self.scale,
                speed_m_per_s * self.scale,
                quadrant.ramp_s(),
            );
        }
        let duration_s = 2.0 * quadrant.period_s() + 0.25;
        (quadrant, duration_s)
    }

    /// Returns the height of the face that the probing cycle touches \[m\].
    pub fn face_m(&self) -> f64 {
        self.height_m
    }

    /// Returns the probing cycle over the block for a cap of this radius, two columns of two strokes each: probe and
    /// duration \[s\].
    pub fn probe(&self, tip_radius_m: f64) -> (Probe, f64) {
        let mut probe = Probe {
            radius_m: 0.70,
            strokes: 2,
            radial_step_m: 6.67e-3,
            top_m: self.face_m() + tip_radius_m + FACE_INTO_STROKE_M,
            stroke_m: 0.10,
            azimuth_rad: self.azimuth_rad,
            azimuth_step_rad: 0.05,
            speed_m_per_s: 0.04,
            ramp_s: 0.25,
            dwell_s: PROBE_DWELL_S,
        };
        if *self != Paths::PAPER {
            let step_m = probe.azimuth_step_rad * probe.radius_m * self.scale;
            probe.radius_m = self.radius_m + (probe.radius_m - CENTRE_M) * self.scale;
            probe.azimuth_step_rad = step_m / probe.radius_m;
            probe.radial_step_m *= self.scale;
            probe.top_m = self.face_m() + tip_radius_m + FACE_INTO_STROKE_M * self.scale;
            probe.stroke_m *= self.scale;
            probe.speed_m_per_s *= self.scale;
        }
        (probe, probe.column_s() * f64::from(COLUMNS))
    }
}

#[cfg(test)]
mod tests {
    use super::Paths;
    use supple_core::Trajectory;

    /// At twice the speed, the point of the arc at a time equals the point of the slow arc at twice that time, and the duration
    /// is half.
    #[test]
    fn an_arc_at_twice_the_speed_is_the_same_path() {
        let placed = Paths {
            radius_m: 0.4,
            azimuth_rad: 0.7,
            height_m: 0.3,
            scale: 0.5,
        };
        for paths in [Paths::PAPER, placed] {
            let ((once, duration_s), (twice, shorter_s)) = (paths.arc(1.0), paths.arc(2.0));
            assert!((duration_s - 2.0 * shorter_s).abs() < 1e-12);
            for k in 0..=200 {
                let time_s = shorter_s * f64::from(k) / 200.0;
                let (slow, fast) = (once.at(2.0 * time_s), twice.at(time_s));
                let moved = (slow.position - fast.position).norm();
                let velocity = (2.0 * slow.velocity - fast.velocity).norm();
                assert!(
                    moved < 1e-12 && velocity < 1e-12,
                    "{time_s} s: {moved} {velocity}"
                );
            }
        }
    }

    /// Every point of a placed path equals the rotated, displaced and halved point of the paper's path.
    #[test]
    fn a_placed_path_is_the_papers_path_rotated_displaced_and_scaled() {
        let placed = Paths {
            radius_m: 0.4,
            azimuth_rad: 0.7,
            height_m: 0.3,
            scale: 0.5,
        };
        let paper = Paths::PAPER;
        let pairs = [
            (paper.sinusoid(1.0).0, placed.sinusoid(1.0).0),
            (
                Trajectory::Quadrant(paper.quadrant(0.06).0),
                Trajectory::Quadrant(placed.quadrant(0.06).0),
            ),
        ];
        for (paper, placed) in pairs {
            for k in 0..200 {
                let time_s = 0.1 * f64::from(k);
                let (was, is) = (paper.at(time_s).position, placed.at(time_s).position);
                let radius = 0.4 + 0.5 * (was.x - 0.6);
                let wanted = [
                    radius * 0.7_f64.cos(),
                    radius * 0.7_f64.sin(),
                    0.3 + 0.5 * was.z,
                ];
                for axis in 0..3 {
                    assert!(
                        (is[axis] - wanted[axis]).abs() < 1e-12,
                        "{time_s} s: {is:?}"
                    );
                }
            }
        }
        // The lengths of the arc and of the probe are multiplied by the scale.
        let Trajectory::Arc(arc) = placed.arc(1.0).0 else {
            unreachable!("an arc");
        };
        assert!((arc.radius_m * arc.amplitude_rad - 0.5 * 0.65 * 0.4).abs() < 1e-12);
        let (probe, _) = placed.probe(0.02);
        assert!((probe.top_m - (0.3 + 0.02 + 0.03)).abs() < 1e-12);
        assert!((probe.stroke_m - 0.05).abs() < 1e-12);
    }
}
