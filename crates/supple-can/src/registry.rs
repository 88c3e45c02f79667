//! The makes of drives that this program supports, a line each.

use crate::drives::{barrett, damiao};
use crate::make::Make;

/// All makes; the first one that an arm has is used.
pub const MAKES: [Make; 2] = [damiao::MAKE, barrett::MAKE];
