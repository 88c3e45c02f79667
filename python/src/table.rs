//! Columns that grow a row at a time and end as NumPy arrays.

use crate::arrays;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Named columns of numbers, each `width` numbers a row.
#[derive(Default)]
pub struct Table {
    columns: Vec<Column>,
    next: usize,
}

struct Column {
    name: &'static str,
    /// `None`: one number a row, and an array of one axis.
    width: Option<usize>,
    values: Vec<f64>,
}

impl Table {
    /// One number under `name`. A row gives the same names in the same order as the first one.
    pub fn number(&mut self, name: &'static str, value: f64) {
        self.push(name, None, &[value]);
    }

    /// Several numbers under `name`.
    pub fn vector(&mut self, name: &'static str, values: &[f64]) {
        self.push(name, Some(values.len()), values);
    }

    /// The row is complete.
    pub fn end_row(&mut self) {
        self.next = 0;
    }

    fn push(&mut self, name: &'static str, width: Option<usize>, values: &[f64]) {
        if self.next == self.columns.len() {
            self.columns.push(Column {
                name,
                width,
                values: Vec::new(),
            });
        }
        let column = &mut self.columns[self.next];
        assert!(
            column.name == name && column.width == width,
            "column {} where the first row had {}",
            name,
            column.name
        );
        column.values.extend_from_slice(values);
        self.next += 1;
    }

    /// The columns by name, `(rows,)` or `(rows, width)`.
    pub fn into_dict(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let dict = PyDict::new(py);
        for column in self.columns {
            let rows = column.values.len() / column.width.unwrap_or(1).max(1);
            let shape = match column.width {
                Some(width) => vec![rows, width],
                None => vec![rows],
            };
            dict.set_item(column.name, arrays::array(py, column.values, &shape)?)?;
        }
        Ok(dict)
    }
}
