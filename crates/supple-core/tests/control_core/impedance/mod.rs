//! The impedance law: the motion of the arm under it, by forward dynamics, and each of its terms.

mod closed_loop;
mod friction;
mod inverse;
mod passivity;
mod redundancy;
mod singular;
mod terms;
