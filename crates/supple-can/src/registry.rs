//! The types of drives that this program supports.

use crate::backend::DriveBackend;
use crate::drives::{barrett, damiao};

/// Backends of all types of drives; the first one that supports an arm runs it.
pub const BACKENDS: [DriveBackend; 2] = [damiao::BACKEND, barrett::BACKEND];
