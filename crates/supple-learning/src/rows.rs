//! Equations of the unknowns, one per joint and sample.
//!
//! With the generalised momentum `p = H qd` and a low-pass filter `F`, the torque that the model needs is
//!
//! ```text
//! F[p' - C^T qd + G + D] = b (p - F p) + F[G + D - C^T qd]
//! ```
//!
//! (with the gain `b` the first term is the filtered difference of `p`). The filtered command minus this torque is
//! the prediction error; the columns of the unknowns pass `F` too. Before `F`, command and angle pass the filter whose
//! derivative is the velocity estimate, so that angle, velocity and torque belong to the same time; the command is
//! delayed by the delay of the drives. Dry friction has the direction of [`Friction::direction_after`] if the presliding distance
//! is known, along the travel that the encoder resolves, otherwise the direction of the velocity.
//!
//! [`Friction::direction_after`]: supple_core::Friction::direction_after

use crate::prior::unknowns::{
    ALL, COULOMB, MAP_DRY, MAP_TORQUE, MOMENT, OFFSET, PAYLOAD, PRESLIDING, SCALE, STRIBECK,
    STRIBECK_OFFSET, TILT, VISCOUS,
};
use crate::travel::Travel;
use std::collections::VecDeque;
use supple_core::controller::CycleRecord;
use supple_core::dynamics::{Terms, terms};
use supple_core::learned::MapWeights;
use supple_core::learned_torque::{payload_torque_nm, tilt_torque_nm};
use supple_core::math::{Vector3, abs, exp};
use supple_core::{Config, Friction, Vector};

/// Bandwidth of the filter `F` \[rad/s\].
pub const FILTER_RAD_PER_S: f64 = 40.0;
/// Delay from a command to the torque of the drives, in cycles.
pub const DRIVE_DELAY_CYCLES: usize = 1;

/// One equation: `columns . unknowns = error_nm`.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Columns, in the order of [`crate::unknowns`].
    pub columns: [f64; ALL],
    /// Commanded torque minus the model's torque \[N m\].
    pub error_nm: f64,
}

impl Row {
    pub(crate) const ZERO: Row = Row {
        columns: [0.0; ALL],
        error_nm: 0.0,
    };

    pub(crate) fn add(&mut self, other: &Row) {
        for (column, other) in self.columns.iter_mut().zip(&other.columns) {
            *column += other;
        }
        self.error_nm += other.error_nm;
    }

    pub(crate) fn scaled(&self, factor: f64) -> Row {
        Row {
            columns: self.columns.map(|column| column * factor),
            error_nm: self.error_nm * factor,
        }
    }
}

/// Filters of an arm.
#[derive(Clone, Debug)]
pub struct Rows<const N: usize> {
    config: Config<N>,
    terms: Terms<N>,
    /// Gains of the two filters.
    aligning: f64,
    filter: f64,
    started: bool,
    position: [Vector<N>; 2],
    torque: [Vector<N>; 2],
    commands: VecDeque<Vector<N>>,
    /// Direction of each joint's dry friction, -1 to 1.
    direction: Vector<N>,
    /// Derivative of this direction with respect to the logarithm of the presliding distance.
    by_presliding: Vector<N>,
    /// Travel of each joint.
    travel: [Travel; N],
    /// `F p`, and `F[G + D - C^T qd]`, `F[tau]`.
    momentum: Vector<N>,
    model: Vector<N>,
    command: Vector<N>,
    /// `F` of the tip's velocity.
    tip_velocity: Vector3<f64>,
    /// `F` of the columns.
    columns: Vec<[f64; ALL]>,
}

impl<const N: usize> Rows<N> {
    /// Creates the filters before the first cycle.
    pub fn new(config: &Config<N>) -> Rows<N> {
        let gain = |rad_per_s: f64| 1.0 - exp(-rad_per_s * config.period_s);
        Rows {
            terms: Terms::default(),
            aligning: gain(config.estimator_rad_per_s),
            filter: gain(FILTER_RAD_PER_S),
            started: false,
            position: [Vector::zeros(); 2],
            torque: [Vector::zeros(); 2],
            commands: VecDeque::new(),
            direction: Vector::zeros(),
            by_presliding: Vector::zeros(),
            travel: [Travel::new(); N],
            momentum: Vector::zeros(),
            model: Vector::zeros(),
            command: Vector::zeros(),
            tip_velocity: Vector3::zeros(),
            columns: vec![[0.0; ALL]; N],
            config: *config,
        }
    }

