//! The types of drives that this program supports, a line each.

use crate::backend::DriveBackend;
use crate::drives::{barrett, damiao};

/// All makes; the first one that an arm has is used.
pub const BACKENDS: [DriveBackend; 2] = [damiao::BACKEND, barrett::BACKEND];
