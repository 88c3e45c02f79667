//! Columns of the regressor: their order and their sign constraints.
//!
//! ```text
//! tau_j = sum_k Y_jk p_k + I_rj qdd_j + V_j qd_j + S_j p(qd_j/delta) + o_j + A_j |qd_j|
//!         + [B_j p(qd_j/delta) + O_j] exp(-(qd_j/v_s)^2) + L_j |g_j| p(qd_j/delta)
//!                                                      and for a gear coupling (a, b), on joint a,
//!         + I_c (qdd_a + qdd_b) + V_c (qd_a + qd_b) + S_c p((qd_a + qd_b)/delta)
//! ```
//!
//! `p` is the parabola of [`supple_core::friction`]. The dry friction of a gear grows with a torque
//! `g_j`: the load torque of joint j according to the nominal model, or the motor's torque. A coupled motor turns with the sum of
//! two joint angles; its torque acts on both joints.

use crate::effects::Effects;
use crate::error::{IdentError, positive, shape_error};
use supple_core::Friction;
use supple_core::friction::LoadTorque;

/// Names of the ten parameters of a link, in the order of [`supple_core::dynamics::parameters`].
pub const LINK_NAMES: [&str; 10] = [
    "m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz",
];

/// Friction columns of every identified joint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrictionColumns {
    /// `V`.
    pub viscous: bool,
    /// `S`.
    pub coulomb: bool,
    /// `o`: Coulomb friction that differs by direction is `S` and `o` together.
    pub offset: bool,
    /// `A`: viscous friction that differs by direction, `|A| <= V`, and with a Stribeck effect `O`, which makes the breakaway torque
    /// differ by direction; the column of `A` is `|qd_j|` and differs from the law's within `delta` only.
    pub asymmetry: bool,
    /// `L`: Coulomb friction that grows with this torque.
    pub load: Option<LoadTorque>,
    /// `B`, with its `v_s` \[rad/s\].
    pub stribeck_rad_per_s: Option<f64>,
    /// `delta` of the parabola \[rad/s\].
    pub band_rad_per_s: f64,
}

impl FrictionColumns {
    /// No friction.
    pub const NONE: FrictionColumns = FrictionColumns {
        viscous: false,
        coulomb: false,
        offset: false,
        asymmetry: false,
        load: None,
        stribeck_rad_per_s: None,
        band_rad_per_s: Friction::NONE.band_rad_per_s,
    };
    /// `V` and `S`.
    pub const COULOMB: FrictionColumns = FrictionColumns {
        viscous: true,
        coulomb: true,
        ..FrictionColumns::NONE
    };
    /// `V`, `S` and `o`.
    pub const COULOMB_AND_OFFSET: FrictionColumns = FrictionColumns {
        offset: true,
        ..FrictionColumns::COULOMB
    };
}

/// Meaning of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Column {
    /// Parameter 0 to 9 of a link.
    Link {
        /// Joint that moves the link.
        link: usize,
        /// Entry of [`LINK_NAMES`].
        entry: usize,
    },
    /// Rotor inertia of a joint.
    Rotor(usize),
    /// `V` of a joint.
    Viscous(usize),
    /// `S` of a joint.
    Coulomb(usize),
    /// `o` of a joint.
    Offset(usize),
    /// `A` of a joint.
    Asymmetry(usize),
    /// `B` of a joint.
    Stribeck(usize),
    /// `O` of a joint.
    StribeckOffset(usize),
    /// `L` of a joint.
    Load(usize),
    /// Rotor inertia of a motor that turns with the sum of two joints.
    CoupledRotor(usize, usize),
    /// Viscous friction of such a motor.
    CoupledViscous(usize, usize),
    /// Coulomb friction of such a motor.
    CoupledCoulomb(usize, usize),
    /// Spring over a joint, see [`crate::effects`].
    Spring(usize),
    /// Compliance of a joint, in 1e-3 rad/(N m).
    Compliance(usize),
    /// `s` of a joint, its torque scale.
    TorqueScale(usize),
    /// Dry friction of a motor that drives several joints, at the joint that it drives fastest.
    MotorCoulomb(usize),
    /// Viscous friction of such a motor.
    MotorViscous(usize),
    /// Tilt of the base about base axis x (0) or y (1).
    Tilt(usize),
}

