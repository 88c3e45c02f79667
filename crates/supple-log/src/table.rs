//! Converts messages to table rows according to their definition.
//!
//! The layout is determined once, from the first message; its read operations then read every other message of the same
//! shape sequentially.

use crate::definition::{Count, Definitions, Field, Kind, MAX_FIELDS};
use crate::values::Values;

/// Read operations of a message, and names of the columns that they fill.
pub(crate) struct Table {
    operations: Vec<ReadOperation>,
    columns: Vec<String>,
    row: String,
}

enum ReadOperation {
    /// A value with a column of its own.
    Cell(Kind),
    /// A value that is skipped.
    Skip(Kind),
    /// The length of a sequence, equal to that in the first message.
    Length(u32),
    /// A sequence of any length in one column, separated by spaces.
    List(Kind),
}

impl Table {
    /// Determines the layout from the message `first`; columns of arrays and sequences with one element per joint get the joint
    /// names.
    pub fn new(
        definitions: &Definitions,
        first: &[u8],
        joints: &[String],
    ) -> Result<Table, String> {
        let mut layout = LayoutBuilder {
            definitions,
            joints,
            values: Values::new(first)?,
            operations: Vec::new(),
            columns: vec!["log_time_ns".to_owned()],
            fields: 0,
        };
        for field in definitions.root() {
            let header = field.kind == Kind::Message("std_msgs/Header".to_owned());
            layout.field(field, &field.name, header)?;
        }
        layout.values.end()?;
        Ok(Table {
            operations: layout.operations,
            columns: layout.columns,
            row: String::new(),
        })
    }

    /// Returns the names of the columns as a line.
    pub fn header_row(&self) -> String {
        let mut header_row = String::new();
        for column in &self.columns {
            push_cell(&mut header_row, column);
        }
        end_line(&mut header_row);
        header_row
    }

    /// Returns one message as a line.
    pub fn row(&mut self, time_ns: u64, data: &[u8]) -> Result<&str, String> {
        let mut row = std::mem::take(&mut self.row);
        row.clear();
        push_cell(&mut row, &time_ns.to_string());
        let read = self.for_each_cell(data, |cell| push_cell(&mut row, cell));
        end_line(&mut row);
        self.row = row;
        read.map(|()| self.row.as_str())
    }

    /// Returns the first column in which two messages differ, with both values.
    pub fn difference(&self, a: &[u8], b: &[u8]) -> Result<Option<[String; 3]>, String> {
        let mut cells = [Vec::new(), Vec::new()];
        for (data, cells) in [a, b].iter().zip(&mut cells) {
            self.for_each_cell(data, |cell| cells.push(cell.to_owned()))?;
        }
        let [a, b] = cells;
        // The first column is the time, which is not a cell of the message.
        let mut columns = self.columns.iter().skip(1).zip(a.into_iter().zip(b));
        let differs = columns.find(|(_, (a, b))| a != b);
        Ok(differs.map(|(column, (a, b))| [column.clone(), a, b]))
    }

    /// Calls `on_cell` with each cell of a message, in the order of the columns.
    fn for_each_cell(&self, data: &[u8], mut on_cell: impl FnMut(&str)) -> Result<(), String> {
        let mut values = Values::new(data)?;
        for step in &self.operations {
            match step {
                ReadOperation::Cell(kind) => on_cell(values.next(kind)?),
                ReadOperation::Skip(kind) => {
                    values.next(kind)?;
                }
                ReadOperation::Length(expected) => {
                    let found = values.length()?;
                    if found != *expected {
                        return Err(format!(
                            "a sequence has {found} elements; in the first message it had {expected}"
                        ));
                    }
                }
                ReadOperation::List(kind) => {
                    let mut list = Vec::new();
                    for _ in 0..values.length()? {
                        list.push(values.next(kind)?.to_owned());
                    }
                    on_cell(&list.join(" "));
                }
            }
        }
        values.end()
    }
}

struct LayoutBuilder<'a> {
    definitions: &'a Definitions,
    joints: &'a [String],
    values: Values<'a>,
    operations: Vec<ReadOperation>,
    columns: Vec<String>,
    /// Fields and elements visited so far.
    fields: usize,
}

impl LayoutBuilder<'_> {
    fn count(&mut self, name: &str) -> Result<(), String> {
        self.fields += 1;
        match self.fields > MAX_FIELDS {
            true => Err(format!(
                "at {name}: a table has at most {MAX_FIELDS} fields, elements of arrays included; export \
                 another channel, or one with shorter arrays"
            )),
            false => Ok(()),
        }
    }

    fn field(&mut self, field: &Field, name: &str, skip: bool) -> Result<(), String> {
        self.count(name)?;
        match field.count {
            Count::One => self.value(&field.kind, name, skip),
            Count::Array(count) => self.elements(&field.kind, name, count, skip),
            Count::Sequence => {
                let count = self.values.length()?;
                self.operations.push(ReadOperation::Length(count));
                self.elements(&field.kind, name, count as usize, skip)
            }
            Count::Bounded => {
                for _ in 0..self.values.length()? {
                    self.values.next(&field.kind)?;
                }
                self.operations
                    .push(ReadOperation::List(field.kind.clone()));
                self.columns.push(name.to_owned());
                Ok(())
            }
        }
    }

    fn elements(
        &mut self,
        kind: &Kind,
        name: &str,
        count: usize,
        skip: bool,
    ) -> Result<(), String> {
        for i in 0..count {
            self.count(name)?;
            let element = match self.joints.get(i) {
                Some(joint) if count == self.joints.len() => format!("{name}.{joint}"),
                _ => format!("{name}.{i}"),
            };
            self.value(kind, &element, skip)?;
        }
        Ok(())
    }

    fn value(&mut self, kind: &Kind, name: &str, skip: bool) -> Result<(), String> {
        if let Kind::Message(message) = kind {
            for field in self.definitions.fields(message) {
                self.field(field, &format!("{name}.{}", field.name), skip)?;
            }
            return Ok(());
        }
        self.values.next(kind)?;
        if skip {
            self.operations.push(ReadOperation::Skip(kind.clone()));
        } else {
            self.operations.push(ReadOperation::Cell(kind.clone()));
            self.columns.push(name.to_owned());
        }
        Ok(())
    }
}

/// Appends a cell and a comma; text that would break the line is quoted.
fn push_cell(line: &mut String, text: &str) {
    if text.contains([',', '"', '\n', '\r']) {
        line.push('"');
        line.push_str(&text.replace('"', "\"\""));
        line.push('"');
    } else {
        line.push_str(text);
    }
    line.push(',');
}

/// Replaces the last comma by a line end.
fn end_line(line: &mut String) {
    line.pop();
    line.push('\n');
}
