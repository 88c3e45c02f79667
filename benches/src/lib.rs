//! Code that the benchmarks share: an arm in a given state, and a pool of random states.
//!
//! `dynamics.rs` measures wall-clock time, `instructions` counts instructions, and `peers` compares with other
//! libraries.

use supple_core::config::{Collision, Gains, PlausibilityLimits, Role, Workspace};
use supple_core::controller::{self, Mode, Request};
use supple_core::dynamics::{Terms, terms};
use supple_core::impedance::{
    LawInput, PositionTarget, SINGULAR_BELOW_M, Task, Torques, impedance,
};
use supple_core::learned::LearnedBounds;
use supple_core::linalg::min_singular_value;
use supple_core::math::Vector3;
use supple_core::target::{PoseGains, PoseReference, PoseTarget};
use supple_core::{Arm, Config, Controller, Input, Output, Reference, Trajectory, Vector};
use supple_core::{dynamics, impedance_torque, step};
use supple_model::Description;
use supple_random::Random;

/// Number of states in a pool: more than a branch predictor can memorise.
pub const STATES: usize = 256;

/// One state of an arm and the references of the law in it.
#[derive(Clone, Copy, Debug)]
pub struct State<const N: usize> {
    /// Joint angles \[rad\].
    pub q: Vector<N>,
    /// Joint velocities \[rad/s\].
    pub qd: Vector<N>,
    /// Joint accelerations \[rad/s^2\].
    pub qdd: Vector<N>,
    /// Joint torques \[N m\].
    pub tau: Vector<N>,
    /// Reference of the position law.
    pub position: Reference,
    /// Reference of the pose law.
    pub pose: PoseReference,
}

/// Position gains of all benchmarks.
pub fn gains() -> Gains {
    Gains {
        stiffness_n_per_m: Vector3::new(50.0, 60.0, 70.0),
        damping_n_s_per_m: Vector3::new(15.0, 16.0, 17.0),
    }
}

/// Pose gains of all benchmarks.
pub fn pose_gains() -> PoseGains {
    let (stiffness, damping) = (Vector3::new(5.0, 6.0, 7.0), Vector3::new(0.5, 0.6, 0.7));
    PoseGains::diagonal(&gains(), &stiffness, &damping)
}

/// Damping of the null space in all benchmarks \[N m s/rad\].
pub const NULLSPACE_DAMPING: f64 = 2.0;

/// The law of an arm in both forms.
#[derive(Clone, Copy, Debug)]
pub struct LawBench<const N: usize, G> {
    /// The arm.
    pub arm: Arm<N>,
    /// Role of each joint.
    pub roles: [Role; N],
    /// Gains of the tip's position, or of its pose.
    pub gains: G,
    /// Damping of the null space \[N m s/rad\].
    pub nullspace_damping: f64,
}

impl<const N: usize, G> LawBench<N, G> {
    /// Creates the law with all joints active.
    pub fn new(arm: Arm<N>, gains: G) -> Self {
        LawBench {
            arm,
            roles: [Role::Active; N],
            gains,
            nullspace_damping: NULLSPACE_DAMPING,
        }
    }
}

/// The law of the tip's position.
impl<const N: usize> LawBench<N, Gains> {
    fn input<'a>(&'a self, s: &'a State<N>) -> LawInput<'a, PositionTarget<'a>, N> {
        let target = PositionTarget {
            reference: &s.position,
            gains: &self.gains,
            spring_limit_n: f64::MAX,
        };
        LawInput {
            nullspace_damping_nm_s_per_rad: Vector::repeat(self.nullspace_damping),
            ..LawInput::new(target, &s.qd)
        }
    }

    /// Returns the torque as one sum; `None` if the arm is not physical.
    #[inline]
    pub fn sum(&self, s: &State<N>) -> Option<Vector<N>> {
        impedance_torque(&self.arm, &self.roles, &s.q, &self.input(s))
    }

    /// Returns the separate torque terms; `None` if the arm is not physical.
    #[inline]
    pub fn terms(&self, s: &State<N>) -> Option<Torques<N>> {
        let mut filled = Terms::default();
        terms(&self.arm, &s.q, &s.qd, &mut filled);
        let task = Task::new(&filled, &self.roles)?;
        Some(impedance(&self.roles, &filled, &task, &self.input(s)))
    }
}

