//! A connection to a running system: its telemetry as arrays, and requests that its controller checks.

mod worker;

use crate::log;
use crate::table::Table;
use pyo3::exceptions::{PyConnectionError, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use supple_core::codes::{Code, RequestCode, RequestCodeError, request_kind, trajectory_kind};
use supple_core::controller::{Request, SetPoint};
use supple_core::math::Vector3;
use supple_ipc::message::{MAX_DOF, Telemetry};
use supple_ipc::{Domain, IpcError, request_idle};
use supple_model::with_dof;
use worker::{RequestError, Worker};

/// Timeout for the answer to an idle request.
const IDLE_TIMEOUT: Duration = Duration::from_secs(5);
/// Time between two checks for signals.
const SIGNAL_CHECK: Duration = Duration::from_millis(100);

/// A connection to the system with a prefix. A thread receives its telemetry from the beginning.
#[pyclass(frozen, module = "supple._native")]
pub struct Connection {
    domain: Domain,
    dof: usize,
    period_s: f64,
    worker: Mutex<Option<Arc<Worker>>>,
}

#[pymethods]
impl Connection {
    /// Connects to a running system and waits for its telemetry.
    #[new]
    fn new(py: Python<'_>, prefix: Option<&str>, timeout_s: f64) -> PyResult<Connection> {
        let domain = Domain::new(prefix).map_err(ipc)?;
        let timeout = seconds("timeout_s", timeout_s)?;
        py.detach(|| {
            let worker = Worker::start(domain.clone()).map_err(ipc)?;
            let Some((dof, period_s)) = first_cycles(&worker, timeout) else {
                return Err(PyConnectionError::new_err(format!(
                    "no system is running under the prefix `{}`: start one with `supple up`, or give the prefix of \
                     another",
                    domain.prefix()
                )));
            };
            Ok(Connection {
                domain,
                dof,
                period_s,
                worker: Mutex::new(Some(Arc::new(worker))),
            })
        })
    }

    #[getter]
    fn prefix(&self) -> &str {
        self.domain.prefix()
    }

    #[getter]
    fn dof(&self) -> usize {
        self.dof
    }

    #[getter]
    fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Number of the last cycle.
    fn cycle(&self) -> PyResult<u64> {
        self.with(|worker| {
            let last = worker.with_history(|history| Some(history.cycles.back()?.state.cycle));
            Ok(last.unwrap_or(0))
        })
    }

    /// Cycles received so far: a position for `read` and `wait`.
    fn received(&self) -> PyResult<u64> {
        self.with(|worker| Ok(worker.with_history(|history| history.received())))
    }

    /// Cycles that did not reach this connection.
    fn lost(&self) -> PyResult<u64> {
        self.with(|worker| Ok(worker.with_history(|history| history.lost)))
    }

    /// Why the connection has ended, if it has.
    fn ended(&self) -> PyResult<Option<String>> {
        self.with(|worker| Ok(worker.with_history(|history| history.ended.clone())))
    }

    /// Waits until more than `received` cycles have come; returns whether there are more. Signals such as Ctrl-C end it.
    fn wait(&self, py: Python<'_>, received: u64, timeout_s: f64) -> PyResult<bool> {
        let timeout = seconds("timeout_s", timeout_s)?;
        let start = Instant::now();
        loop {
            let left = timeout.saturating_sub(start.elapsed());
            let (has_more, has_ended) = py.detach(|| {
                self.with(|worker| {
                    let has_more = worker.wait(received, left.min(SIGNAL_CHECK));
                    Ok((has_more, worker.with_history(|h| h.ended.is_some())))
                })
            })?;
            if has_more || has_ended || left.is_zero() {
                return Ok(has_more);
            }
            py.check_signals()?;
        }
    }

    /// The cycles after the first `received`, as far as they are kept, as columns; `modes` and `faults` are lists, `first`
    /// is how many cycles came before them.
    fn read<'py>(&self, py: Python<'py>, received: u64) -> PyResult<Bound<'py, PyDict>> {
        let (first, cycles): (u64, Vec<Telemetry>) = py.detach(|| {
            self.with(|worker| {
                Ok(worker.with_history(|history| {
                    let skipped = received.saturating_sub(history.dropped) as usize;
                    let cycles = history.cycles.iter().skip(skipped).copied().collect();
                    (received.max(history.dropped), cycles)
                }))
            })
        })?;
        let read = columns(py, self.dof, &cycles)?;
        read.set_item("first", first)?;
        Ok(read)
    }

    /// The last cycle, as columns with one row.
    fn latest<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let last = self.with(|worker| {
            let last = worker.with_history(|history| history.cycles.back().copied());
            last.ok_or_else(|| PyConnectionError::new_err("no telemetry has come"))
        })?;
        columns(py, self.dof, &[last])
    }

    /// Sends a request by its name and values, as logs have them; returns the cycle and the mode after it.
    #[pyo3(signature = (kind, values, trajectory = None, at_cycle = None))]
    fn request(
        &self,
        py: Python<'_>,
        kind: &str,
        values: Vec<f64>,
        trajectory: Option<&str>,
        at_cycle: Option<u64>,
    ) -> PyResult<(u64, &'static str)> {
        let code = code(kind, trajectory, &values)?;
        let send = with_dof!(self.dof, N => {
            let request = code.request::<N>().map_err(invalid)?;
            let request = request.ok_or_else(|| PyValueError::new_err("kind: none is no request"))?;
            sender(request, at_cycle)
        });
        let send = send.map_err(crate::errors::model)?;
        let reply =
            py.detach(|| self.with(|worker| worker.request(send).map_err(request_error)))?;
        Ok((
            reply.cycle,
            reply.mode().map_or("unknown", |mode| mode.name()),
        ))
    }

    /// Requests idle, over a separate socket, so that the request bypasses every queue.
    fn idle(&self, py: Python<'_>) -> PyResult<(u64, &'static str)> {
        let answer = py
            .detach(|| request_idle(&self.domain, IDLE_TIMEOUT))
            .map_err(ipc)?;
        let answer = answer.ok_or_else(|| request_error(RequestError::NoAnswer))?;
        match answer.text.is_empty() {
            true => Ok((
                answer.cycle,
                answer.mode.map_or("unknown", |mode| mode.name()),
            )),
            false => Err(request_error(RequestError::Refused(answer.text))),
        }
    }

    /// Sends a set-point of the tip and does not wait.
    fn set_point(
        &self,
        position_m: [f64; 3],
        velocity_m_per_s: [f64; 3],
        acceleration_m_per_s2: [f64; 3],
        at_cycle: u64,
    ) -> PyResult<()> {
        let set_point = SetPoint {
            position_m: Vector3::from(position_m),
            velocity_m_per_s: Vector3::from(velocity_m_per_s),
            acceleration_m_per_s2: Vector3::from(acceleration_m_per_s2),
            at_cycle,
        };
        let send = with_dof!(self.dof, N => sender(Request::<N>::SetPoint(set_point), None));
        let send = send.map_err(crate::errors::model)?;
        self.with(|worker| worker.set_point(send).map_err(request_error))
    }

    /// Why the controller refused a set-point since the last call, if it did.
    fn take_refusal(&self) -> PyResult<Option<String>> {
        self.with(|worker| Ok(worker.with_history(|history| history.refused_set_point.take())))
    }

    /// Ends the connection.
    fn close(&self, py: Python<'_>) {
        let worker = self
            .worker
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .take();
        py.detach(|| drop(worker));
    }
}