impl Column {
    /// Returns whether the column is fitted to slow motion, after the others.
    pub fn is_of_slow_motion(&self) -> bool {
        matches!(self, Column::Stribeck(_) | Column::StribeckOffset(_))
    }

    /// Returns whether the column changes faster at a reversal of motion than the filter of the torques follows.
    pub fn is_fast_at_reversal(&self) -> bool {
        matches!(
            self,
            Column::Coulomb(_)
                | Column::Stribeck(_)
                | Column::StribeckOffset(_)
                | Column::Load(_)
                | Column::CoupledCoulomb(..)
                | Column::MotorCoulomb(_)
        )
    }
}

/// The columns of a regressor of an arm, links first.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    dof: usize,
    identified_joints: Vec<usize>,
    friction: FrictionColumns,
    effects: Effects,
    columns: Vec<Column>,
}

impl Columns {
    /// Creates ten columns for each of `dof` links, then rotor inertia and `friction` of each identified joint,
    /// then three columns for each pair of `couplings`.
    ///
    /// # Errors
    /// Invalid joints; a band or Stribeck speed that is not positive.
    pub fn new(
        dof: usize,
        identified_joints: &[usize],
        rotor: bool,
        friction: FrictionColumns,
        couplings: &[(usize, usize)],
    ) -> Result<Self, IdentError> {
        crate::log::check_joint_list(dof, identified_joints)?;
        positive("band_rad_per_s", friction.band_rad_per_s)?;
        if let Some(speed) = friction.stribeck_rad_per_s {
            positive("stribeck_rad_per_s", speed)?;
        }
        for (part, whole, without, expected) in [
            (
                friction.asymmetry,
                friction.viscous,
                "asymmetry alone",
                "viscous columns in addition to its asymmetry",
            ),
            (
                friction.load.is_some(),
                friction.coulomb,
                "load alone",
                "Coulomb columns in addition to its load",
            ),
        ] {
            if part && !whole {
                return Err(shape_error("friction", expected, without));
            }
        }
        let mut columns = Vec::new();
        for link in 0..dof {
            columns.extend((0..10).map(|entry| Column::Link { link, entry }));
        }
        for &joint in identified_joints {
            let wanted = [
                (rotor, Column::Rotor(joint)),
                (friction.viscous, Column::Viscous(joint)),
                (friction.coulomb, Column::Coulomb(joint)),
                (friction.offset, Column::Offset(joint)),
                (friction.asymmetry, Column::Asymmetry(joint)),
                (
                    friction.stribeck_rad_per_s.is_some(),
                    Column::Stribeck(joint),
                ),
                (
                    friction.stribeck_rad_per_s.is_some() && friction.asymmetry,
                    Column::StribeckOffset(joint),
                ),
                (friction.load.is_some(), Column::Load(joint)),
            ];
            columns.extend(
                wanted
                    .iter()
                    .filter(|(on, _)| *on)
                    .map(|(_, column)| *column),
            );
        }
        for &(a, b) in couplings {
            if a == b || !identified_joints.contains(&a) || !identified_joints.contains(&b) {
                let expected = format!("two of the moving joints {identified_joints:?}");
                return Err(shape_error("coupling", expected, format!("({a}, {b})")));
            }
            columns.extend([
                Column::CoupledRotor(a, b),
                Column::CoupledViscous(a, b),
                Column::CoupledCoulomb(a, b),
            ]);
        }
        Ok(Self {
            dof,
            identified_joints: identified_joints.to_vec(),
            friction,
            effects: Effects::default(),
            columns,
        })
    }

    /// Returns the columns with those of other effects appended.
    #[must_use]
    pub fn with_effects(mut self, effects: &Effects) -> Self {
        self.columns
            .extend(effect_columns(effects, &self.identified_joints));
        self.effects = effects.clone();
        self
    }

