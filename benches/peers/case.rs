//! Reads an arm and the states at which its functions are timed, plain numbers in the order in which `harness.hpp` reads them.

use supple_benches::State;
use supple_core::config::Gains;
use supple_core::math::{Matrix3, Vector3};
use supple_core::target::{PoseGains, PoseReference};
use supple_core::{Arm, Body, Joint, Pose, Reference, Vector};

/// Error of reading a case.
#[derive(Debug)]
pub enum CaseError {
    File(std::io::Error),
    Number(String),
    Short,
    Joints,
    Arm(supple_core::ArmError),
}

impl std::fmt::Display for CaseError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            CaseError::File(error) => write!(f, "case or outputs: {error}"),
            CaseError::Number(text) => write!(f, "case: {text} is not a number"),
            CaseError::Short => write!(f, "case: truncated, generate it again with cases.py"),
            CaseError::Joints => write!(f, "case: the first number must be 2 to 12 joints"),
            CaseError::Arm(error) => write!(f, "case: {error}"),
        }
    }
}

impl From<std::io::Error> for CaseError {
    fn from(error: std::io::Error) -> Self {
        CaseError::File(error)
    }
}

/// An arm, the gains of its impedance law, and the states at which its functions are timed.
pub struct Case<const N: usize> {
    pub arm: Arm<N>,
    pub gains: Gains,
    pub pose_gains: PoseGains,
    pub nullspace_damping: f64,
    pub states: Vec<State<N>>,
}

pub fn numbers(path: &str) -> Result<Vec<f64>, CaseError> {
    let text = std::fs::read_to_string(path)?;
    let number = |word: &str| word.parse().map_err(|_| CaseError::Number(word.to_owned()));
    text.split_whitespace().map(number).collect()
}

struct Reader<'a>(&'a [f64]);

impl Reader<'_> {
    fn array<const C: usize>(&mut self) -> Result<[f64; C], CaseError> {
        let (first, rest) = self.0.split_first_chunk().ok_or(CaseError::Short)?;
        self.0 = rest;
        Ok(*first)
    }

    fn number(&mut self) -> Result<f64, CaseError> {
        Ok(self.array::<1>()?[0])
    }

    fn vector<const R: usize>(&mut self) -> Result<Vector<R>, CaseError> {
        Ok(Vector::from(self.array::<R>()?))
    }

    fn matrix3(&mut self) -> Result<Matrix3<f64>, CaseError> {
        Ok(Matrix3::from_row_slice(&self.array::<9>()?))
    }

    fn pose(&mut self) -> Result<Pose, CaseError> {
        Ok(Pose {
            translation: self.vector()?,
            rotation: self.matrix3()?,
        })
    }

    fn linear_and_angular(&mut self) -> Result<(Vector3<f64>, Vector3<f64>), CaseError> {
        Ok((self.vector()?, self.vector()?))
    }

    fn joint(&mut self) -> Result<Joint, CaseError> {
        Ok(Joint {
            parent_from_link: self.pose()?,
            axis: self.vector()?,
            body: Body {
                mass_kg: self.number()?,
                com_m: self.vector()?,
                inertia_kg_m2: self.matrix3()?,
            },
            armature_kg_m2: 0.0,
        })
    }

    fn state<const N: usize>(&mut self) -> Result<State<N>, CaseError> {
        let (q, qd, qdd, tau) = (
            self.vector()?,
            self.vector()?,
            self.vector()?,
            self.vector()?,
        );
        let base_from_tip = self.pose()?;
        let (velocity, angular_velocity_rad_per_s) = self.linear_and_angular()?;
        let (acceleration, angular_acceleration_rad_per_s2) = self.linear_and_angular()?;
        Ok(State {
            q,
            qd,
            qdd,
            tau,
            position: Reference {
                position: base_from_tip.translation,
                velocity,
                acceleration,
            },
            pose: PoseReference {
                base_from_tip,
                velocity_m_per_s: velocity,
                angular_velocity_rad_per_s,
                acceleration_m_per_s2: acceleration,
                angular_acceleration_rad_per_s2,
            },
        })
    }
}

impl<const N: usize> Case<N> {
    pub fn new(numbers: &[f64]) -> Result<Case<N>, CaseError> {
        let mut r = Reader(numbers);
        let [_joints, _task_directions, state_count] = r.array()?;
        let gravity = r.vector()?;
        let mut joints = Vec::with_capacity(N);
        for _ in 0..N {
            joints.push(r.joint()?);
        }
        let tip = r.pose()?;
        let joints: [Joint; N] = joints.try_into().map_err(|_| CaseError::Joints)?;
        let arm = Arm::new(&joints, tip, None, gravity).map_err(CaseError::Arm)?;
        let (stiffness_n_per_m, stiffness_nm_per_rad) = r.linear_and_angular()?;
        let (damping_n_s_per_m, damping_nm_s_per_rad) = r.linear_and_angular()?;
        let gains = Gains {
            stiffness_n_per_m,
            damping_n_s_per_m,
        };
        let pose_gains = PoseGains::diagonal(&gains, &stiffness_nm_per_rad, &damping_nm_s_per_rad);
        let nullspace_damping = r.number()?;
        let states: Result<_, _> = (0..state_count as usize).map(|_| r.state()).collect();
        Ok(Case {
            arm,
            gains,
            pose_gains,
            nullspace_damping,
            states: states?,
        })
    }
}
