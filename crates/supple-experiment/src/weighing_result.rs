//! Torque scales by a weight of known mass, as a calibration and `supple identify` report them.

use serde::{Deserialize, Serialize};
use supple_ident::weigh::Weighing;

/// Torque scales by a weight of known mass, and its centre of mass, with standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct WeighingResult {
    /// Mass of the weight \[kg\].
    pub weight_kg: f64,
    /// Ratio of true to logged torque of each identified joint.
    pub joints: Vec<JointTorqueScale>,
    /// Centre of mass in the last link's frame \[m\].
    pub com_m: [f64; 3],
    /// Its standard deviation \[m\].
    pub com_deviation_m: [f64; 3],
    /// What the logs do not tell apart, with a remedy.
    pub warnings: Vec<String>,
}

/// Torque scale of a joint.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointTorqueScale {
    /// Name of the joint.
    pub joint: String,
    /// Ratio of true to logged torque; `None` if it is not known within 5 %.
    pub torque_scale: Option<f64>,
    /// Its relative standard deviation; `None` if the weight does not load the joint.
    pub deviation: Option<f64>,
}

impl WeighingResult {
    /// Creates the result of [`supple_ident::weigh::weigh`] with the names of the identified joints.
    pub fn new(weight_kg: f64, found: &Weighing, names: &[String]) -> WeighingResult {
        let joints = names.iter().zip(&found.torque_scale);
        let joints = joints.zip(&found.torque_scale_deviation);
        WeighingResult {
            weight_kg,
            joints: joints
                .map(|((joint, torque_scale), deviation)| JointTorqueScale {
                    joint: joint.clone(),
                    torque_scale: *torque_scale,
                    deviation: deviation.is_finite().then_some(*deviation),
                })
                .collect(),
            com_m: found.com_m.into(),
            com_deviation_m: found.com_deviation_m.into(),
            warnings: found.warnings(names),
        }
    }

    /// Returns the lines of the summary.
    pub fn lines(&self) -> Vec<String> {
        let mm = |m: f64| 1e3 * m;
        let ([x, y, z], [dx, dy, dz]) = (self.com_m.map(mm), self.com_deviation_m.map(mm));
        let mut lines = vec![format!(
            "weight of {:.3} kg: centre of mass {x:.1}, {y:.1}, {z:.1} mm in the last link's frame, standard deviations {dx:.1}, \
             {dy:.1}, {dz:.1} mm",
            self.weight_kg
        )];
        for joint in &self.joints {
            lines.push(match (joint.torque_scale, joint.deviation) {
                (Some(scale), Some(deviation)) => format!(
                    "{}: true over logged torque {scale:.4}, standard deviation {:.2} %",
                    joint.joint,
                    100.0 * deviation
                ),
                _ => format!("{}: true over logged torque unknown", joint.joint),
            });
        }
        let warnings = self.warnings.iter();
        lines.extend(warnings.map(|warning| format!("warning: {warning}")));
        lines
    }
}