    /// Returns the direction of each joint's dry friction, -1 to 1.
    pub fn direction(&self) -> &Vector<N> {
        &self.direction
    }

    /// Forgets all cycles; the filters settle again after some of their time constants.
    pub fn restart(&mut self) {
        self.started = false;
    }

    /// Passes a cycle through the filters; returns the equations of all joints.
    pub fn add_cycle(&mut self, record: &CycleRecord<N>) -> Vec<Row> {
        let velocity = &record.velocity_rad_per_s;
        let first = !self.started;
        // The model's torque contains neither the torque ripple nor its compensation.
        let command = record.torque_nm - record.torques.ripple;
        if first {
            self.started = true;
            self.position = [record.position_rad; 2];
            for (travel, angle_rad) in self.travel.iter_mut().zip(&record.position_rad) {
                travel.begin_at(*angle_rad);
            }
            self.torque = [command; 2];
            self.commands = vec![command; DRIVE_DELAY_CYCLES + 1].into();
        }
        self.commands.push_back(command);
        let acting = self.commands.pop_front().unwrap_or(command);
        let gain = self.aligning;
        for (stages, new) in [
            (&mut self.position, &record.position_rad),
            (&mut self.torque, &acting),
        ] {
            stages[0] += (new - stages[0]) * gain;
            stages[1] = stages[1] + (stages[0] - stages[1]) * gain;
        }
        let (q, config) = (self.position[1], &self.config);
        terms(&config.arm, &q, velocity, &mut self.terms);
        let loaded: [Friction; N] =
            core::array::from_fn(|i| config.friction[i].at_load(self.terms.gravity[i]));
        for i in 0..N {
            let friction = &loaded[i];
            if friction.presliding_rad == 0.0 || first {
                self.direction[i] = friction.direction(velocity[i]);
                self.by_presliding[i] = 0.0;
                continue;
            }
            let measured_rad = record.position_rad[i];
            let travel_rad = self.travel[i].to(measured_rad, q[i], friction.presliding_rad);
            if travel_rad != 0.0 {
                let before = (self.direction[i], self.by_presliding[i]);
                self.direction[i] = friction.direction_after(before.0, travel_rad);
                self.by_presliding[i] =
                    derivative_after(before, travel_rad, friction.presliding_rad);
            }
        }
        let direction = self.direction;
        let friction = Vector::<N>::from_fn(|i, _| {
            let (friction, velocity) = (&loaded[i], velocity[i]);
            friction.viscous_torque_nm(velocity)
                + friction.offset_at_nm(velocity)
                + friction.dry_size_nm(velocity) * direction[i]
        });
        let model = self.terms.gravity + friction - self.terms.kinetic_gradient;
        let tip_velocity = self.terms.jacobian.fixed_rows::<3>(0) * velocity;
        if first {
            self.momentum = self.terms.momentum;
            self.model = model;
            self.command = self.torque[1];
            self.tip_velocity = tip_velocity;
        }
        let a = self.filter;
        // The quantity minus its filtered value gives its filtered difference quotient.
        let rate = a / ((1.0 - a) * config.period_s);
        self.momentum += (self.terms.momentum - self.momentum) * a;
        self.model += (model - self.model) * a;
        self.command += (self.torque[1] - self.command) * a;
        self.tip_velocity += (tip_velocity - self.tip_velocity) * a;
        let needed = (self.terms.momentum - self.momentum) * rate + self.model;
        let acceleration = (tip_velocity - self.tip_velocity) * rate;

        let raw = self.columns_now(&q, velocity, &loaded);
        let payload_inertia = payload_columns(&self.terms, &acceleration);
        let mut rows = Vec::with_capacity(N);
        for (i, raw) in raw.iter().enumerate() {
            let filtered = &mut self.columns[i];
            for (filtered, raw) in filtered.iter_mut().zip(raw) {
                *filtered = if first {
                    *raw
                } else {
                    *filtered + (raw - *filtered) * a
                };
            }
            let mut columns = *filtered;
            for (k, column) in payload_inertia.iter().enumerate() {
                columns[PAYLOAD + k] += column[i];
            }
            columns[SCALE] = needed[i];
            rows.push(Row {
                columns,
                error_nm: self.command[i] - needed[i],
            });
        }
        rows
    }