    /// Returns the other effects than friction.
    pub fn effects(&self) -> &Effects {
        &self.effects
    }

    /// Returns the number of joints of the arm.
    pub fn dof(&self) -> usize {
        self.dof
    }

    /// Returns the identified joints: those whose torques are modelled.
    pub fn identified_joints(&self) -> &[usize] {
        &self.identified_joints
    }

    /// Returns the friction columns of each identified joint.
    pub fn friction(&self) -> &FrictionColumns {
        &self.friction
    }

    /// Returns the columns, links first.
    pub fn list(&self) -> &[Column] {
        &self.columns
    }

    /// Returns the number of columns.
    pub fn len(&self) -> usize {
        self.columns.len()
    }

    /// Always false: an arm has links.
    pub fn is_empty(&self) -> bool {
        self.columns.is_empty()
    }

    /// Returns the index of a column.
    pub fn position(&self, column: Column) -> Option<usize> {
        self.columns.iter().position(|c| *c == column)
    }

    /// Returns the names, such as `Izz2` or `S0`: links and joints are counted from 0.
    pub fn names(&self) -> Vec<String> {
        let name = |column: &Column| match *column {
            Column::Link { link, entry } => format!("{}{link}", LINK_NAMES[entry]),
            Column::Rotor(j) => format!("Ir{j}"),
            Column::Viscous(j) => format!("V{j}"),
            Column::Coulomb(j) => format!("S{j}"),
            Column::Offset(j) => format!("offset{j}"),
            Column::Asymmetry(j) => format!("A{j}"),
            Column::Stribeck(j) => format!("B{j}"),
            Column::StribeckOffset(j) => format!("O{j}"),
            Column::Load(j) => format!("L{j}"),
            Column::CoupledRotor(a, b) => format!("Ir{a}+{b}"),
            Column::CoupledViscous(a, b) => format!("V{a}+{b}"),
            Column::CoupledCoulomb(a, b) => format!("S{a}+{b}"),
            Column::Spring(j) => format!("k{j}"),
            Column::Compliance(j) => format!("C{j}"),
            Column::TorqueScale(j) => format!("s{j}"),
            Column::MotorCoulomb(m) => format!("S of motor {m}"),
            Column::MotorViscous(m) => format!("V of motor {m}"),
            Column::Tilt(axis) => format!("tilt{}", ["x", "y"][axis.min(1)]),
        };
        self.columns.iter().map(name).collect()
    }

    /// Returns the linear constraints `sum c_i x_i >= 0`: friction is dissipative, rotor inertias are not negative. Each is
    /// a list of (index, coefficient).
    pub fn not_negative(&self) -> Vec<Vec<(usize, f64)>> {
        let mut forms = Vec::new();
        for (i, column) in self.columns.iter().enumerate() {
            match *column {
                Column::Link { .. }
                | Column::Offset(_)
                | Column::StribeckOffset(_)
                | Column::Tilt(_)
                | Column::TorqueScale(_) => {}
                Column::Asymmetry(joint) => {
                    let viscous = self.position(Column::Viscous(joint)).map(|v| (v, 1.0));
                    for sign in [1.0, -1.0] {
                        forms.push(viscous.into_iter().chain([(i, sign)]).collect());
                    }
                }
                _ => forms.push(vec![(i, 1.0)]),
            }
        }
        forms
    }
}

/// Returns the columns of effects for the identified joints.
fn effect_columns(effects: &Effects, identified_joints: &[usize]) -> Vec<Column> {
    let mut columns = Vec::new();
    for &joint in identified_joints {
        columns.extend(effects.springs.then_some(Column::Spring(joint)));
        columns.extend(effects.compliance.then_some(Column::Compliance(joint)));
        columns.extend(effects.torque_scale.then_some(Column::TorqueScale(joint)));
    }
    columns.extend(
        effects
            .motors(identified_joints)
            .iter()
            .flat_map(|motor| [Column::MotorCoulomb(*motor), Column::MotorViscous(*motor)]),
    );
    if effects.tilt {
        columns.extend([Column::Tilt(0), Column::Tilt(1)]);
    }
    columns
}
