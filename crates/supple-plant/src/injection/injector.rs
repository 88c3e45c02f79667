//! Applies injected faults to a plant.

pub use super::view::ControllerView;

use super::InjectionError;
use super::kinds::{Injection, InjectionKind, Trigger};
use crate::error::PlantError;
use crate::plant::Plant;
use core::array;
use std::collections::VecDeque;
use supple_core::{Matrix, Vector};

/// Runs a plant with injected faults: modifies its encoder readings and torque commands. Without injections all values pass
/// unchanged, bit for bit.
#[derive(Clone, Debug)]
pub struct Injector<const N: usize> {
    scheduled: Vec<ScheduledInjection<N>>,
    /// Number of plant cycles so far.
    cycle: u64,
    cycle_s: f64,
    joint_from_motor: Matrix<N, N>,
    motor_from_joint: Matrix<N, N>,
    /// Encoder readings.
    position_rad: Vector<N>,
}

#[derive(Clone, Debug)]
struct ScheduledInjection<const N: usize> {
    injection: Injection,
    /// Cycle at which the injection begins; `None` until its trigger has occurred.
    due: Option<u64>,
    begun: bool,
    /// Angles reported when the injection began.
    start_rad: Vector<N>,
    /// Delayed angles or torques.
    pending: VecDeque<Vector<N>>,
    /// Length of the delay in plant cycles.
    delay: usize,
    /// Number of replies of each joint since the injection began.
    replies: [u32; N],
}

impl<const N: usize> Injector<N> {
    /// Returns the injector without injections.
    pub fn none(plant: &Plant<N>) -> Self {
        let config = plant.config();
        let joint_from_motor = config.actuators.joint_from_motor;
        Injector {
            scheduled: Vec::new(),
            cycle: 0,
            cycle_s: config.cycle_s,
            // The plant has checked that its transmission is regular.
            motor_from_joint: joint_from_motor
                .try_inverse()
                .unwrap_or_else(Matrix::identity),
            joint_from_motor,
            position_rad: plant.measurement().position_rad,
        }
    }

    /// Creates an injector for a plant that has not moved yet; injections with [`Trigger::AtStart`] begin here. Delays count in
    /// control cycles of `period_s`; the cycle of the plant may be shorter.
    ///
    /// # Errors
    /// [`InjectionError::Index`] for a joint or motor that the arm does not have; [`InjectionError::Value`] for a value out
    /// of its range.
    pub fn new(
        injections: &[Injection],
        plant: &mut Plant<N>,
        period_s: f64,
    ) -> Result<Self, InjectionError> {
        for injection in injections {
            // Check the ranges again, for injections that were not parsed from text.
            injection.to_string().parse::<Injection>()?;
            if let Some((key, value)) = injection.kind.index()
                && value >= N
            {
                let kind = injection.kind.name();
                return Err(InjectionError::Index {
                    kind,
                    key,
                    value,
                    joints: N,
                });
            }
        }
        let mut injector = Injector::none(plant);
        let delay_of = |injection: &Injection| match injection.kind {
            InjectionKind::EncoderLate { cycles, .. } | InjectionKind::TorqueLate { cycles } => {
                (f64::from(cycles) * period_s / injector.cycle_s).round() as usize
            }
            _ => 0,
        };
        let scheduled = injections.iter().map(|injection| {
            let delay = delay_of(injection);
            ScheduledInjection {
                injection: *injection,
                due: (injection.trigger == Trigger::AtStart).then_some(0),
                begun: false,
                start_rad: Vector::zeros(),
                pending: VecDeque::with_capacity(delay + 2),
                delay,
                replies: [0; N],
            }
        });
        injector.scheduled = scheduled.collect();
        injector.begin_due(plant);
        injector.read_encoders(plant);
        Ok(injector)
    }

    /// Runs one plant cycle under `torque_nm` with these motors shorted, instead of [`Plant::short_motors`] and
    /// [`Plant::cycle`].
    pub fn cycle(
        &mut self,
        plant: &mut Plant<N>,
        view: ControllerView,
        torque_nm: &Vector<N>,
        shorted: [bool; N],
    ) {
        self.schedule_triggered(view);
        self.begin_due(plant);
        plant.set_controller_view(view);
        let (mut torque_nm, mut shorted) = (*torque_nm, shorted);
        if self.drives_idle() {
            torque_nm = Vector::zeros();
            shorted = [true; N];
        }
        for scheduled in self
            .scheduled
            .iter_mut()
            .filter(|scheduled| scheduled.begun)
        {
            match scheduled.injection.kind {
                InjectionKind::MotorDead { motor } => {
                    let mut at_motors = self.joint_from_motor.transpose() * torque_nm;
                    at_motors[motor] = 0.0;
                    torque_nm = self.motor_from_joint.transpose() * at_motors;
                    shorted[motor] = false;
                }
                InjectionKind::TorqueSign { joint } => torque_nm[joint] = -torque_nm[joint],
                InjectionKind::TorqueLate { .. } => torque_nm = scheduled.delay_line(torque_nm),
                _ => {}
            }
        }
        plant.short_motors(shorted);
        plant.cycle(&torque_nm);
        self.cycle += 1;
        self.read_encoders(plant);
    }

    /// Returns the encoder readings of the joint angles at the end of the last cycle \[rad\].
    pub fn position_rad(&self) -> &Vector<N> {
        &self.position_rad
    }

    /// Returns the encoder replies of a cycle, `None` for a lost reply. Call once per control cycle.
    pub fn replies(&mut self) -> [Option<f64>; N] {
        array::from_fn(|joint| {
            let lost = self.drops_reply(joint);
            (!lost).then_some(self.position_rad[joint])
        })
    }

