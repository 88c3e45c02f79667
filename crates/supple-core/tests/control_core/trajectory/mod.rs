//! Trajectories: documented properties, and consistency of position, velocity and acceleration.

mod derivatives;
mod fourier;
mod paths;
mod probe;
mod quadrant;
mod refusals;
mod segment;
