//! A log as columns.

use crate::arm::Arm;
use crate::errors;
use crate::table::Table;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::path::PathBuf;
use supple_log::{CycleTiming, LogError, PlantTruth, Reader, Record, Timed};
use supple_model::with_dof;

/// What a log holds, before it has a form in Python.
struct Columns {
    steps: Table,
    modes: Vec<&'static str>,
    faults: Vec<(f64, String)>,
    truth: Table,
    timing: Table,
}

/// Reads a log: the arm, what it says of itself, and its columns.
#[pyfunction]
pub fn read_log(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let (reader, columns) = py.detach(|| read(path)).map_err(errors::log)?;
    let about = reader.about();
    let dict = PyDict::new(py);
    let description = reader.description().map_err(errors::log)?;
    dict.set_item("arm", Arm::new(description).map_err(errors::model)?)?;
    dict.set_item("experiment", &about.experiment)?;
    dict.set_item("software", &about.software)?;
    dict.set_item("seed", about.seed)?;
    dict.set_item("notes", &about.notes)?;
    dict.set_item("modes", columns.modes)?;
    dict.set_item("faults", columns.faults)?;
    dict.set_item("steps", columns.steps.into_dict(py)?)?;
    dict.set_item("truth", columns.truth.into_dict(py)?)?;
    dict.set_item("timing", columns.timing.into_dict(py)?)?;
    Ok(dict)
}

fn read(path: PathBuf) -> Result<(Reader, Columns), LogError> {
    let reader = Reader::open(path)?;
    let joints = reader.about().joints.len();
    let columns = with_dof!(joints, N => sized::<N>(&reader))??;
    Ok((reader, columns))
}

fn sized<const N: usize>(reader: &Reader) -> Result<Columns, LogError> {
    let start_ns = reader.about().start_ns;
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
        let Timed { time_ns, value } = record?;
        step(&mut columns.steps, seconds(time_ns), &value);
        columns
            .modes
            .push(value.mode().map_or("unknown", |mode| mode.name()));
        if value.fault != fault {
            fault = value.fault;
            if fault != 0 {
                columns.faults.push((seconds(time_ns), value.fault_text));
            }
        }
    }
    for message in reader.truths::<N>()? {
        let Timed { time_ns, value } = message?;
        truth(&mut columns.truth, seconds(time_ns), &value);
    }
    for message in reader.timings()? {
        let Timed { time_ns, value } = message?;
        timing(&mut columns.timing, seconds(time_ns), &value);
    }
    Ok(columns)
}

fn step<const N: usize>(table: &mut Table, t: f64, r: &Record<N>) {
    let flag = |on: bool| f64::from(u8::from(on));
    table.number("t", t);
    table.vector("q", &r.position_rad);
    table.vector("qd", &r.velocity_rad_per_s);
    table.vector("tau", &r.torque_nm);
    table.vector("tip_position_m", &r.tip_position_m);
    table.vector("tip_velocity_m_per_s", &r.tip_velocity_m_per_s);
    table.number("has_reference", flag(r.has_reference));
    table.vector("reference_position_m", &r.reference_position_m);
    table.vector("reference_velocity_m_per_s", &r.reference_velocity_m_per_s);
    table.number("has_tip_force", flag(r.has_tip_force));
    table.vector("tip_force_n", &r.tip_force_n);
    table.vector("external_torque_nm", &r.external_torque_nm);
    table.vector("external_force_n", &r.external_force_n);
    table.vector("stiffness_n_per_m", &r.stiffness_n_per_m);
    table.vector("damping_n_s_per_m", &r.damping_n_s_per_m);
    table.number("in_contact", flag(r.in_contact));
    table.number("friction_share", r.friction_share);
    let terms = &r.torques;
    table.vector("gravity_nm", &terms.gravity);
    table.vector("coriolis_nm", &terms.coriolis);
    table.vector("friction_nm", &terms.friction);
    table.vector("jacobian_rate_nm", &terms.jacobian_rate);
    table.vector("inertial_nm", &terms.inertial);
    table.vector("stiffness_nm", &terms.stiffness);
    table.vector("damping_nm", &terms.damping);
    table.vector("force_nm", &terms.force);
    table.vector("nullspace_nm", &terms.nullspace);
    table.vector("joint_pd_nm", &terms.joint_pd);
    table.vector("soft_stop_nm", &terms.soft_stop);
    table.vector("handover_nm", &terms.handover);
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
