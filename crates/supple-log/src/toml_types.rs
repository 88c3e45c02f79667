//! serde mirror types of the core's types. The core does not depend on serde; the remote derive checks the fields
//! against it.

use serde::{Deserialize, Serialize};
use supple_core::config::{
    ApparentInertia, Border, Collision, ContactLatch, FrictionVelocity, Gains, JointGains, Law,
    Limits, PlausibilityLimits, PoseLaw, Role, RotationalGains, Workspace, Zone,
};
use supple_core::friction::LoadTorque;
use supple_core::math::{Matrix3, Vector3};
use supple_core::ripple::Harmonic;
use supple_core::workspace::MAX_BORDERS_OR_ZONES;
use supple_core::{Friction, Link, Pose, RippleTable, Vector};

#[derive(Serialize, Deserialize)]
#[serde(remote = "Pose", deny_unknown_fields)]
pub(crate) struct PoseDef {
    #[serde(with = "rows")]
    rotation: Matrix3<f64>,
    #[serde(with = "column")]
    translation: Vector3<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Link", deny_unknown_fields)]
pub(crate) struct LinkDef {
    mass: f64,
    #[serde(with = "column")]
    first_moment: Vector3<f64>,
    #[serde(with = "rows")]
    inertia: Matrix3<f64>,
    #[serde(with = "rows")]
    link_from_joint: Matrix3<f64>,
    #[serde(with = "PoseDef")]
    parent_from_joint: Pose,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Friction", deny_unknown_fields)]
pub(crate) struct FrictionDef {
    viscous_nm_s_per_rad: f64,
    #[serde(default)]
    viscous_asymmetry_nm_s_per_rad: f64,
    coulomb_nm: f64,
    breakaway_nm: f64,
    stribeck_rad_per_s: f64,
    offset_nm: f64,
    #[serde(default)]
    stribeck_offset_nm: f64,
    band_rad_per_s: f64,
    #[serde(default)]
    presliding_rad: f64,
    #[serde(default)]
    load_coefficient: f64,
    #[serde(default, with = "LoadTorqueDef")]
    load_torque: LoadTorque,
    #[serde(default)]
    coulomb_at_nm: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "LoadTorque", rename_all = "snake_case")]
enum LoadTorqueDef {
    Joint,
    Motor,
}

/// One harmonic of the ripple tables, which are stored as one list.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct RippleDef {
    motor: usize,
    harmonic: u32,
    sine_nm: f64,
    cosine_nm: f64,
    /// Missing in older logs.
    #[serde(default)]
    sine_share: f64,
    #[serde(default)]
    cosine_share: f64,
}

impl RippleDef {
    pub fn list<const N: usize>(tables: &[RippleTable; N]) -> Vec<RippleDef> {
        let lines = tables.iter().enumerate().flat_map(|(motor, table)| {
            table.harmonics().iter().map(move |line| RippleDef {
                motor,
                harmonic: line.harmonic,
                sine_nm: line.sine_nm,
                cosine_nm: line.cosine_nm,
                sine_share: line.sine_share,
                cosine_share: line.cosine_share,
            })
        });
        lines.collect()
    }