/// The law of the tip's pose.
impl<const N: usize> LawBench<N, PoseGains> {
    fn input<'a>(&'a self, s: &'a State<N>) -> LawInput<'a, PoseTarget<'a>, N, 6> {
        let target = PoseTarget {
            reference: &s.pose,
            gains: &self.gains,
        };
        LawInput {
            nullspace_damping_nm_s_per_rad: Vector::repeat(self.nullspace_damping),
            ..LawInput::new(target, &s.qd)
        }
    }

    /// Returns the torque as one sum; `None` if the arm is not physical.
    #[inline]
    pub fn sum(&self, s: &State<N>) -> Option<Vector<N>> {
        impedance_torque(&self.arm, &self.roles, &s.q, &self.input(s))
    }

    /// Returns the separate torque terms; `None` if the arm is not physical.
    #[inline]
    pub fn terms(&self, s: &State<N>) -> Option<Torques<N>> {
        let mut filled = Terms::default();
        terms(&self.arm, &s.q, &s.qd, &mut filled);
        let task = Task::of_pose(&filled, &self.roles)?;
        Some(impedance(&self.roles, &filled, &task, &self.input(s)))
    }
}

/// Returns the configuration of a built-in arm.
///
/// # Panics
/// If the asset does not have `N` joints.
pub fn config<const N: usize>(name: &str) -> Config<N> {
    let description = Description::asset(name).expect("a built-in arm");
    description.config::<N>().expect("N joints")
}

/// Returns a pool of states of `arm`, the same in every run.
pub fn pool<const N: usize>(arm: &Arm<N>) -> Vec<State<N>> {
    let mut random = Random::new(20_261_121);
    (0..STATES).map(|_| random.state(arm)).collect()
}

/// Returns the states of [`pool`] without those near singular poses of the active joints, in which the law takes a different
/// code path.
pub fn regular_pool<const N: usize>(arm: &Arm<N>, roles: &[Role; N]) -> Vec<State<N>> {
    let mut random = Random::new(20_261_122);
    let regular = |state: &State<N>| {
        let mut jacobian = dynamics::jacobian(arm, &state.q)
            .fixed_rows::<3>(0)
            .into_owned();
        for joint in (0..N).filter(|joint| roles[*joint] != Role::Active) {
            jacobian.column_mut(joint).fill(0.0);
        }
        min_singular_value(&jacobian) > SINGULAR_BELOW_M
    };
    core::iter::repeat_with(|| random.state(arm))
        .filter(regular)
        .take(STATES)
        .collect()
}

/// A controller that holds the tip by the impedance law.
pub struct Rig<const N: usize> {
    controller: Controller<N>,
    state: controller::State<N>,
    position_rad: Vector<N>,
    cycle: u64,
}

impl<const N: usize> Rig<N> {
    /// Creates a rig in a bent pose of a built-in arm and runs it until the blends after the change of mode are
    /// over.
    ///
    /// # Panics
    /// If the controller does not reach the mode, or the pose is near a singular one.
    pub fn tracking(asset: &str) -> Self {
        Rig::of_config(config(asset))
    }

    /// Creates the rig of [`Rig::tracking`] with learned terms of every kind.
    pub fn learned(asset: &str) -> Self {
        let mut config = config::<N>(asset);
        let limits = &config.limits;
        let bounds = LearnedBounds::new(&config.friction, &limits.joint_torque_nm);
        let parameters = &mut config.learned.parameters;
        parameters.each(&bounds.parameters, |_, _, to, bound| *to = 0.01 * bound);
        for (joint, map) in config.learned.map.iter_mut().enumerate() {
            for coefficient in map.coefficients_mut() {
                *coefficient = 0.01 * bounds.map_nm[joint];
            }
        }
        Rig::of_config(config)
    }

