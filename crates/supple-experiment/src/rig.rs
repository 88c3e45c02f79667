//! Controller and plant in one process, in virtual time: a cycle at a time, as fast as it goes.

use crate::error::ExperimentError;
use supple_core::controller::{Mode, Request};
use supple_core::{Controller, Input, Output, State, Vector, step};
use supple_plant::{Measurement, Plant, PlantConfig, StepRecord, Truth};

/// A controller that drives a plant.
pub struct Rig<const N: usize> {
    controller: Controller<N>,
    state: State<N>,
    plant: Plant<N>,
    /// The motors carry out torques: as in `supple-sim`, from gravity hold on until no torque is wanted.
    active: bool,
}

/// One cycle, seen from outside.
pub struct Cycle<'a, const N: usize> {
    /// What the controller was given.
    pub input: Input<N>,
    /// What it answered.
    pub output: Output<N>,
    /// What the arm and the force sensor reported at the start of the cycle.
    pub measurement: Measurement<N>,
    /// What was really so at the start of the cycle.
    pub truth: Truth<N>,
    /// Every step of the physics during the cycle, in order.
    pub steps: &'a [StepRecord],
}

impl<const N: usize> Rig<N> {
    /// The plant stands still at `start_rad`; the controller is idle.
    ///
    /// # Errors
    /// Where the plant refuses its configuration.
    pub fn new(
        controller: Controller<N>,
        plant: PlantConfig<N>,
        start_rad: Vector<N>,
    ) -> Result<Rig<N>, ExperimentError> {
        Ok(Rig {
            state: State::new(&controller),
            controller,
            plant: Plant::new(plant, start_rad, Vector::zeros())?,
            active: false,
        })
    }

    /// The controller's configuration.
    pub fn controller(&self) -> &Controller<N> {
        &self.controller
    }

    /// The plant as it stands.
    pub fn plant(&self) -> &Plant<N> {
        &self.plant
    }

    /// Measure, step, actuate.
    pub fn cycle(&mut self, request: Option<Request<N>>) -> Cycle<'_, N> {
        let measurement = *self.plant.measurement();
        let truth = *self.plant.truth();
        let input = Input {
            cycle: measurement.cycle,
            position_rad: core::array::from_fn(|i| Some(measurement.position_rad[i])),
            tip_force_n: Some(measurement.force_n),
            drives_active: self.active,
            request,
        };
        let output = step(&self.controller, &mut self.state, &input);
        self.active = !output.limp && (self.active || output.mode == Mode::GravityHold);
        self.plant.short([!self.active; N]);
        let torque_nm = match self.active {
            true => output.torque_nm,
            false => Vector::zeros(),
        };
        self.plant.cycle(&torque_nm);
        Cycle {
            input,
            output,
            measurement,
            truth,
            steps: self.plant.steps(),
        }
    }
}