    /// # Errors
    /// Description of an unknown motor or an invalid table.
    pub fn tables<const N: usize>(list: &[RippleDef]) -> Result<[RippleTable; N], String> {
        if let Some(line) = list.iter().find(|line| line.motor >= N) {
            return Err(format!(
                "ripple of motor {}, the arm has {N} motors",
                line.motor
            ));
        }
        let mut tables = [RippleTable::NONE; N];
        for (motor, table) in tables.iter_mut().enumerate() {
            let lines = list.iter().filter(|line| line.motor == motor);
            let lines: Vec<Harmonic> = lines
                .map(|line| Harmonic {
                    harmonic: line.harmonic,
                    sine_nm: line.sine_nm,
                    cosine_nm: line.cosine_nm,
                    sine_share: line.sine_share,
                    cosine_share: line.cosine_share,
                })
                .collect();
            *table = RippleTable::new(&lines)
                .ok_or_else(|| format!("the ripple of motor {motor} is invalid"))?;
        }
        Ok(tables)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Role", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum RoleDef {
    Active,
    Held {
        position_rad: f64,
        stiffness_nm_per_rad: f64,
        damping_nm_s_per_rad: f64,
    },
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Gains", deny_unknown_fields)]
struct GainsDef {
    #[serde(with = "column")]
    stiffness_n_per_m: Vector3<f64>,
    #[serde(with = "column")]
    damping_n_s_per_m: Vector3<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "ApparentInertia", rename_all = "snake_case")]
enum ApparentInertiaDef {
    Own,
    Chosen(#[serde(with = "rows")] Matrix3<f64>),
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "FrictionVelocity", rename_all = "snake_case")]
enum FrictionVelocityDef {
    Reference,
    Measured,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Law", deny_unknown_fields)]
pub(crate) struct LawDef {
    #[serde(with = "FrictionVelocityDef")]
    friction_velocity: FrictionVelocity,
    /// Older logs lack this entry.
    #[serde(default)]
    measured_stribeck: bool,
    /// Older logs lack this entry, too.
    #[serde(default = "whole")]
    presliding_share: f64,
    inertial_feedforward: bool,
    nullspace_damping_nm_s_per_rad: f64,
    #[serde(with = "ApparentInertiaDef")]
    inertia: ApparentInertia,
    #[serde(with = "GainsDef")]
    gains: Gains,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "ContactLatch", deny_unknown_fields)]
pub(crate) struct ContactLatchDef {
    fade: bool,
    observer_rad_per_s: f64,
    threshold_n: f64,
    friction_error: f64,
    contact_share: f64,
    reversal_s: f64,
    fade_s: f64,
    restore_s: f64,
    /// Older logs lack these four entries and are replayed without them.
    #[serde(default)]
    settle_s: f64,
    #[serde(default)]
    hold_friction: bool,
    #[serde(default = "infinite")]
    false_alarms_per_hour: f64,
    #[serde(default = "infinite")]
    release_s: f64,
}

fn whole() -> f64 {
    1.0
}

fn infinite() -> f64 {
    f64::INFINITY
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "JointGains", deny_unknown_fields)]
pub(crate) struct JointGainsDef<const N: usize> {
    #[serde(with = "column")]
    stiffness_nm_per_rad: Vector<N>,
    #[serde(with = "column")]
    damping_nm_s_per_rad: Vector<N>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "RotationalGains", deny_unknown_fields)]
pub(crate) struct RotationalGainsDef {
    #[serde(with = "column")]
    stiffness_nm_per_rad: Vector3<f64>,
    #[serde(with = "column")]
    damping_nm_s_per_rad: Vector3<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PoseLaw", deny_unknown_fields)]
pub(crate) struct PoseLawDef<const N: usize> {
    max_stiffness_nm_per_rad: f64,
    max_damping_nm_s_per_rad: f64,
    angular_speed_rad_per_s: f64,
    rotation_error_rad: f64,
    #[serde(with = "column")]
    posture_stiffness_nm_per_rad: Vector<N>,
    #[serde(with = "column")]
    posture_torque_nm: Vector<N>,
    #[serde(with = "RotationalGainsDef")]
    gains: RotationalGains,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "Limits", deny_unknown_fields)]
