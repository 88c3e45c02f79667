//! Tests of the codec of Damiao motors.

mod feedback;
mod golden;
mod guard;
mod inspection;
mod position;
mod properties;
mod registers;
