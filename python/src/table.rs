//! Columns that are filled by rows and converted to NumPy arrays.

use crate::arrays;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Named columns of numbers, each with `width` numbers per row.
#[derive(Default)]
pub struct Table {
    columns: Vec<Column>,
    next: usize,
}

struct Column {
    name: String,
    /// `None`: one number per row, and a one-dimensional array.
    width: Option<usize>,
    values: Vec<f64>,
}

impl Table {
    /// Adds one number under `name`. Every row has the same names in the same order as the first one.
    pub fn number(&mut self, name: &str, value: f64) {
        self.push(name, None, &[value]);
    }

    /// Adds several numbers under `name`.
    pub fn vector(&mut self, name: &str, values: &[f64]) {
        self.push(name, Some(values.len()), values);
    }

    /// Ends the row.
    pub fn end_row(&mut self) {
        self.next = 0;
    }

    fn push(&mut self, name: &str, width: Option<usize>, values: &[f64]) {
        if self.next == self.columns.len() {
            self.columns.push(Column {
                name: name.to_owned(),
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

    /// Returns the columns by name, `(rows,)` or `(rows, width)`.
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
