//! Writes the last cycles before a fault to the disk as a table. A separate thread waits for the disk.

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

/// Number of cycles that are kept.
pub const KEPT_CYCLES: usize = 1000;
/// Number of tables that are kept in the folder, the newest ones.
pub const KEPT_FILES: usize = 20;
/// Maximum number of tables that wait for the disk, each of some megabytes.
const MAX_WAITING_TABLES: usize = 2;

/// Folder of the fault tables, with the thread that writes them.
#[derive(Debug)]
pub struct FaultFiles {
    writer: BackgroundWriter,
    folder: Arc<Path>,
}

impl FaultFiles {
    /// Starts the thread that writes the tables.
    ///
    /// # Errors
    /// If the thread cannot be started.
    pub fn start(folder: PathBuf) -> io::Result<FaultFiles> {
        Ok(FaultFiles {
            writer: BackgroundWriter::start("supple-rt-disk", MAX_WAITING_TABLES)?,
            folder: folder.into(),
        })
    }

    /// Queues a table for the disk. If too many tables wait, the table is lost, counted and reported.
    fn write(&self, table: Table, step: u64) {
        let folder = self.folder.clone();
        let accepted = self.writer.submit(move || table.save(&folder, step));
        if !accepted {
            diagnostics::post(format_args!(
                "supple-rt: warning: the disk of {} is too slow: the last cycles before this fault are lost, as were those of \
                 {} faults in total; choose another folder with --fault-dir",
                self.folder.display(),
                self.writer.dropped()
            ));
        }
    }

    /// Returns the number of lost tables.
    pub fn dropped(&self) -> u64 {
        self.writer.dropped()
    }

    /// Returns the thread that writes the tables, so that it can run other jobs.
    pub fn writer(&self) -> &BackgroundWriter {
        &self.writer
    }
}

/// Keeps the last [`KEPT_CYCLES`] cycles, and writes them to the disk when a fault latches.
#[derive(Debug)]
pub struct FaultRecorder {
    cycles: Table,
    fault: u8,
    files: FaultFiles,
}

/// Ring buffer of cycles.
#[derive(Clone, Debug)]
struct Table {
    kept: Vec<Telemetry>,
    /// Index of the oldest cycle, which the next cycle overwrites once the buffer is full.
    next: usize,
}

impl FaultRecorder {
    /// Creates a recorder without cycles.
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

    /// Adds a cycle. If a fault has just latched, reports the fault on standard error and queues the table for the disk, without
    /// waiting for either.
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

    /// Waits for at most `timeout` until all tables are written; reports if they are not.
    pub fn finish(&self, timeout: Duration) {
        if !self.files.writer.flush(timeout) {
            diagnostics::post(format_args!(
                "supple-rt: warning: the disk of {} does not answer: the last cycles before a fault may be missing",
                self.files.folder.display()
            ));
        }
    }

    /// Returns the folder of the tables with its thread.
    pub fn files(&self) -> &FaultFiles {
        &self.files
    }
}

/// Whether this is the name of a table.
fn is_table(name: &str) -> bool {
    let numbers = name
        .strip_prefix("fault-")
        .and_then(|rest| rest.strip_suffix(".csv"));
    let numbers = numbers.and_then(|numbers| numbers.split_once('-'));
    let digits = |text: &str| !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit());
    numbers.is_some_and(|(process, step)| digits(process) && digits(step))
}

/// Removes the oldest tables of this user, so that [`KEPT_FILES`] tables are left. Does not remove other files.
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
    /// Writes the table to a file, and reports its path or the error.
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
            // An incomplete table is removed.
            let _ = fs::remove_file(&part);
            return Err(error);
        }
        prune(folder)?;
        Ok(file)
    }

    /// Returns the table as text, oldest cycle first.
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

/// Names of the columns that are not part of the controller's record.
const PLANT_COLUMNS: &str =
    "stamp_ns,drives,missed,late,tx_lost,wake_ns,round_trip_ns,period_ns,latency_ns,step_ns";

/// Appends the column names. The columns of the record have the names of `supple log export`, with joints numbered from 0.
fn header(table: &mut String, dof: usize) {
    table.push_str(PLANT_COLUMNS);
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
            // A comma only separates columns, so that every CSV reader can read the table.
            Cell::Text(_) => write!(table, ",{}", cell.to_string().replace(',', ";")),
            cell => write!(table, ",{cell}"),
        };
    });
    table.push('\n');
}
