//! Reads logs from files: the project's own MCAP, and comma-separated values.
//!
//! From an MCAP log, only intervals of controlled free motion are used: excitation, moves, tracking, and
//! probing without contact. A CSV file has a header line with the names `t`, `q[0]`, `q[1]`, ..., `tau[0]`,
//! ..., and `qd[0]`, ... if velocities were measured; SI units. `q0` is read as `q[0]`.

use crate::log::Log;
use nalgebra::DMatrix;
use std::path::Path;
use supple_core::controller::Mode;
use supple_log::{LogError, Reader};

/// Shorter intervals are skipped \[s\].
const MIN_INTERVAL_S: f64 = 2.0;
/// Time that is skipped after contact, a fault or a change of mode \[s\].
const SETTLE_S: f64 = 0.3;

/// Maximum size of a table \[bytes\]: an hour at 1 kHz of seven joints with velocities.
const MAX_BYTES: u64 = 1 << 30;

/// Error of reading a log.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// An MCAP that cannot be read.
    #[error(transparent)]
    Mcap(#[from] LogError),
    /// A file that cannot be opened.
    #[error("{file}: cannot be read: {error}; give a regular, readable file")]
    File {
        /// Path.
        file: String,
        /// Error of the operating system.
        error: std::io::Error,
    },
    /// An invalid table.
    #[error("{file}: {problem}; {remedy}")]
    Table {
        /// Path.
        file: String,
        /// Problem, with line and column.
        problem: String,
        /// Remedy.
        remedy: &'static str,
    },
}

/// Reads the usable intervals of a file: MCAP if its extension is `.mcap`, otherwise CSV. If an MCAP contains an excitation or a tracked
/// path, its moves between poses are left out, because they hardly move some joints and are not suited for validation.
///
/// # Errors
/// [`ReadError`]; an MCAP of an arm with another number of joints.
pub fn read_logs<const N: usize>(path: &Path) -> Result<Vec<Log>, ReadError> {
    if path.extension().is_some_and(|ending| ending == "mcap") {
        let free_motion_intervals = free_motion_intervals::<N>(path)?;
        let excites = free_motion_intervals
            .iter()
            .any(|(mode, _)| matches!(mode, Mode::Excite | Mode::Track));
        let kept = free_motion_intervals
            .into_iter()
            .filter(|(mode, _)| !excites || *mode != Mode::Move);
        Ok(kept.map(|(_, log)| log).collect())
    } else {
        Ok(vec![read_csv(path, N)?])
    }
}

/// Reads the intervals of free motion of an MCAP; the torques do not include the ripple compensation.
///
/// # Errors
/// [`ReadError`].
pub fn read_mcap<const N: usize>(path: &Path) -> Result<Vec<Log>, ReadError> {
    Ok(free_motion_intervals::<N>(path)?
        .into_iter()
        .map(|(_, log)| log)
        .collect())
}

/// Reads the intervals of free motion of an MCAP, each with its mode.
fn free_motion_intervals<const N: usize>(path: &Path) -> Result<Vec<(Mode, Log)>, ReadError> {
    let reader = Reader::open(path)?;
    let mut logs = Vec::new();
    let mut interval: Vec<(f64, [f64; N], [f64; N])> = Vec::new();
    let (mut settled_s, mut mode) = (f64::NEG_INFINITY, None);
    // An interval ends with its mode.
    let mut finish = |interval: &mut Vec<_>, mode: Option<Mode>| {
        if let (Some(mode), Some(log)) = (mode, interval_log(std::mem::take(interval))) {
            logs.push((mode, log));
        }
    };
    for record in reader.records::<N>()? {
        let record = record?;
        let (t_s, value) = (record.time_ns as f64 * 1e-9, record.value);
        let moves = matches!(
            value.mode(),
            Some(Mode::Move | Mode::Track | Mode::Probe | Mode::Excite)
        );
        if !moves || value.in_contact || value.mode() != mode {
            settled_s = t_s + SETTLE_S;
        }
        if !moves || t_s < settled_s {
            finish(&mut interval, mode);
            mode = value.mode();
            continue;
        }
        let torque = core::array::from_fn(|j| value.torque_nm[j] - value.torques.ripple[j]);
        interval.push((t_s, value.position_rad.into(), torque));
    }
    finish(&mut interval, mode);
    if logs.is_empty() {
        return Err(ReadError::Table {
            file: path.display().to_string(),
            problem: format!("no interval of {MIN_INTERVAL_S} s of free motion under control"),
            remedy: "record the arm following the series that `supple excite design` gives",
        });
    }
    Ok(logs)
}

/// Returns the log of an interval; `None` if it is too short.
fn interval_log<const N: usize>(rows: Vec<(f64, [f64; N], [f64; N])>) -> Option<Log> {
    let (first, last) = (rows.first()?, rows.last()?);
    (last.0 - first.0 >= MIN_INTERVAL_S).then(|| Log {
        t_s: rows.iter().map(|row| row.0).collect(),
        q_rad: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].1[j]),
        qd_rad_per_s: None,
        tau_nm: DMatrix::from_fn(rows.len(), N, |i, j| rows[i].2[j]),
    })
}

