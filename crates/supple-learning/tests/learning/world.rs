//! A controller and its learner with an arm that differs from the model, excited in all joints.

use crate::support::plant::{Plant, push};
use crate::support::rig::{Rig, bent};
use std::collections::VecDeque;
use supple_core::controller::{CycleRecord, LearningSwitch, Request};
use supple_core::math::{Matrix3, Vector3};
use supple_core::nalgebra::Rotation3;
use supple_core::trajectory::Fourier;
use supple_core::{Arm, Config, Friction, Output, Vector};
use supple_learning::{Learner, Scheduled, requests_in_flight};

/// The true arm's deviation from the model.
#[derive(Clone, Copy, Debug)]
pub struct Truth<const N: usize> {
    /// Change of the viscous and the Coulomb friction, relative.
    pub viscous: Vector<N>,
    pub coulomb: Vector<N>,
    /// Torque that the drives lack at each joint \[N m\].
    pub offset_nm: Vector<N>,
    /// Point mass at the tip \[kg\].
    pub payload_kg: f64,
    /// Rotation of gravity \[rad\].
    pub tilt_rad: Vector3<f64>,
}

impl<const N: usize> Truth<N> {
    pub fn none() -> Self {
        Truth {
            viscous: Vector::zeros(),
            coulomb: Vector::zeros(),
            offset_nm: Vector::zeros(),
            payload_kg: 0.0,
            tilt_rad: Vector3::zeros(),
        }
    }

    fn arm(&self, model: &Arm<N>) -> Arm<N> {
        let mut links = *model.links();
        let at = model.joint_from_tip().translation;
        let last = &mut links[N - 1];
        last.mass += self.payload_kg;
        last.first_moment += at * self.payload_kg;
        last.inertia += (Matrix3::identity() * at.dot(&at) - at * at.transpose()) * self.payload_kg;
        let gravity = Rotation3::from_scaled_axis(self.tilt_rad) * model.gravity();
        Arm::from_links(links, model.armature(), model.joint_from_tip(), gravity)
            .expect("a physical arm")
    }

    fn friction(&self, model: &[Friction; N]) -> [Friction; N] {
        core::array::from_fn(|i| Friction {
            viscous_nm_s_per_rad: model[i].viscous_nm_s_per_rad * (1.0 + self.viscous[i]),
            coulomb_nm: model[i].coulomb_nm * (1.0 + self.coulomb[i]),
            breakaway_nm: model[i].breakaway_nm * (1.0 + self.coulomb[i]),
            ..model[i]
        })
    }
}

/// Friction and gains of a joint relative to those of a joint of shoulder and elbow; the wrist is small.
pub fn size_of_joint(joint: usize) -> f64 {
    match joint {
        0..4 => 1.0,
        4 | 5 => 0.02,
        _ => 0.005,
    }
}

/// The model: the arm of `config` with friction.
pub fn model<const N: usize>(config: Config<N>) -> Config<N> {
    let mut config = config;
    for i in 0..N {
        let size = size_of_joint(i);
        config.friction[i] = Friction::coulomb(0.8 * size, 0.4 * size);
        if i >= 4 {
            config.move_gains.stiffness_nm_per_rad[i] = 200.0 * size;
            config.move_gains.damping_nm_s_per_rad[i] = 2.0 * size;
            config.joint_gains.stiffness_nm_per_rad[i] = 10.0 * size;
            config.joint_gains.damping_nm_s_per_rad[i] = size;
        }
    }
    config
}

/// A motion of every joint between the stops, different for each.
pub fn exciting<const N: usize>(duration_s: f64) -> Fourier<N> {
    let mut series = Fourier::at_rest(bent::<N>(), 0.7);
    for (k, (sine, cosine)) in series
        .sine_rad
        .iter_mut()
        .zip(&mut series.cosine_rad)
        .enumerate()
    {
        for i in 0..N {
            let phase = (1 + 3 * i + 5 * k + i * k) as f64;
            let size = 0.12 / (1.0 + k as f64).sqrt();
            sine[i] = size * phase.sin();
            cosine[i] = size * phase.cos();
        }
    }
    // The motion begins in the present pose of the arm.
    let start = series.at(0.0).position_rad - series.centre_rad;
    series.centre_rad -= start;
    series.duration_s = duration_s;
    series
}