impl Connection {
    fn with<T>(&self, call: impl FnOnce(&Worker) -> PyResult<T>) -> PyResult<T> {
        let worker = self
            .worker
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .clone();
        match worker {
            Some(worker) => call(&worker),
            None => Err(PyConnectionError::new_err(
                "the connection is closed: open another with supple.connect()",
            )),
        }
    }
}

/// Returns a closure that sends a request in the thread of the connection.
fn sender<const N: usize>(request: Request<N>, at_cycle: Option<u64>) -> worker::Send {
    Box::new(move |operator| operator.send(&request, at_cycle))
}

/// Returns the number of joints, and the period: the increase of the time in the mode from one cycle to the next.
fn first_cycles(worker: &Worker, timeout: Duration) -> Option<(usize, f64)> {
    let start = Instant::now();
    let mut received = 0;
    loop {
        let found = worker.with_history(|history| {
            received = history.received();
            let last = history.cycles.back()?;
            let now = last.record();
            let mut earlier = history.cycles.iter().rev().skip(1).map(Telemetry::record);
            let before = earlier.find(|record| record.cycle < now.cycle)?;
            let elapsed_s = now.mode_time_s - before.mode_time_s;
            let cycles = (now.cycle - before.cycle) as f64;
            (before.mode == now.mode && elapsed_s > 0.0)
                .then(|| (last.dof().min(MAX_DOF), elapsed_s / cycles))
        });
        if found.is_some() {
            return found;
        }
        let left = timeout.saturating_sub(start.elapsed());
        if left.is_zero() || !worker.wait(received, left) {
            return None;
        }
    }
}

