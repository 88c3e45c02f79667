//! Learning in the helper thread: records in, requests for the loop and files out.
//!
//! Each estimate is for a cycle that lies further ahead than all queues between loop and helper are long, so that in
//! virtual time its cycle does not depend on the speed of the threads. The arm with what is learned is written to a
//! folder of the system by the thread that waits for the disk; `supple learning save` copies it from there.

use std::io::ErrorKind;
use std::sync::Arc;
use supple_core::Config;
use supple_core::learned::LearnedTerms;
use supple_ipc::Domain;
use supple_ipc::message::{OperatorRequest, Telemetry};
use supple_learning::Learner;
use supple_model::{Description, ModelError};
use supple_realtime::{BackgroundWriter, diagnostics};

/// Takes the record of a cycle; returns the requests of an estimate, if there is a new one.
pub type Learning = Box<dyn FnMut(&Telemetry) -> Vec<OperatorRequest> + Send>;

/// Id of the learner as an operator; no client has it, and nobody is answered.
const LEARNER: u64 = 0;
/// Files that may wait for the disk.
const WAITING: usize = 2;

/// Learning for an arm of `N` joints.
///
/// # Errors
/// If the system gives no thread.
pub fn learning<const N: usize>(
    config: &Config<N>,
    description: &Description,
    domain: &Domain,
) -> std::io::Result<Learning> {
    let mut learner = Learner::<N>::new(config);
    let file = LearnedFile {
        writer: BackgroundWriter::start("supple-rt-learned", WAITING)?,
        description: Arc::new(description.clone()),
        folder: domain.learned_folder().into(),
    };
    file.remove();
    Ok(Box::new(move |telemetry| {
        let scheduled = learner.observe(&telemetry.record_of::<N>());
        if !scheduled.is_empty() {
            let report = learner.report();
            file.write(report.terms, report.source());
        }
        scheduled
            .iter()
            .map(|scheduled| {
                OperatorRequest::new(LEARNER, 0, Some(scheduled.at_cycle), &scheduled.request)
            })
            .collect()
    }))
}

/// The arm with what is learned, on the disk.
struct LearnedFile {
    writer: BackgroundWriter,
    description: Arc<Description>,
    folder: Arc<std::path::Path>,
}

impl LearnedFile {
    /// Removes the TOML of an earlier system, so that nobody takes it for this one's.
    fn remove(&self) {
        let file = self.folder.join("arm.toml");
        self.writer.submit(move || {
            if let Err(error) = std::fs::remove_file(&file)
                && error.kind() != ErrorKind::NotFound
            {
                let file = file.display();
                diagnostics::post(format_args!(
                    "supple-rt: warning: {file}, of an earlier run, cannot be removed: {error}"
                ));
            }
        });
    }

    /// Hands the arm over; if the disk is behind, this one is left out, and the next follows.
    fn write<const N: usize>(&self, terms: LearnedTerms<N>, source: String) {
        let (description, folder) = (self.description.clone(), self.folder.clone());
        let save = move || -> Result<(), ModelError> {
            description.with_learned(&terms, &source)?.save(&folder)
        };
        self.writer.submit(move || {
            if let Err(error) = save() {
                diagnostics::post(format_args!(
                    "supple-rt: warning: what is learned cannot be written: {error}"
                ));
            }
        });
    }
}
