//! A simulated arm with external pushes, and random measurements and requests.

use crate::support::random::{Draws, Random};
use crate::support::rig::{Rig, probe_at, ramp};
use supple_core::config::{Gains, JointGains, Role, RotationalGains};
use supple_core::controller::{
    Breakaway, GainAxes, GainMatrices, GainPart, LearningSwitch, Mode, Request, SetPoint,
};
use supple_core::dynamics::aba;
use supple_core::learned::{JointMap, LearnedParameters};
use supple_core::math::{Matrix3, Vector3};
use supple_core::trajectory::{Arc, Fourier, Line, Quadrant, Rotation, Sinusoid};
use supple_core::{Config, Input, Output, Trajectory, Vector};

/// Returns whether the input of this cycle reports idle drives.
pub fn drives_are_idle<const N: usize>(_: &Input<N>) -> bool {
    false
}

/// A controller and its simulated arm.
pub struct SimulatedArm<const N: usize> {
    pub rig: Rig<N>,
    q: Vector<N>,
    qd: Vector<N>,
}

impl<const N: usize> SimulatedArm<N> {
    /// An arm at rest at a random pose within the stops.
    pub fn new(config: Config<N>, random: &mut Random) -> SimulatedArm<N> {
        let limits = &config.limits;
        let middle = (limits.position_lower_rad + limits.position_upper_rad) * 0.5;
        let half = (limits.position_upper_rad - limits.position_lower_rad) * 0.5;
        let mut q = middle + random.joints::<N>(0.8).component_mul(&half);
        for i in 0..N {
            q[i] = held_at(&config, i).unwrap_or(q[i]);
        }
        SimulatedArm {
            rig: Rig::new(config, q),
            q,
            qd: Vector::zeros(),
        }
    }

    /// Enters gravity hold.
    pub fn begin(&mut self) -> Output<N> {
        self.rig.cycle();
        self.rig.request(Request::GravityHold)
    }

    pub fn step(&mut self, input: &Input<N>) -> Output<N> {
        self.rig.step(input)
    }

    /// Measurements and request of this cycle.
    pub fn input(&mut self, random: &mut Random, last: &Output<N>) -> Input<N> {
        self.rig.q = self.q;
        let mut input = self.rig.input();
        if random.once_in(300) {
            let joint = random.below(N as u64) as usize;
            input.position_rad[joint] = match random.below(3) {
                0 => Some(random.number()),
                _ => None,
            };
        }
        input.tip_force_n = match random.below(400) {
            0 => Some(random.point()),
            1..200 => Some(Vector3::from(random.joints::<3>(20.0))),
            _ => None,
        };
        if random.once_in(500) {
            input.cycle = match random.below(10) {
                0 => random.bits(),
                _ => last.cycle.wrapping_add_signed(random.below(8) as i64 - 2),
            };
        }
        let often = if last.mode == Mode::Fault { 40 } else { 60 };
        input.request = random.once_in(often).then(|| self.request(random, last));
        input
    }

