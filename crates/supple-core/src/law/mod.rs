//! The impedance law: term by term for the controller, and in one piece.

pub mod impedance;
pub mod operational;
pub mod torques;
