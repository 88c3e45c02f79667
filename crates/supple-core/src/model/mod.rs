//! Model of the arm and its surroundings in the controller: links, friction, torque ripple, workspace.

pub mod arm;
pub mod body;
pub mod friction;
pub mod learned;
mod link;
mod link_rows;
pub mod pose;
pub mod ripple;
pub mod workspace;