    /// Creates the rig of [`Rig::tracking`] without effective limits, so that any measured pose and speed is permitted.
    pub fn anywhere(asset: &str) -> Self {
        let mut config = config::<N>(asset);
        let limits = &mut config.limits;
        limits.position_lower_rad.fill(-FAR);
        limits.position_upper_rad.fill(FAR);
        limits.joint_speed_rad_per_s.fill(FAR);
        limits.tip_speed_m_per_s = FAR;
        limits.tracking_error_m = FAR;
        limits.joint_tracking_error_rad = FAR;
        config.collision = Collision::disabled();
        config.plausible = PlausibilityLimits::disabled();
        config.workspace = Workspace::UNBOUNDED;
        Rig::of_config(config)
    }

    fn of_config(config: Config<N>) -> Self {
        let bent = match N {
            3 => [0.2, 0.8, 1.6, 0.0],
            _ => [0.2, 0.8, 0.0, 1.6],
        };
        let position_rad = Vector::from_fn(|i, _| match config.roles[i] {
            Role::Held { position_rad, .. } => position_rad,
            Role::Active => bent[i % bent.len()],
        });
        let tip = dynamics::tip_pose(&config.arm, &position_rad).translation;
        let controller = Controller::new(config).expect("a valid configuration");
        let mut rig = Rig {
            state: controller::State::new(&controller),
            controller,
            position_rad,
            cycle: 0,
        };
        let requests = [Request::GravityHold, Request::Track(Trajectory::Hold(tip))];
        for request in requests {
            rig.cycle(Some(request));
            for _ in 0..1000 {
                rig.step();
            }
        }
        let output = rig.step();
        assert_eq!(
            output.mode,
            Mode::Track,
            "the controller must follow the law"
        );
        assert!(
            output.min_singular_value_m > SINGULAR_BELOW_M,
            "the pose must be regular"
        );
        rig
    }

    /// Runs one cycle.
    pub fn step(&mut self) -> Output<N> {
        self.cycle(None)
    }

    /// Runs one cycle with the arm at `position_rad` \[rad\].
    ///
    /// # Panics
    /// If the controller no longer follows the law.
    #[inline]
    pub fn step_at(&mut self, position_rad: &Vector<N>) -> Output<N> {
        self.position_rad = *position_rad;
        let output = self.cycle(None);
        assert_eq!(output.mode, Mode::Track, "{:?}", output.fault);
        output
    }

    fn cycle(&mut self, request: Option<Request<N>>) -> Output<N> {
        let jitter_rad = 1e-5 * (self.cycle % 11) as f64;
        let input = Input {
            cycle: self.cycle,
            position_rad: std::array::from_fn(|i| Some(self.position_rad[i] + jitter_rad)),
            tip_force_n: None,
            drives_active: true,
            request,
        };
        self.cycle += 1;
        step(&self.controller, &mut self.state, &input)
    }
}

/// A limit without effect, in any unit.
const FAR: f64 = 1e9;

/// Draws of states.
trait Draws {
    fn vector<const R: usize>(&mut self, reach: f64) -> Vector<R>;
    fn state<const N: usize>(&mut self, arm: &Arm<N>) -> State<N>;
}

impl Draws for Random {
    fn vector<const R: usize>(&mut self, reach: f64) -> Vector<R> {
        Vector::from_fn(|_, _| self.signed() * reach)
    }

    fn state<const N: usize>(&mut self, arm: &Arm<N>) -> State<N> {
        let q = self.vector(3.0);
        let base_from_tip = dynamics::tip_pose(arm, &q);
        let position = base_from_tip.translation + self.vector::<3>(0.02);
        let (velocity, acceleration) = (self.vector::<3>(0.3), self.vector::<3>(1.0));
        State {
            q,
            qd: self.vector(2.0),
            qdd: self.vector(5.0),
            tau: self.vector(20.0),
            position: Reference {
                position,
                velocity,
                acceleration,
            },
            pose: PoseReference {
                velocity_m_per_s: velocity,
                acceleration_m_per_s2: acceleration,
                ..PoseReference::at_rest(base_from_tip)
            },
        }
    }
}
