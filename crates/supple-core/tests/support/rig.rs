//! A controller with its state and the inputs of the next cycle.

use super::plant::{Plant, nothing};
use supple_core::controller::{Breakaway, Fault, Mode, Request};
use supple_core::math::Vector3;
use supple_core::trajectory::{Fourier, Rotation, Trajectory};
use supple_core::{Arm, Config, Controller, Input, Output, State, Vector, step};

/// A copy continues independently of the original.
#[derive(Clone)]
pub struct Rig<const N: usize> {
    pub controller: Controller<N>,
    pub state: State<N>,
    /// Cycle number of the next input.
    pub cycle: u64,
    /// Encoder angles \[rad\].
    pub q: Vector<N>,
    /// Reading of the force sensor, if any \[N\].
    pub force_n: Option<Vector3<f64>>,
    /// Whether the drives apply torques.
    pub drives_active: bool,
}

impl<const N: usize> Rig<N> {
    /// A rig in idle, before its first cycle.
    pub fn new(config: Config<N>, q: Vector<N>) -> Self {
        let controller = Controller::new(config).expect("a valid configuration");
        Rig {
            state: State::new(&controller),
            controller,
            cycle: 1000,
            q,
            force_n: None,
            drives_active: true,
        }
    }

    /// A rig in gravity hold, at rest, with the torques settled.
    pub fn holding(config: Config<N>, q: Vector<N>) -> Self {
        let mut rig = Rig::new(config, q);
        rig.cycle();
        rig.accept(Request::GravityHold);
        rig.rest();
        rig
    }

    pub fn input(&self) -> Input<N> {
        Input {
            cycle: self.cycle,
            position_rad: std::array::from_fn(|i| Some(self.q[i])),
            tip_force_n: self.force_n,
            drives_active: self.drives_active,
            request: None,
        }
    }

    /// Steps with an arbitrary input; the next cycle number follows from it.
    pub fn step(&mut self, input: &Input<N>) -> Output<N> {
        self.cycle = input.cycle.saturating_add(1);
        step(&self.controller, &mut self.state, input)
    }

    /// Runs one cycle.
    pub fn cycle(&mut self) -> Output<N> {
        self.step(&self.input())
    }

    pub fn cycles(&mut self, count: usize) -> Output<N> {
        let mut output = self.cycle();
        for _ in 1..count {
            output = self.cycle();
        }
        output
    }

    /// Runs half a second without motion of the arm.
    pub fn rest(&mut self) -> Output<N> {
        self.cycles(500)
    }

    /// Runs one cycle with a request, which may be refused.
    pub fn request(&mut self, request: Request<N>) -> Output<N> {
        self.step(&Input {
            request: Some(request),
            ..self.input()
        })
    }

    /// Runs one cycle with a request that must be accepted.
    #[track_caller]
    pub fn accept(&mut self, request: Request<N>) -> Output<N> {
        let output = self.request(request);
        assert_eq!(output.refusal, None, "{request:?}");
        assert_eq!(output.fault, None, "{request:?}");
        output
    }

    /// Position of the tip.
    pub fn tip(&self) -> Vector3<f64> {
        supple_core::dynamics::tip_pose(&self.controller.config().arm, &self.q).translation
    }

    /// Joint impedance about the current pose.
    pub fn joint_impedance_request(&self) -> Request<N> {
        Request::JointImpedance {
            target_rad: self.q,
            duration_s: 0.1,
        }
    }

    /// Tracking of a reference that stays at the current tip position.
    pub fn hold_tip_request(&self) -> Request<N> {
        Request::Track(Trajectory::Hold(self.tip()))
    }

    /// Stays with the tip and turns it about an axis of the base within 1 s \[rad\].
    pub fn turn(&self, angle_rad: f64) -> Request<N> {
        Request::TrackPose {
            trajectory: Trajectory::Hold(self.tip()),
            rotation: Rotation {
                axis: Vector3::new(0.48, -0.6, 0.64),
                angle_rad,
                duration_s: 1.0,
            },
        }
    }

    /// Puts the controller into `mode`, at rest where the rig is.
    #[track_caller]
    pub fn bring_to(&mut self, mode: Mode) {
        self.cycle();
        if mode == Mode::Idle {
            return;
        }
        self.accept(Request::GravityHold);
        self.rest();
        match mode {
            Mode::Idle | Mode::GravityHold => {}
            Mode::Move => {
                self.accept(Request::Move {
                    target_rad: self.q,
                    duration_s: 0.1,
                });
            }
            Mode::Track => {
                self.accept(self.hold_tip_request());
            }
            Mode::Probe => {
                self.accept(Request::Track(probe_at(&self.tip())));
            }
            Mode::Excite => {
                self.accept(Request::Excite(Fourier::at_rest(self.q, 1.0)));
            }
            Mode::Breakaway => {
                self.accept(Request::Breakaway(ramp()));
            }
            Mode::Float => {
                self.accept(Request::Float);
            }
            Mode::JointImpedance => {
                self.accept(self.joint_impedance_request());
            }
            Mode::TrackPose => {
                self.accept(self.turn(0.2));
            }
            Mode::Fault => {
                let output = self.step(&Input {
                    tip_force_n: Some(Vector3::repeat(f64::NAN)),
                    ..self.input()
                });
                let expected = Fault::MeasurementNotFinite { joint: None };
                assert_eq!(output.fault, Some(expected));
            }
        }
        assert_eq!(self.state.mode(), mode);
        if mode != Mode::Probe {
            self.rest();
        }
    }

    /// One cycle with `plant` in the loop, pushed by `external`.
    pub fn drive(
        &mut self,
        plant: &mut Plant<N>,
        request: Option<Request<N>>,
        external: impl Fn(&Arm<N>, &Vector<N>, &Vector<N>) -> Vector<N>,
    ) -> Output<N> {
        self.q = plant.q;
        let output = self.step(&Input {
            request,
            ..self.input()
        });
        let period_s = self.controller.config().period_s;
        plant.advance(&output.torque_nm, external, period_s, 4);
        output
    }

    /// One cycle with `plant` in the loop and no external torque.
    pub fn run(&mut self, plant: &mut Plant<N>) -> Output<N> {
        self.drive(plant, None, nothing)
    }
}

/// A slow ramp on the second joint.
pub fn ramp() -> Breakaway {
    Breakaway {
        joint: 1,
        rate_nm_per_s: 0.5,
        stop_rad: 0.035,
        limit_nm: 4.0,
    }
}

/// The paper's probing cycle, starting at the tip.
pub fn probe_at(tip: &Vector3<f64>) -> Trajectory {
    Trajectory::Probe(supple_core::trajectory::Probe {
        radius_m: tip.x.hypot(tip.y),
        strokes: 3,
        radial_step_m: 0.00667,
        top_m: tip.z,
        stroke_m: 0.1,
        azimuth_rad: tip.y.atan2(tip.x),
        azimuth_step_rad: 0.05,
        speed_m_per_s: 0.04,
        ramp_s: 0.1,
        dwell_s: 0.0,
    })
}

/// A bent arm, far from stops and singular poses.
pub fn bent<const N: usize>() -> Vector<N> {
    let mut q = Vector::zeros();
    q[0] = 0.3;
    q[1] = 0.7;
    q[if N == 3 { 2 } else { 3 }] = 1.4;
    q
}

/// The same with the roll and the wrist bent, so that the tip can turn about every axis.
pub fn bent_wrist() -> Vector<7> {
    Vector::from([0.3, 0.7, 0.2, 1.4, 0.3, 0.6, -0.2])
}
