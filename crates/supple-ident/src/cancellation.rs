//! A flag with which another thread ends an identification early.

use crate::error::IdentError;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// A flag that an identification polls between its steps; copies share it. By default nothing sets it.
#[derive(Clone, Debug, Default)]
pub struct Cancellation(Arc<AtomicBool>);

impl Cancellation {
    /// Makes every identification that has a copy return [`IdentError::Cancelled`] at its next step.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// # Errors
    /// [`IdentError::Cancelled`] once the flag is set.
    pub(crate) fn check(&self) -> Result<(), IdentError> {
        match self.0.load(Ordering::Relaxed) {
            true => Err(IdentError::Cancelled),
            false => Ok(()),
        }
    }
}

impl From<Arc<AtomicBool>> for Cancellation {
    fn from(flag: Arc<AtomicBool>) -> Cancellation {
        Cancellation(flag)
    }
}

/// The flag is not part of the options: options that differ only in the flag are equal.
impl PartialEq for Cancellation {
    fn eq(&self, _: &Cancellation) -> bool {
        true
    }
}