    /// Counts one reply of a joint (on a bus: of a motor) and returns whether to drop it.
    pub fn drops_reply(&mut self, joint: usize) -> bool {
        let mut lost = false;
        for scheduled in self
            .scheduled
            .iter_mut()
            .filter(|scheduled| scheduled.begun)
        {
            if let InjectionKind::ReplyLost { joint: of, every } = scheduled.injection.kind
                && of.is_none_or(|of| of == joint)
            {
                scheduled.replies[joint] += 1;
                if scheduled.replies[joint] == every {
                    scheduled.replies[joint] = 0;
                    lost = true;
                }
            }
        }
        lost
    }

    /// Returns whether an injection forces the drives to idle.
    pub fn drives_idle(&self) -> bool {
        self.scheduled.iter().any(|scheduled| {
            let InjectionKind::DrivesIdle { for_s } = scheduled.injection.kind else {
                return false;
            };
            let since = scheduled.due.unwrap_or(self.cycle);
            let over = for_s.is_some_and(|for_s| {
                self.cycle.saturating_sub(since) >= whole_cycles(for_s, self.cycle_s)
            });
            scheduled.begun && !over
        })
    }

    /// Returns whether this motor produces no torque and does not brake.
    pub fn is_dead(&self, motor: usize) -> bool {
        let mut scheduled = self.scheduled.iter().filter(|scheduled| scheduled.begun);
        scheduled.any(|scheduled| scheduled.injection.kind == InjectionKind::MotorDead { motor })
    }

    /// Returns whether the injector has no injections, neither begun nor scheduled.
    pub fn is_empty(&self) -> bool {
        self.scheduled.is_empty()
    }

    /// Returns the number of injections that have begun.
    pub fn begun(&self) -> usize {
        self.scheduled
            .iter()
            .filter(|scheduled| scheduled.begun)
            .count()
    }

    fn schedule_triggered(&mut self, view: ControllerView) {
        for scheduled in self.scheduled.iter_mut().filter(|r| r.due.is_none()) {
            let after_s = match scheduled.injection.trigger {
                Trigger::AtStart => Some(0.0),
                Trigger::Active { at_s } => view.active.then_some(at_s),
                Trigger::Mode { mode, after_s } => {
                    (view.active && view.mode == Some(mode)).then_some(after_s)
                }
            };
            scheduled.due = after_s.map(|after_s| self.cycle + whole_cycles(after_s, self.cycle_s));
        }
    }

    fn begin_due(&mut self, plant: &mut Plant<N>) {
        for scheduled in &mut self.scheduled {
            if scheduled.begun || scheduled.due.is_none_or(|due| due > self.cycle) {
                continue;
            }
            scheduled.begun = true;
            scheduled.start_rad = self.position_rad;
            let done: Result<(), PlantError> = match scheduled.injection.kind {
                InjectionKind::GravityReversed => {
                    plant.reverse_gravity();
                    Ok(())
                }
                InjectionKind::Bump {
                    joint,
                    speed_rad_per_s,
                } => {
                    let mut change = Vector::zeros();
                    change[joint] = speed_rad_per_s;
                    plant.apply_velocity_step(&change)
                }
                InjectionKind::Payload { mass_kg } => plant.add_payload(mass_kg),
                _ => Ok(()),
            };
            // Masses and speeds are within their checked ranges.
            debug_assert!(done.is_ok(), "{done:?}");
        }
    }

    fn read_encoders(&mut self, plant: &Plant<N>) {
        let mut position_rad = plant.measurement().position_rad;
        for scheduled in self
            .scheduled
            .iter_mut()
            .filter(|scheduled| scheduled.begun)
        {
            if let InjectionKind::MotorEncoderStuck { motor } = scheduled.injection.kind {
                let turned_rad = self.motor_from_joint * (position_rad - scheduled.start_rad);
                position_rad -= self.joint_from_motor.column(motor) * turned_rad[motor];
            }
            scheduled.corrupt_positions(&mut position_rad);
        }
        self.position_rad = position_rad;
    }
}

impl<const N: usize> ScheduledInjection<N> {
    /// Stores a value in the delay line, and returns the one stored `delay` cycles ago, or the first one.
    fn delay_line(&mut self, value: Vector<N>) -> Vector<N> {
        self.pending.push_back(value);
        if self.pending.len() > self.delay + 1 {
            self.pending.pop_front();
        }
        self.pending.front().copied().unwrap_or(value)
    }

    fn corrupt_positions(&mut self, position_rad: &mut Vector<N>) {
        let start_rad = self.start_rad;
        let mut each = |joint: Option<usize>, value: &dyn Fn(usize, f64) -> f64| {
            for i in (0..N).filter(|i| joint.is_none_or(|joint| joint == *i)) {
                position_rad[i] = value(i, position_rad[i]);
            }
        };
        match self.injection.kind {
            InjectionKind::EncoderStuck { joint } => each(joint, &|i, _| start_rad[i]),
            InjectionKind::EncoderSign { joint } => {
                each(joint, &|i, now| start_rad[i] - (now - start_rad[i]));
            }
            InjectionKind::EncoderOffset { joint, offset_rad } => {
                each(joint, &|_, now| now + offset_rad);
            }
            InjectionKind::EncoderNan { joint } => each(joint, &|_, _| f64::NAN),
            InjectionKind::EncoderLate { joint, .. } => {
                let late_rad = self.delay_line(*position_rad);
                for i in (0..N).filter(|i| joint.is_none_or(|joint| joint == *i)) {
                    position_rad[i] = late_rad[i];
                }
            }
            _ => {}
        }
    }
}

fn whole_cycles(time_s: f64, cycle_s: f64) -> u64 {
    (time_s / cycle_s).round() as u64
}