    /// Returns the columns before the filter, without the inertia of the payload and without the torque scale.
    fn columns_now(
        &self,
        q: &Vector<N>,
        velocity: &Vector<N>,
        loaded: &[Friction; N],
    ) -> Vec<[f64; ALL]> {
        let config = &self.config;
        let gravity = config.arm.gravity();
        let weight = payload_columns(&self.terms, &-gravity);
        let tilt: [Vector<N>; 3] = core::array::from_fn(|axis| {
            let mut unit = Vector3::zeros();
            unit[axis] = 1.0;
            tilt_torque_nm(&self.terms, &gravity, &unit)
        });
        (0..N)
            .map(|i| {
                let direction = self.direction[i];
                let lower = config.limits.position_lower_rad[i];
                let upper = config.limits.position_upper_rad[i];
                let map = MapWeights::new(q[i], lower, upper);
                let mut columns = [0.0; ALL];
                columns[VISCOUS] = velocity[i];
                columns[COULOMB] = direction;
                columns[OFFSET] = 1.0;
                let loaded = &loaded[i];
                columns[PRESLIDING] = loaded.dry_size_nm(velocity[i]) * self.by_presliding[i];
                columns[STRIBECK_OFFSET] = loaded.stribeck_share(velocity[i]);
                columns[STRIBECK] = columns[STRIBECK_OFFSET] * direction;
                for (k, weight) in map.weights.iter().enumerate() {
                    columns[MAP_TORQUE + map.first + k] = *weight;
                    columns[MAP_DRY + map.first + k] = weight * direction;
                }
                for (k, column) in weight.iter().enumerate() {
                    columns[PAYLOAD + k] = column[i];
                }
                for (k, column) in tilt.iter().enumerate() {
                    columns[TILT + k] = column[i];
                }
                columns
            })
            .collect()
    }
}

/// Returns the derivative of the direction of dry friction with respect to the logarithm of the presliding distance after some travel;
/// `before` are the direction and its derivative before it.
fn derivative_after(before: (f64, f64), travel_rad: f64, presliding_rad: f64) -> f64 {
    let (direction, derivative) = before;
    let (to, relative) = (
        1.0_f64.copysign(travel_rad),
        abs(travel_rad) / presliding_rad,
    );
    (derivative + (direction - to) * relative) * exp(-relative)
}

/// Returns the torques of a unit mass, and of each unit of its first moment.
fn payload_columns<const N: usize>(
    terms: &Terms<N>,
    force_n_per_kg: &Vector3<f64>,
) -> [Vector<N>; 4] {
    const { assert!(MOMENT == PAYLOAD + 1) };
    core::array::from_fn(|k| {
        let mut moment = Vector3::zeros();
        if k > 0 {
            moment[k - 1] = 1.0;
        }
        let mass = if k == 0 { 1.0 } else { 0.0 };
        payload_torque_nm(terms, force_n_per_kg, mass, &moment)
    })
}

#[cfg(test)]
mod tests {
    use super::derivative_after;
    use supple_core::Friction;

    /// The derivative is that of the law, by differences, also after reversals within the presliding distance.
    #[test]
    fn the_derivative_by_the_presliding_distance_is_that_of_the_friction() {
        let (presliding_rad, h) = (2e-3, 1e-5);
        let after = |presliding_rad: f64, travels_rad: &[f64]| {
            let friction = Friction {
                presliding_rad,
                ..Friction::coulomb(0.1, 0.5)
            };
            let along = travels_rad.iter();
            along.fold(0.2, |direction, travel_rad| {
                friction.direction_after(direction, *travel_rad)
            })
        };
        let travels_rad = [1e-3, -4e-4, -3e-3, 2e-4, 5e-3, 1e-2, -1e-3, -2e-3];
        let mut derivative = 0.0;
        for k in 0..travels_rad.len() {
            let direction = after(presliding_rad, &travels_rad[..k]);
            derivative = derivative_after((direction, derivative), travels_rad[k], presliding_rad);
            let of = |factor: f64| after(presliding_rad * factor, &travels_rad[..=k]);
            let expected = (of(1.0 + h) - of(1.0 - h)) / (2.0 * h);
            assert!(
                (derivative - expected).abs() < 1e-7,
                "{k}: {derivative}, {expected}"
            );
        }
        assert!(derivative.abs() > 0.1, "{derivative}");
    }
}