pub(crate) struct LimitsDef<const N: usize> {
    #[serde(with = "column")]
    position_lower_rad: Vector<N>,
    #[serde(with = "column")]
    position_upper_rad: Vector<N>,
    soft_zone_rad: f64,
    #[serde(with = "column")]
    soft_stiffness_nm_per_rad: Vector<N>,
    #[serde(with = "column")]
    soft_damping_nm_s_per_rad: Vector<N>,
    #[serde(with = "column")]
    joint_speed_rad_per_s: Vector<N>,
    tip_speed_m_per_s: f64,
    #[serde(default = "max_rate")]
    tip_acceleration_m_per_s2: f64,
    #[serde(with = "column", default = "max_rate_per_joint")]
    joint_acceleration_rad_per_s2: Vector<N>,
    #[serde(with = "column", default = "max_rate_per_joint")]
    joint_jerk_rad_per_s3: Vector<N>,
    tracking_error_m: f64,
    joint_tracking_error_rad: f64,
    #[serde(with = "column")]
    joint_torque_nm: Vector<N>,
    #[serde(with = "column")]
    motor_torque_nm: Vector<N>,
    #[serde(with = "column")]
    torque_rate_nm_per_s: Vector<N>,
    stale_cycles: u32,
    start_error_m: f64,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
}

/// Returns the acceleration and jerk limits of logs that were written before these limits existed: the maximum that the
/// controller accepts.
fn max_rate() -> f64 {
    1e3
}

fn max_rate_per_joint<const N: usize>() -> Vector<N> {
    Vector::repeat(1e4)
}

/// Older logs contain a fraction of both thresholds instead of the thresholds of the move mode.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CollisionDef<const N: usize> {
    #[serde(with = "column")]
    joint_torque_nm: Vector<N>,
    tip_force_n: f64,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    move_share: Option<f64>,
    #[serde(default = "Vector::zeros", with = "column")]
    move_joint_torque_nm: Vector<N>,
    #[serde(default)]
    move_tip_force_n: f64,
}

impl<const N: usize> CollisionDef<N> {
    pub fn new(collision: &Collision<N>) -> CollisionDef<N> {
        CollisionDef {
            joint_torque_nm: collision.joint_torque_nm,
            tip_force_n: collision.tip_force_n,
            move_share: None,
            move_joint_torque_nm: collision.move_joint_torque_nm,
            move_tip_force_n: collision.move_tip_force_n,
        }
    }

    pub fn collision(&self) -> Collision<N> {
        let (move_joint_torque_nm, move_tip_force_n) = match self.move_share {
            Some(share) => (share * self.joint_torque_nm, share * self.tip_force_n),
            None => (self.move_joint_torque_nm, self.move_tip_force_n),
        };
        Collision {
            joint_torque_nm: self.joint_torque_nm,
            tip_force_n: self.tip_force_n,
            move_joint_torque_nm,
            move_tip_force_n,
        }
    }
}

fn one() -> f64 {
    1.0
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "PlausibilityLimits", deny_unknown_fields)]
pub(crate) struct PlausibilityDef {
    lost_replies: u32,
    stuck_rad: f64,
    /// Older logs lack this entry.
    #[serde(default = "one")]
    stiction_factor: f64,
    against_share: f64,
    load_n: f64,
}

