//! The last cycles before a fault, as a table on the disk; a thread of its own waits for the disk.

use core::time::Duration;
use std::fmt::Write as _;
use std::fs::{self, OpenOptions};
use std::io::{self, ErrorKind, Write as _};
use std::os::unix::fs::{MetadataExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use supple_core::controller::CycleRecord;
use supple_core::record::{Cell, for_each_column};
use supple_ipc::message::{MAX_DOF, Telemetry};
use supple_realtime::{BackgroundWriter, create_private_folder, diagnostics};

/// Cycles that are kept.
pub const KEPT_CYCLES: usize = 1000;
/// Tables that are kept in the folder: the newest.
pub const KEPT_FILES: usize = 20;
/// Tables that may wait for the disk, some megabytes each.
const WAITING: usize = 2;

/// Where the tables go, and who writes them there.
#[derive(Debug)]
pub struct FaultFiles {
    writer: BackgroundWriter,
    folder: Arc<Path>,
}

impl FaultFiles {
    /// Starts the thread that writes.
    ///
    /// # Errors
    /// Where the system gives no thread.
    pub fn start(folder: PathBuf) -> io::Result<FaultFiles> {
        Ok(FaultFiles {
            writer: BackgroundWriter::start("supple-rt-disk", WAITING)?,
            folder: folder.into(),
        })
    }

    /// Hands a table over; where too many wait for the disk, it is lost, counted and reported.
    fn write(&self, table: Table, step: u64) {
        let folder = self.folder.clone();
        let accepted = self.writer.submit(move || table.save(&folder, step));
        if !accepted {
            diagnostics::post(format_args!(
                "supple-rt: warning: the disk of {} is behind: the last cycles before this fault are lost, as of {} \
                 faults so far; choose another folder with --fault-dir",
                self.folder.display(),
                self.writer.dropped()
            ));
        }
    }

    /// Tables that were lost.
    pub fn dropped(&self) -> u64 {
        self.writer.dropped()
    }

    /// The thread that writes, to be handed other work.
    pub fn writer(&self) -> &BackgroundWriter {
        &self.writer
    }
}

/// The last [`KEPT_CYCLES`] cycles; a fault that latches sends them to the disk.
#[derive(Debug)]
pub struct FaultRecorder {
    cycles: Table,
    fault: u8,
    files: FaultFiles,
}

/// Cycles in a ring.
#[derive(Clone, Debug)]
struct Table {
    kept: Vec<Telemetry>,
    /// Where the next one goes, once all places are taken.
    next: usize,
}

impl FaultRecorder {
    /// None yet.
    pub fn new(files: FaultFiles) -> FaultRecorder {
        FaultRecorder {
            cycles: Table {
                kept: Vec::with_capacity(KEPT_CYCLES),
                next: 0,
            },
            fault: 0,
            files,
        }
    }

    /// A cycle. Where a fault has just latched, it is reported on standard error, and the table is handed to the thread
    /// that writes; neither is waited for.
    pub fn add(&mut self, telemetry: &Telemetry) {
        let Table { kept, next } = &mut self.cycles;
        if kept.len() < KEPT_CYCLES {
            kept.push(*telemetry);
        } else {
            kept[*next] = *telemetry;
            *next = (*next + 1) % KEPT_CYCLES;
        }
        let record = telemetry.record();
        let latched = record.fault != 0 && self.fault == 0;
        self.fault = record.fault;
        if latched {
            diagnostics::post(format_args!("supple-rt: fault: {}", record.fault_text));
            self.files.write(self.cycles.clone(), record.step);
        }
    }

    /// Waits for the disk at most for `timeout`, and reports if it is not done by then.
    pub fn finish(&self, timeout: Duration) {
        if !self.files.writer.flush(timeout) {
            diagnostics::post(format_args!(
                "supple-rt: warning: the disk of {} does not answer: the last cycles before a fault may be missing",
                self.files.folder.display()
            ));
        }
    }

    /// Where the tables go.
    pub fn files(&self) -> &FaultFiles {
        &self.files
    }
}

/// Name of a table; `None` for what is none.
fn is_table(name: &str) -> bool {
    let numbers = name
        .strip_prefix("fault-")
        .and_then(|rest| rest.strip_suffix(".csv"));
    let numbers = numbers.and_then(|numbers| numbers.split_once('-'));
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    numbers.is_some_and(|(process, step)| digits(process) && digits(step))
}

/// Removes the oldest tables of this user, so that [`KEPT_FILES`] are left. What is no table stays.
fn prune(folder: &Path) -> io::Result<()> {
    let user = rustix::process::getuid().as_raw();
    let mut tables = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let (name, about) = (entry.file_name(), entry.metadata()?);
        if name.to_str().is_some_and(is_table) && about.is_file() && about.uid() == user {
            tables.push((about.mtime(), about.mtime_nsec(), entry.path()));
        }
    }
    tables.sort();
    let surplus = tables.len().saturating_sub(KEPT_FILES);
    for (_, _, table) in tables.into_iter().take(surplus) {
        fs::remove_file(table)?;
    }
    Ok(())
}

