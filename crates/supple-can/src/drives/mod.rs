//! Types of drives on a bus: a folder each. [`registry`](crate::registry) names them.

pub mod barrett;
pub mod damiao;