/// A wall or a box of the workspace; only the entries of its kind are present.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum BorderDef {
    Wall {
        normal: [f64; 3],
        offset_m: f64,
    },
    KeepOut {
        lower_m: [f64; 3],
        upper_m: [f64; 3],
    },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ZoneDef {
    lower_m: [f64; 3],
    upper_m: [f64; 3],
    tip_speed_m_per_s: f64,
    tip_force_n: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct WorkspaceDef {
    margin_m: f64,
    stiffness_n_per_m: f64,
    damping_n_s_per_m: f64,
    #[serde(default)]
    borders: Vec<BorderDef>,
    #[serde(default)]
    zones: Vec<ZoneDef>,
}

impl WorkspaceDef {
    pub fn new(workspace: &Workspace) -> WorkspaceDef {
        let borders = workspace
            .borders
            .iter()
            .flatten()
            .map(|border| match border {
                Border::Wall { normal, offset_m } => BorderDef::Wall {
                    normal: (*normal).into(),
                    offset_m: *offset_m,
                },
                Border::KeepOut { lower_m, upper_m } => BorderDef::KeepOut {
                    lower_m: (*lower_m).into(),
                    upper_m: (*upper_m).into(),
                },
            });
        let zones = workspace.zones.iter().flatten().map(|zone| ZoneDef {
            lower_m: zone.lower_m.into(),
            upper_m: zone.upper_m.into(),
            tip_speed_m_per_s: zone.tip_speed_m_per_s,
            tip_force_n: zone.tip_force_n,
        });
        WorkspaceDef {
            margin_m: workspace.margin_m,
            stiffness_n_per_m: workspace.stiffness_n_per_m,
            damping_n_s_per_m: workspace.damping_n_s_per_m,
            borders: borders.collect(),
            zones: zones.collect(),
        }
    }

    /// # Errors
    /// Description of too many boundaries or zones.
    pub fn workspace(&self) -> Result<Workspace, String> {
        if self.borders.len().max(self.zones.len()) > MAX_BORDERS_OR_ZONES {
            return Err(format!(
                "more than {MAX_BORDERS_OR_ZONES} boundaries or zones"
            ));
        }
        let border = |border: &BorderDef| match border {
            BorderDef::Wall { normal, offset_m } => Border::Wall {
                normal: Vector3::from(*normal),
                offset_m: *offset_m,
            },
            BorderDef::KeepOut { lower_m, upper_m } => Border::KeepOut {
                lower_m: Vector3::from(*lower_m),
                upper_m: Vector3::from(*upper_m),
            },
        };
        let zone = |zone: &ZoneDef| Zone {
            lower_m: Vector3::from(zone.lower_m),
            upper_m: Vector3::from(zone.upper_m),
            tip_speed_m_per_s: zone.tip_speed_m_per_s,
            tip_force_n: zone.tip_force_n,
        };
        Ok(Workspace {
            borders: core::array::from_fn(|i| self.borders.get(i).map(border)),
            zones: core::array::from_fn(|i| self.zones.get(i).map(zone)),
            margin_m: self.margin_m,
            stiffness_n_per_m: self.stiffness_n_per_m,
            damping_n_s_per_m: self.damping_n_s_per_m,
        })
    }
}

/// A column vector as a list.
pub(crate) mod column {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};
    use supple_core::Vector;

    pub fn serialize<S: Serializer, const K: usize>(
        column: &Vector<K>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(column.iter())
    }

    pub fn deserialize<'de, D: Deserializer<'de>, const K: usize>(
        deserializer: D,
    ) -> Result<Vector<K>, D::Error> {
        let list = Vec::<f64>::deserialize(deserializer)?;
        let found = list.len();
        let array: [f64; K] = list
            .try_into()
            .map_err(|_| D::Error::invalid_length(found, &"one entry per joint or axis"))?;
        Ok(Vector::from(array))
    }
}

/// A matrix as a list of rows.
pub(crate) mod rows {
    use serde::de::Error;
    use serde::{Deserialize, Deserializer, Serializer};
    use supple_core::Matrix;

    pub fn serialize<S: Serializer, const R: usize, const C: usize>(
        matrix: &Matrix<R, C>,
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(
            (0..R).map(|r| core::array::from_fn::<f64, C, _>(|c| matrix[(r, c)]).to_vec()),
        )
    }

    pub fn deserialize<'de, D: Deserializer<'de>, const R: usize, const C: usize>(
        deserializer: D,
    ) -> Result<Matrix<R, C>, D::Error> {
        let rows = Vec::<Vec<f64>>::deserialize(deserializer)?;
        if rows.len() != R {
            return Err(D::Error::invalid_length(rows.len(), &"a row per row"));
        }
        if let Some(row) = rows.iter().find(|row| row.len() != C) {
            return Err(D::Error::invalid_length(row.len(), &"an entry per column"));
        }
        Ok(Matrix::from_fn(|r, c| rows[r][c]))
    }
}