/// Reads a table of numbers with a header line.
///
/// # Errors
/// [`ReadError`] with line and column.
pub fn read_csv(path: &Path, dof: usize) -> Result<Log, ReadError> {
    let file = path.display().to_string();
    let text = supple_files::read_text(path, MAX_BYTES).map_err(|error| ReadError::File {
        file: file.clone(),
        error,
    })?;
    parse_csv(&text, dof).map_err(|(problem, remedy)| ReadError::Table {
        file,
        problem,
        remedy,
    })
}

fn parse_csv(text: &str, dof: usize) -> Result<Log, (String, &'static str)> {
    let names_remedy = "name the columns t, q[0].., tau[0].. and qd[0].. if there are velocities";
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, l)| !l.trim().is_empty());
    let Some((_, header)) = lines.next() else {
        return Err(("the file is empty".to_owned(), names_remedy));
    };
    let names: Vec<String> = header
        .split(',')
        .map(|name| name.trim().replace(['[', ']'], ""))
        .collect();
    let index_of = |name: &str| names.iter().position(|n| n == name);
    let time = index_of("t").ok_or_else(|| ("there is no column t".to_owned(), names_remedy))?;
    let group = |name: &str| -> Result<Option<Vec<usize>>, (String, &'static str)> {
        let found: Vec<Option<usize>> = (0..dof).map(|j| index_of(&format!("{name}{j}"))).collect();
        if found.iter().all(Option::is_none) {
            return Ok(None);
        }
        let all: Option<Vec<usize>> = found.iter().copied().collect();
        let missing = found.iter().position(Option::is_none).unwrap_or(0);
        all.map(Some).ok_or_else(|| {
            (
                format!("there is no column {name}[{missing}]"),
                names_remedy,
            )
        })
    };
    let needed = |name: &str| {
        group(name)?.ok_or_else(|| (format!("there are no columns {name}[0].."), names_remedy))
    };
    let (q, tau, qd) = (needed("q")?, needed("tau")?, group("qd")?);
    let mut values: Vec<Vec<f64>> = Vec::new();
    for (number, line) in lines {
        let row = line
            .split(',')
            .enumerate()
            .map(|(column, cell)| {
                cell.trim().parse().map_err(|_| {
                    let name = names.get(column).map_or("?", String::as_str);
                    (
                        format!(
                            "line {}, column {}: `{}` is not a number",
                            number + 1,
                            supple_files::excerpt(name),
                            supple_files::excerpt(cell)
                        ),
                        "correct the cell, or remove the line",
                    )
                })
            })
            .collect::<Result<Vec<f64>, _>>()?;
        if row.len() != names.len() {
            let (found, wanted) = (row.len(), names.len());
            return Err((
                format!(
                    "line {} has {found} cells, but the header has {wanted}",
                    number + 1
                ),
                "give every line as many cells as the header",
            ));
        }
        values.push(row);
    }
    let columns =
        |indices: &[usize]| DMatrix::from_fn(values.len(), dof, |i, j| values[i][indices[j]]);
    Ok(Log {
        t_s: values.iter().map(|row| row[time]).collect(),
        q_rad: columns(&q),
        qd_rad_per_s: qd.as_deref().map(columns),
        tau_nm: columns(&tau),
    })
}

#[cfg(test)]
mod tests {
    use super::parse_csv;

    #[test]
    fn a_table_is_read_by_its_names() {
        let text = "tau[0],t,q0,extra\n1.5,0,0.25,9\n-2,0.01,0.5,9\n\n";
        let log = parse_csv(text, 1).unwrap();
        assert_eq!(log.t_s, [0.0, 0.01]);
        assert_eq!(log.q_rad.as_slice(), [0.25, 0.5]);
        assert_eq!(log.tau_nm.as_slice(), [1.5, -2.0]);
        assert!(log.qd_rad_per_s.is_none());
    }

    #[test]
    fn errors_name_the_problem() {
        let wrong = [
            ("", "empty"),
            ("q[0],tau[0]\n1,2\n", "no column t"),
            ("t,q[0]\n1,2\n", "tau[0]"),
            ("t,q[0],tau[0],tau[1]\n1,2,3,4\n", "q[1]"),
            (
                "t,q[0],q[1],tau[0],tau[1]\n1,2,x,4,5\n",
                "line 2, column q1",
            ),
            ("t,q[0],q[1],tau[0],tau[1]\n1,2,3,4\n", "line 2 has 4 cells"),
        ];
        for (text, word) in wrong {
            let dof = if text.contains("[1]") { 2 } else { 1 };
            let (problem, remedy) = parse_csv(text, dof).unwrap_err();
            assert!(problem.contains(word), "{word} in {problem}");
            assert!(!remedy.is_empty());
        }
    }
}
