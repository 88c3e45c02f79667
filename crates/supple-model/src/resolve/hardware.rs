//! Motors, transmission and tool.

use super::entry_count::wrong_count;
use super::joints::JointResolved;
use crate::error::{ModelError, Reporter};
use crate::settings::{MotorSettings, Settings};
use crate::xml::MAX_MAGNITUDE;
use nalgebra::DMatrix;
use supple_core::math::{Matrix3, Vector3};
use supple_core::ripple::{Harmonic, LINES, MAX_SHARE};
use supple_core::{Body, RippleTable};

/// Motors and transmission, one motor per joint, as many as moving joints.
#[derive(Clone, Debug, PartialEq)]
pub struct Motors {
    /// `m2jp`: joint angles from motor angles, `q = m2jp p`; motor torques are `m2jp^T tau`.
    pub joint_from_motor: DMatrix<f64>,
    /// `j2mp`, its inverse: motor angles from joint angles.
    pub motor_from_joint: DMatrix<f64>,
    /// Torque limits at the motors \[N m\].
    pub torque_nm: Vec<f64>,
    /// Resolution of each motor's torque command \[N m\]; `None` if it is continuous.
    pub torque_quantum_nm: Option<Vec<f64>>,
    /// Damping of each motor with shorted terminals \[N m s/rad\]; `None` if unknown.
    pub braking_nm_s_per_rad: Option<Vec<f64>>,
    /// Encoder counts per motor revolution; `None` if the position is continuous.
    pub counts_per_revolution: Option<u32>,
    /// Torque ripple of each motor.
    pub ripple: Vec<RippleTable>,
}

/// Force sensor and cap, mounted at the tip.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Inertia in the tip frame; `None` if the last link includes it.
    pub body: Option<Body>,
    /// Radius of the hemispherical cap, whose centre is the tip \[m\].
    pub cap_radius_m: f64,
}

/// Motors of the TOML, or one per joint at ratio 1 with the joints' torque limits.
pub(crate) fn motors(
    report: Reporter<'_>,
    settings: &Settings,
    joints: &[JointResolved],
) -> Result<Motors, ModelError> {
    let n = joints.len();
    let Some(motors) = &settings.motors else {
        return Ok(Motors {
            joint_from_motor: DMatrix::identity(n, n),
            motor_from_joint: DMatrix::identity(n, n),
            torque_nm: joints.iter().map(|joint| joint.torque_nm).collect(),
            torque_quantum_nm: None,
            braking_nm_s_per_rad: None,
            counts_per_revolution: None,
            ripple: vec![RippleTable::NONE; n],
        });
    };
    let list = |key: &str, values: &[f64]| {
        if values.len() != n {
            return Err(wrong_count(
                report,
                &format!("[motors] {key}"),
                values.len(),
                n,
            ));
        }
        let mut entries = values.iter().enumerate();
        entries.try_for_each(|(i, value)| report.positive(&format!("[motors] {key}[{i}]"), *value))
    };
    list("torque_nm", &motors.torque_nm)?;
    if let Some(quanta) = &motors.torque_quantum_nm {
        list("torque_quantum_nm", quanta)?;
    }
    if let Some(braking) = &motors.braking_nm_s_per_rad {
        list("braking_nm_s_per_rad", braking)?;
    }
    if motors.counts_per_revolution == Some(0) {
        return Err(report.invalid(
            "[motors] counts_per_revolution",
            "must be above zero",
            0,
            "give the encoder's counts, or leave it out for a continuous position",
        ));
    }
    let joint_from_motor = match &motors.joint_from_motor {
        Some(rows) => matrix(report, "[motors] joint_from_motor", rows, n)?,
        None => DMatrix::identity(n, n),
    };
    let inverse = joint_from_motor.clone().try_inverse();
    let motor_from_joint = inverse.filter(|m| m.iter().all(|x| x.is_finite() && x.abs() < 1e6));
    let Some(motor_from_joint) = motor_from_joint else {
        return Err(report.invalid(
            "[motors] joint_from_motor",
            "must be invertible",
            format!("{:?}", motors.joint_from_motor),
            "correct it: the motors must move every joint independently",
        ));
    };
    Ok(Motors {
        joint_from_motor,
        motor_from_joint,
        torque_nm: motors.torque_nm.clone(),
        torque_quantum_nm: motors.torque_quantum_nm.clone(),
        braking_nm_s_per_rad: motors.braking_nm_s_per_rad.clone(),
        counts_per_revolution: motors.counts_per_revolution,
        ripple: ripple(report, motors, n)?,
    })
}