    fn request(&self, random: &mut Random, last: &Output<N>) -> Request<N> {
        // Mostly requests that leave a fault and resume motion.
        match (last.mode, random.below(4)) {
            (Mode::Fault, 0..3) => return Request::Reset,
            (Mode::Idle, 0..3) => return Request::GravityHold,
            _ => {}
        }
        let tip = last.tip_position_m;
        match random.below(30) {
            0 => Request::Idle,
            1 => Request::GravityHold,
            2 => Request::Reset,
            3 => self.rig.hold_tip_request(),
            4 => Request::Track(probe_at(&tip)),
            5 => Request::Track(Trajectory::Line(Line {
                from_m: tip,
                to_m: tip + Vector3::from(random.joints::<3>(0.1)),
                duration_s: 1.0 + random.signed(),
            })),
            6 => Request::Move {
                target_rad: Vector::from_fn(|i, _| {
                    held_at(self.rig.controller.config(), i).unwrap_or(self.rig.q[i])
                }),
                duration_s: 1.0 + random.signed(),
            },
            7 => Request::Excite(Fourier::at_rest(self.rig.q, 1.0)),
            8 => Request::Breakaway(ramp()),
            9 => Request::Breakaway(Breakaway {
                joint: random.below(9) as usize,
                rate_nm_per_s: random.number(),
                stop_rad: random.number(),
                limit_nm: random.number(),
            }),
            10 => Request::Move {
                target_rad: Vector::from_fn(|_, _| random.number()),
                duration_s: random.number(),
            },
            11 => Request::Gains {
                gains: Gains {
                    stiffness_n_per_m: random.point().abs(),
                    damping_n_s_per_m: random.point().abs(),
                },
                ramp_s: random.number(),
            },
            12 => Request::Gains {
                gains: Gains::isotropic(
                    150.0 + 150.0 * random.signed(),
                    30.0 + 20.0 * random.signed(),
                ),
                ramp_s: 0.1,
            },
            14 => Request::Float,
            15 => Request::JointImpedance {
                target_rad: self.rig.q + random.joints::<N>(0.2),
                duration_s: 1.0 + random.signed(),
            },
            16 => Request::JointImpedance {
                target_rad: Vector::from_fn(|_, _| random.number()),
                duration_s: random.number(),
            },
            17 => Request::JointGains {
                gains: JointGains {
                    stiffness_nm_per_rad: Vector::from_fn(|_, _| random.number().abs()),
                    damping_nm_s_per_rad: Vector::from_fn(|_, _| random.number().abs()),
                },
                ramp_s: random.number(),
            },
            18 => self.rig.turn(0.4 * random.signed() - 0.2),
            19 => Request::TrackPose {
                trajectory: any_trajectory(random),
                rotation: Rotation {
                    axis: random.point(),
                    angle_rad: random.number(),
                    duration_s: random.number(),
                },
            },
            20 => Request::RotationalGains {
                gains: RotationalGains {
                    stiffness_nm_per_rad: random.point().abs(),
                    damping_nm_s_per_rad: random.point().abs(),
                },
                ramp_s: random.number(),
            },
            21 => Request::GainMatrices {
                part: [GainPart::Linear, GainPart::Rotational][random.below(2) as usize],
                gains: GainMatrices {
                    stiffness: random_matrix(random),
                    damping: random_matrix(random) * 0.1,
                },
                axes: [GainAxes::Base, GainAxes::Tip][random.below(2) as usize],
                ramp_s: random.number(),
            },
            26..29 => Request::SetPoint(SetPoint {
                position_m: tip + Vector3::from(random.joints::<3>(0.02)),
                velocity_m_per_s: Vector3::from(random.joints::<3>(0.1)),
                acceleration_m_per_s2: Vector3::zeros(),
                at_cycle: self.rig.cycle + random.below(300),
            }),
            29 => Request::SetPoint(SetPoint {
                position_m: random.point(),
                velocity_m_per_s: random.point(),
                acceleration_m_per_s2: random.point(),
                at_cycle: random.below(2000),
            }),
            22 => Request::Learning(LearningSwitch::On),
            23 => Request::Learning(match random.below(2) {
                0 => LearningSwitch::Off,
                _ => LearningSwitch::Reset,
            }),
            24 => {
                let mut parameters = LearnedParameters::zero();
                let bounds = self.rig.controller.learned_bounds().parameters;
                // A little beyond the bounds now and then.
                let share = if random.once_in(4) { 1.1 } else { 0.9 };
                parameters.each(&bounds, |_, _, to, bound| {
                    *to = share * bound * random.signed()
                });
                Request::LearnedParameters(parameters)
            }
            25 => {
                let joint = random.below(N as u64 + 1) as usize;
                let bounds = self.rig.controller.learned_bounds().map_nm;
                let mut map = JointMap::ZERO;
                for value in map.coefficients_mut() {
                    *value = bounds[joint.min(N - 1)] * random.signed();
                }
                Request::LearnedMap { joint, map }
            }
            13 => {
                let mut series = Fourier::at_rest(self.rig.q, random.number());
                series.sine_rad[random.below(5) as usize] = random.joints(0.1);
                series.duration_s = random.number();
                Request::Excite(series)
            }
            _ => Request::Track(any_trajectory(random)),
        }
    }

    /// Advances the arm by one period under these torques and random external pushes; motors
    /// without torque brake.
    pub fn advance(&mut self, output: &Output<N>, random: &mut Random) {
        let config = self.rig.controller.config();
        let torque = match output.torque_off {
            true => self.qd * -3.0,
            false => output.torque_nm,
        };
        let qdd = aba(&config.arm, &self.q, &self.qd, &torque);
        self.qd += qdd * config.period_s;
        if random.once_in(800) {
            self.qd += random.joints::<N>(3.0);
        }
        // Hard stops, without rebound.
        let limits = &config.limits;
        for i in 0..N {
            self.qd[i] = self.qd[i].clamp(-20.0, 20.0);
            self.q[i] += self.qd[i] * config.period_s;
            let (lower, upper) = (limits.position_lower_rad[i], limits.position_upper_rad[i]);
            if !(lower..=upper).contains(&self.q[i]) {
                self.q[i] = self.q[i].clamp(lower, upper);
                self.qd[i] = 0.0;
            }
        }
    }
}

/// Angle of a held joint; `None` for an active one.
fn held_at<const N: usize>(config: &Config<N>, joint: usize) -> Option<f64> {
    match config.roles[joint] {
        Role::Held { position_rad, .. } => Some(position_rad),
        Role::Active => None,
    }
}

/// Symmetric and mostly positive semi-definite.
fn random_matrix(random: &mut Random) -> Matrix3<f64> {
    let root = Matrix3::from_columns(&[random.point(), random.point(), random.point()]);
    root * root.transpose() - Matrix3::from_diagonal_element(0.01 * random.signed())
}

fn any_trajectory(random: &mut Random) -> Trajectory {
    match random.below(5) {
        0 => Trajectory::Hold(random.point()),
        1 => Trajectory::Line(Line {
            from_m: random.point(),
            to_m: random.point(),
            duration_s: random.number(),
        }),
        2 => Trajectory::Sinusoid(Sinusoid {
            centre_m: random.point(),
            amplitude_m: random.point(),
            angular_frequency_rad_per_s: random.number(),
            ramp_s: random.number(),
        }),
        3 => Trajectory::Arc(Arc {
            radius_m: random.number(),
            height_m: random.number(),
            centre_rad: random.number(),
            amplitude_rad: random.number(),
            angular_frequency_rad_per_s: random.number(),
            ramp_s: random.number(),
        }),
        _ => Trajectory::Quadrant(Quadrant::new(
            random.point(),
            random.point(),
            random.point(),
            random.number(),
            random.number(),
        )),
    }
}
