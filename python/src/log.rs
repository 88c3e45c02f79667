//! Conversion of a log to columns.

use crate::arm::Arm;
use crate::errors;
use crate::table::Table;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::{Path, PathBuf};
use supple_core::controller::CycleRecord;
use supple_core::record::{Cell, for_each_column};
use supple_log::{CycleTiming, LogError, PlantTruth, Reader, TimedMessage};
use supple_model::with_dof;

/// Content of a log, before its conversion to Python objects.
struct Columns {
    steps: Table,
    modes: Vec<&'static str>,
    faults: Vec<(f64, String)>,
    truth: Table,
    timing: Table,
}

/// Reads a log: the arm, its metadata and its columns.
#[pyfunction]
pub fn read_log(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let (reader, columns) = py.detach(|| read(&path)).map_err(errors::log)?;
    let metadata = reader.metadata();
    let dict = PyDict::new(py);
    let description = reader.description().map_err(errors::log)?;
    dict.set_item("arm", Arm::new(description).map_err(errors::model)?)?;
    dict.set_item("experiment", &metadata.experiment)?;
    dict.set_item("software", &metadata.software)?;
    dict.set_item("seed", metadata.seed)?;
    dict.set_item("notes", &metadata.notes)?;
    dict.set_item("modes", columns.modes)?;
    dict.set_item("faults", columns.faults)?;
    dict.set_item("steps", columns.steps.into_dict(py)?)?;
    dict.set_item("truth", columns.truth.into_dict(py)?)?;
    dict.set_item("timing", columns.timing.into_dict(py)?)?;
    Ok(dict)
}

fn read(path: &Path) -> Result<(Reader, Columns), LogError> {
    let reader = Reader::open(path)?;
    let joints = reader.metadata().joints.len();
    let columns = with_dof!(joints, N => sized::<N>(&reader))??;
    Ok((reader, columns))
}

fn sized<const N: usize>(reader: &Reader) -> Result<Columns, LogError> {
    let start_ns = reader.metadata().start_ns;
    let seconds = |time_ns: u64| time_ns.saturating_sub(start_ns) as f64 * 1e-9;
    let mut columns = Columns {
        steps: Table::default(),
        modes: Vec::new(),
        faults: Vec::new(),
        truth: Table::default(),
        timing: Table::default(),
    };
    let mut fault = 0;
    for record in reader.records::<N>()? {
        let TimedMessage { time_ns, value } = record?;
        step(&mut columns.steps, seconds(time_ns), &value);
        columns
            .modes
            .push(value.mode().map_or("unknown", |mode| mode.name()));
        if value.fault != fault {
            fault = value.fault;
            if fault != 0 {
                columns
                    .faults
                    .push((seconds(time_ns), value.fault_text.to_string()));
            }
        }
    }
    for message in reader.plant_truths::<N>()? {
        let TimedMessage { time_ns, value } = message?;
        truth(&mut columns.truth, seconds(time_ns), &value);
    }
    for message in reader.timings()? {
        let TimedMessage { time_ns, value } = message?;
        timing(&mut columns.timing, seconds(time_ns), &value);
    }
    Ok(columns)
}

/// Adds every numeric field of a record under its name, the terms of the torque as `torques.<term>`; no texts and lists.
pub fn step<const N: usize>(table: &mut Table, t: f64, record: &CycleRecord<N>) {
    table.number("t", t);
    let mut words = vec![0; CycleRecord::<N>::words(N)];
    record.pack(&mut words);
    let mut values = Vec::new();
    let mut open: Option<(&str, Option<&str>)> = None;
    let close = |table: &mut Table, values: &mut Vec<f64>, name: (&str, Option<&str>)| {
        match name {
            (field, Some(term)) => table.vector(&format!("{field}.{term}"), values),
            (field, None) => table.vector(field, values),
        }
        values.clear();
    };
    for_each_column(CycleRecord::<N>::FIELDS, &words, N, |column, cell| {
        let value = match cell {
            Cell::Flag(flag) => f64::from(u8::from(flag)),
            Cell::Index(index) => f64::from(index),
            Cell::Count(count) => count as f64,
            Cell::Number(number) => number,
            Cell::Numbers(_) | Cell::Text(_) => return,
        };
        let name = (column.field, column.term);
        if let Some(before) = open.filter(|before| *before != name) {
            close(table, &mut values, before);
            open = None;
        }
        if column.part.is_none() {
            table.number(column.field, value);
        } else {
            values.push(value);
            open = Some(name);
        }
    });
    if let Some(last) = open {
        close(table, &mut values, last);
    }
    table.end_row();
}

fn truth<const N: usize>(table: &mut Table, t: f64, truth: &PlantTruth<N>) {
    table.number("t", t);
    table.vector("q", &truth.position_rad);
    table.vector("qd", &truth.velocity_rad_per_s);
    table.vector("tau", &truth.motor_torque_nm);
    table.vector("friction_nm", &truth.friction_torque_nm);
    table.vector("tip_position_m", &truth.tip_position_m);
    table.vector("tip_velocity_m_per_s", &truth.tip_velocity_m_per_s);
    table.vector("contact_force_n", &truth.contact_force_n);
    table.end_row();
}

fn timing(table: &mut Table, t: f64, timing: &CycleTiming) {
    table.number("t", t);
    table.number("period_s", timing.period_ns as f64 * 1e-9);
    table.number("latency_s", timing.latency_ns as f64 * 1e-9);
    table.number("step_s", timing.step_ns as f64 * 1e-9);
    table.end_row();
}