/// Returns a request from its names, as logs have them.
pub fn code(kind: &str, trajectory: Option<&str>, values: &[f64]) -> PyResult<RequestCode> {
    let number = |what: &str, all: &[Code], name: &str| {
        let known = all.iter().find(|code| code.name == name);
        known.map(|code| code.number).ok_or_else(|| {
            let names: Vec<&str> = all.iter().map(|code| code.name).collect();
            PyValueError::new_err(format!(
                "{what}: expected one of {}, got '{name}'",
                names.join(", ")
            ))
        })
    };
    let kind = number("kind", request_kind::ALL, kind)?;
    let trajectory = match trajectory {
        Some(name) => number("trajectory", trajectory_kind::ALL, name)?,
        None => trajectory_kind::NONE,
    };
    RequestCode::from_parts(kind, trajectory, values).map_err(invalid)
}

/// Returns cycles as columns; `modes` and `faults` are lists.
pub fn columns<'py>(
    py: Python<'py>,
    dof: usize,
    cycles: &[Telemetry],
) -> PyResult<Bound<'py, PyDict>> {
    let columns = py.detach(|| with_dof!(dof, N => rows::<N>(cycles)));
    let (table, modes, faults) = columns.map_err(crate::errors::model)?;
    let dict = table.into_dict(py)?;
    dict.set_item("modes", modes)?;
    dict.set_item("faults", faults)?;
    Ok(dict)
}

type Rows = (Table, Vec<&'static str>, Vec<Option<String>>);

fn rows<const N: usize>(cycles: &[Telemetry]) -> Rows {
    let mut table = Table::default();
    let (mut modes, mut faults) = (Vec::new(), Vec::new());
    for telemetry in cycles {
        let record = telemetry.record_of::<N>();
        let state = &telemetry.state;
        table.number("stamp_s", state.stamp_ns as f64 * 1e-9);
        table.number("missed_cycles", state.plant.missed as f64);
        table.number("step_s", telemetry.timing.step_ns as f64 * 1e-9);
        table.number("latency_s", telemetry.timing.latency_ns as f64 * 1e-9);
        log::step(&mut table, record.mode_time_s, &record);
        modes.push(record.mode().map_or("unknown", |mode| mode.name()));
        faults.push((record.fault != 0).then(|| record.fault_text.to_string()));
    }
    (table, modes, faults)
}

fn seconds(argument: &str, value: f64) -> PyResult<Duration> {
    Duration::try_from_secs_f64(value).map_err(|_| {
        PyValueError::new_err(format!(
            "{argument}: expected a number of seconds, zero or more, got {value}"
        ))
    })
}

fn invalid(error: RequestCodeError) -> PyErr {
    PyValueError::new_err(error.to_string())
}

fn ipc(error: IpcError) -> PyErr {
    match error {
        IpcError::Prefix { .. } => PyValueError::new_err(error.to_string()),
        _ => PyConnectionError::new_err(error.to_string()),
    }
}

fn request_error(error: RequestError) -> PyErr {
    match error {
        RequestError::Refused(reason) => PyRuntimeError::new_err(reason),
        RequestError::Ipc(error) => ipc(error),
        RequestError::Ended(_) | RequestError::NoAnswer => {
            PyConnectionError::new_err(error.to_string())
        }
    }
}
