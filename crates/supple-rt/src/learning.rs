//! Learning in the helper thread: it receives records, and produces requests for the loop and files.
//!
//! Each estimate takes effect in a cycle that is further ahead than the total length of all queues between loop and helper.
//! In virtual time, this cycle therefore does not depend on the speed of the threads. A separate thread writes the
//! description of the arm with the learned terms to a folder of the system; `supple learning save` copies it from there.

use std::io::ErrorKind;
use std::sync::Arc;
use supple_core::Config;
use supple_core::learned::LearnedTerms;
use supple_ipc::Domain;
use supple_ipc::message::{OperatorRequest, Telemetry};
use supple_learning::Learner;
use supple_model::{Description, ModelError};
use supple_realtime::{BackgroundWriter, diagnostics};

/// Processes the record of a cycle; returns the requests that carry a new estimate, if there is one.
pub type Learning = Box<dyn FnMut(&Telemetry) -> Vec<OperatorRequest> + Send>;

/// Operator id of the learner. No client has this id, and no reply is sent to it.
const LEARNER: u64 = 0;
/// Maximum number of files that wait for the disk.
const MAX_WAITING_FILES: usize = 2;

/// Creates the learning of an arm with `N` joints.
///
/// # Errors
/// If the thread for the disk cannot be started.
pub fn learning<const N: usize>(
    config: &Config<N>,
    description: &Description,
    domain: &Domain,
) -> std::io::Result<Learning> {
    let mut learner = Learner::<N>::new(config);
    let file = LearnedFile {
        writer: BackgroundWriter::start("supple-rt-learned", MAX_WAITING_FILES)?,
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

/// Writes the description of the arm with the learned terms to the disk.
struct LearnedFile {
    writer: BackgroundWriter,
    description: Arc<Description>,
    folder: Arc<std::path::Path>,
}

impl LearnedFile {
    /// Removes the TOML of an earlier run, so that it is not mistaken for the TOML of this run.
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

    /// Queues the description for the disk. If too many files wait, it is skipped; a later one replaces it.
    fn write<const N: usize>(&self, terms: LearnedTerms<N>, source: String) {
        let (description, folder) = (self.description.clone(), self.folder.clone());
        let save = move || -> Result<(), ModelError> {
            description.with_learned(&terms, &source)?.save(&folder)
        };
        self.writer.submit(move || {
            if let Err(error) = save() {
                diagnostics::post(format_args!(
                    "supple-rt: warning: the learned terms cannot be written: {error}"
                ));
            }
        });
    }
}