/// Harmonics of each motor.
fn ripple(
    report: Reporter<'_>,
    motors: &MotorSettings,
    n: usize,
) -> Result<Vec<RippleTable>, ModelError> {
    let mut lines = vec![Vec::new(); n];
    for (i, entry) in motors.ripple.iter().enumerate() {
        let element = |key: &str| format!("[motors] ripple[{i}] {key}");
        report.finite(&element("sine_nm"), entry.sine_nm)?;
        report.finite(&element("cosine_nm"), entry.cosine_nm)?;
        for (key, share) in [
            ("sine_share", entry.sine_share),
            ("cosine_share", entry.cosine_share),
        ] {
            if !(-MAX_SHARE..=MAX_SHARE).contains(&share) {
                return Err(report.invalid(
                    element(key),
                    format!("must be from -{MAX_SHARE} to {MAX_SHARE}"),
                    share,
                    "give the variation of the motor's torque constant as a share of it",
                ));
            }
        }
        if entry.motor >= n {
            return Err(report.invalid(
                element("motor"),
                format!("must be below the number of motors, {n}"),
                entry.motor,
                "count motors from 0",
            ));
        }
        if entry.harmonic == 0 {
            return Err(report.invalid(
                element("harmonic"),
                "must be 1 or more",
                0,
                "a constant torque is not ripple: put it into offset_nm of the joint",
            ));
        }
        lines[entry.motor].push(Harmonic {
            harmonic: entry.harmonic,
            sine_nm: entry.sine_nm,
            cosine_nm: entry.cosine_nm,
            sine_share: entry.sine_share,
            cosine_share: entry.cosine_share,
        });
    }
    let tables = lines.iter().enumerate().map(|(motor, lines)| {
        RippleTable::new(lines).ok_or_else(|| {
            report.invalid(
                format!("[motors] ripple of motor {motor}"),
                format!("must have at most {LINES} harmonics"),
                lines.len(),
                "keep the largest",
            )
        })
    });
    tables.collect()
}

fn matrix(
    report: Reporter<'_>,
    element: &str,
    rows: &[Vec<f64>],
    n: usize,
) -> Result<DMatrix<f64>, ModelError> {
    if rows.len() != n {
        return Err(wrong_count(report, element, rows.len(), n));
    }
    for (i, row) in rows.iter().enumerate() {
        if row.len() != n {
            return Err(wrong_count(
                report,
                &format!("{element}[{i}]"),
                row.len(),
                n,
            ));
        }
        for (j, value) in row.iter().enumerate() {
            report.finite(&format!("{element}[{i}][{j}]"), *value)?;
        }
    }
    Ok(DMatrix::from_fn(n, n, |i, j| rows[i][j]))
}

/// Returns the tool; its default inertia is that of a ball.
pub(crate) fn tool(report: Reporter<'_>, settings: &Settings) -> Result<Option<Tool>, ModelError> {
    let Some(tool) = &settings.tool else {
        return Ok(None);
    };
    report.positive("[tool] cap_radius_m", tool.cap_radius_m)?;
    report.within("[tool] cap_radius_m", tool.cap_radius_m, 1e-6..=1.0, "m")?;
    let Some(mass_kg) = tool.mass_kg else {
        if tool.com_m.is_some() || tool.inertia_kg_m2.is_some() {
            return Err(report.invalid(
                "[tool] mass_kg",
                "must be given with com_m or inertia_kg_m2",
                "none",
                "add mass_kg, or remove the two: the mass is then the URDF's",
            ));
        }
        return Ok(Some(Tool {
            body: None,
            cap_radius_m: tool.cap_radius_m,
        }));
    };
    let com_m = tool.com_m.map_or(Vector3::zeros(), Vector3::from);
    let body = match tool.inertia_kg_m2 {
        None => Body::ball(mass_kg, tool.cap_radius_m, com_m),
        Some([xx, yy, zz, xy, xz, yz]) => Body {
            mass_kg,
            com_m,
            inertia_kg_m2: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        },
    };
    let mut entries = body.com_m.iter().chain(body.inertia_kg_m2.iter());
    if mass_kg > MAX_MAGNITUDE || entries.any(|x| x.abs() > MAX_MAGNITUDE) {
        return Err(report.invalid(
            "[tool]",
            format!("must have no number above {MAX_MAGNITUDE:e}"),
            format!(
                "mass {mass_kg} kg, com {:?} m, inertia {:?}",
                tool.com_m, tool.inertia_kg_m2
            ),
            "give SI units: kg, m, kg m^2",
        ));
    }
    body.validate().map_err(|error| {
        report.invalid(
            "[tool]",
            error.to_string(),
            format!(
                "mass {mass_kg} kg, com {:?} m, inertia {:?}",
                tool.com_m, tool.inertia_kg_m2
            ),
            "give inertia about the centre of mass in kg m^2, or leave it out",
        )
    })?;
    Ok(Some(Tool {
        body: Some(body),
        cap_radius_m: tool.cap_radius_m,
    }))
}
