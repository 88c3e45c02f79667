//! Types of drives on a bus, one folder for each. [`registry`](crate::registry) lists them.

pub mod barrett;
pub mod damiao;