impl Table {
    /// Writes it and reports where; failures are reported too.
    fn save(&self, folder: &Path, step: u64) {
        match self.write(folder, step) {
            Ok(file) => diagnostics::post(format_args!(
                "supple-rt: the last {} cycles before the fault are in {}",
                self.kept.len(),
                file.display()
            )),
            Err(error) => diagnostics::post(format_args!(
                "supple-rt: warning: the last cycles before the fault cannot be written to {}: {error}; \
                 choose another folder with --fault-dir",
                folder.display()
            )),
        }
    }

    fn write(&self, folder: &Path, step: u64) -> io::Result<PathBuf> {
        create_private_folder(folder)?;
        let process = std::process::id();
        let file = folder.join(format!("fault-{process}-{step}.csv"));
        let part = file.with_extension("csv.part");
        match fs::remove_file(&part) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => {}
        }
        let mut options = OpenOptions::new();
        options.write(true).create_new(true).mode(0o600);
        let mut table = options.open(&part)?;
        let written = table
            .write_all(self.text().as_bytes())
            .and_then(|()| table.sync_all())
            .and_then(|()| fs::rename(&part, &file));
        if let Err(error) = written {
            // What is not whole is of no use, and takes room that others want.
            let _ = fs::remove_file(&part);
            return Err(error);
        }
        prune(folder)?;
        Ok(file)
    }

    /// The table, oldest cycle first.
    fn text(&self) -> String {
        let (newer, older) = self.kept.split_at(self.next);
        let cycles = older.iter().chain(newer);
        let dof = self.kept.first().map_or(0, Telemetry::dof);
        let mut table = String::new();
        header(&mut table, dof);
        for telemetry in cycles {
            row(&mut table, telemetry, dof);
        }
        table
    }
}

/// Columns that are not of the controller's record.
const PLANT: &str =
    "stamp_ns,drives,missed,late,tx_lost,wake_ns,round_trip_ns,period_ns,latency_ns,step_ns";

/// Column names, those of a record as `supple log export` has them, joints by their numbers from 0.
fn header(table: &mut String, dof: usize) {
    table.push_str(PLANT);
    for_each_column(CycleRecord::<MAX_DOF>::FIELDS, &[], dof, |column, _| {
        let _ = write!(table, ",{column}");
    });
    table.push('\n');
}

fn row(table: &mut String, t: &Telemetry, dof: usize) {
    let (plant, timing) = (&t.state.plant, &t.timing);
    let _ = write!(
        table,
        "{},{},{},{},{},{},{},{},{},{}",
        t.state.stamp_ns,
        t.state.drives().name(),
        plant.missed,
        plant.late,
        plant.tx_lost,
        plant.wake_ns,
        plant.round_trip_ns,
        timing.period_ns,
        timing.latency_ns,
        timing.step_ns,
    );
    for_each_column(CycleRecord::<MAX_DOF>::FIELDS, t.words(), dof, |_, cell| {
        let _ = match cell {
            // No comma but between columns: a table that any reader takes apart.
            Cell::Text(_) => write!(table, ",{}", cell.to_string().replace(',', ";")),
            cell => write!(table, ",{cell}"),
        };
    });
    table.push('\n');
}
