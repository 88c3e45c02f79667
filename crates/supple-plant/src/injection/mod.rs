//! Fault injection at the interface of a simulated arm: encoder angles, torques and load.
//!
//! An [`Injection`] is data, parsed from a text such as `encoder-stuck:joint=1,when=track,after-s=0.5`
//! ([`HELP`]); an [`Injector`] applies a list of them to a [`Plant`](crate::Plant). It counts plant cycles, so
//! that runs in virtual time are bit-identical.
//!
//! Joints and motors are counted from 0, as in the names of faults and in logs.

mod injector;
mod kinds;
mod parse;
mod view;

pub use kinds::{Injection, InjectionKind, Trigger};

pub use injector::Injector;
pub use parse::{HELP, InjectionError};
pub use view::ControllerView;

impl Injection {
    /// Checks that an arm on a bus supports this injection.
    ///
    /// # Errors
    /// [`InjectionError::NotOnBus`] with an alternative.
    pub fn check_bus_support(&self) -> Result<(), InjectionError> {
        let remedy = match (self.kind, self.trigger) {
            (_, Trigger::Mode { .. }) => {
                "an arm on a bus does not receive the controller mode: use at-s=SECONDS, counted from active drives"
            }
            (InjectionKind::EncoderNan { .. }, _) => {
                "encoder counts are always numbers: use reply-lost:every=1"
            }
            (InjectionKind::DrivesIdle { .. }, _) => "set the drives to idle on the pendant",
            _ => return Ok(()),
        };
        Err(InjectionError::NotOnBus {
            kind: self.kind.name(),
            remedy,
        })
    }
}