/// Controller, learner and arm.
pub struct World<const N: usize> {
    pub rig: Rig<N>,
    pub plant: Plant<N>,
    pub learner: Learner<N>,
    truth: Truth<N>,
    friction: [Friction; N],
    /// Direction of each joint's dry friction, -1 to 1.
    direction: Vector<N>,
    scheduled: VecDeque<Scheduled<N>>,
    steps: u64,
    /// Size of the steps of the encoders; zero: none \[rad\].
    pub encoder_step_rad: f64,
    /// Every request of the learner.
    pub requests: Vec<Scheduled<N>>,
}

impl<const N: usize> World<N> {
    /// Creates a world in gravity hold with learning on.
    pub fn new(config: Config<N>, truth: Truth<N>) -> Self {
        let mut world = World {
            rig: Rig::new(config, bent()),
            plant: Plant::at_rest(truth.arm(&config.arm), bent()),
            learner: Learner::new(&config),
            friction: truth.friction(&config.friction),
            direction: Vector::zeros(),
            truth,
            scheduled: VecDeque::new(),
            steps: 0,
            encoder_step_rad: 0.0,
            requests: Vec::new(),
        };
        world.cycle(None, Vector3::zeros());
        world.request(Request::GravityHold);
        world.request(Request::Learning(LearningSwitch::On));
        world
    }

    /// Adds a point mass at the tip, with its weight and its inertia.
    pub fn add_payload(&mut self, payload_kg: f64) {
        self.truth.payload_kg += payload_kg;
        self.plant.arm = self.truth.arm(&self.rig.controller.config().arm);
    }

    #[track_caller]
    pub fn request(&mut self, request: Request<N>) {
        let output = self.cycle(Some(request), Vector3::zeros());
        assert_eq!((output.refusal, output.fault), (None, None), "{request:?}");
    }

    /// One cycle, with a force on the tip.
    pub fn cycle(&mut self, request: Option<Request<N>>, force_n: Vector3<f64>) -> Output<N> {
        let cycle = self.rig.cycle;
        let due = self.scheduled.front().is_some_and(|s| s.at_cycle <= cycle);
        let request = match request {
            None if due => self.scheduled.pop_front().map(|s| s.request),
            request => request,
        };
        self.rig.q = match self.encoder_step_rad {
            0.0 => self.plant.q,
            step_rad => self.plant.q.map(|q| (q / step_rad).round() * step_rad),
        };
        let input = supple_core::Input {
            request,
            ..self.rig.input()
        };
        let output = self.rig.step(&input);
        let record = CycleRecord::new(self.steps, &input, &output);
        self.steps += 1;
        let news = self.learner.observe(&record);
        self.requests.extend(news.iter().copied());
        self.scheduled.extend(news);
        let in_flight = requests_in_flight(N, self.rig.controller.config().period_s);
        assert!(self.scheduled.len() <= in_flight + N + 1);
        let (friction, offset) = (self.friction, self.truth.offset_nm);
        let period_s = self.rig.controller.config().period_s;
        for (i, direction) in self.direction.iter_mut().enumerate() {
            if friction[i].presliding_rad > 0.0 {
                *direction = friction[i].direction_after(*direction, self.plant.qd[i] * period_s);
            }
        }
        let direction = self.direction;
        let resistance = move |arm: &Arm<N>, q: &Vector<N>, qd: &Vector<N>| {
            let friction = Vector::from_fn(|i, _| match friction[i].presliding_rad {
                0.0 => friction[i].torque_nm(qd[i]),
                _ => friction[i].torque_in_direction_nm(qd[i], direction[i], 1.0),
            });
            push(arm, q, &force_n) - friction - offset
        };
        self.plant
            .advance(&output.torque_nm, resistance, period_s, 4);
        output
    }

    /// Runs for some time with a constant force on the tip; returns the outputs of every cycle.
    #[track_caller]
    pub fn run(&mut self, duration_s: f64, force_n: Vector3<f64>) -> Output<N> {
        let mut last = self.cycle(None, force_n);
        for _ in 1..(duration_s * 1e3) as usize {
            last = self.cycle(None, force_n);
            assert_eq!(last.fault, None);
        }
        last
    }
}
