//! A message as a row of a table, by its definition.
//!
//! A table is laid out once, by the first message: its steps then read any other message of the same
//! shape from front to back.

use crate::cdr;
use crate::definition::{Count, Definitions, Field, Kind};
use byteorder::LittleEndian;
use cdr_encoding::CdrDeserializer;
use serde::Deserialize;
use std::fmt::Write;

/// Fields, elements of arrays included, of which a table is laid out at most: those of no use take no bytes of
/// a message, however many there are.
const MOST_FIELDS: usize = 100_000;

/// Steps that read a message, names of the columns that they fill.
pub(crate) struct Table {
    steps: Vec<Step>,
    columns: Vec<String>,
    row: String,
}

enum Step {
    /// A value with a column of its own.
    Cell(Kind),
    /// A value that is read past.
    Skip(Kind),
    /// The length of a sequence, as it was in the first message.
    Length(u32),
    /// A sequence of any length in one column, separated by spaces.
    List(Kind),
}

impl Table {
    /// `first` is the first message; an array or sequence with an entry per joint gets their names.
    pub fn new(
        definitions: &Definitions,
        first: &[u8],
        joints: &[String],
    ) -> Result<Table, String> {
        let mut layout = Layout {
            definitions,
            joints,
            values: Values::new(first)?,
            steps: Vec::new(),
            columns: vec!["log_time_ns".to_owned()],
            fields: 0,
        };
        for field in definitions.root() {
            let header = field.kind == Kind::Message("std_msgs/Header".to_owned());
            layout.field(field, &field.name, header)?;
        }
        layout.values.end()?;
        Ok(Table {
            steps: layout.steps,
            columns: layout.columns,
            row: String::new(),
        })
    }

    /// Names of the columns, as a line.
    pub fn heading(&self) -> String {
        let mut heading = String::new();
        for column in &self.columns {
            push_cell(&mut heading, column);
        }
        end_line(&mut heading);
        heading
    }

    /// One message, as a line.
    pub fn row(&mut self, time_ns: u64, data: &[u8]) -> Result<&str, String> {
        let mut row = std::mem::take(&mut self.row);
        row.clear();
        push_cell(&mut row, &time_ns.to_string());
        let read = self.visit(data, |cell| push_cell(&mut row, cell));
        end_line(&mut row);
        self.row = row;
        read.map(|()| self.row.as_str())
    }

    /// First column in which two messages differ, with both values.
    pub fn difference(&self, a: &[u8], b: &[u8]) -> Result<Option<[String; 3]>, String> {
        let mut cells = [Vec::new(), Vec::new()];
        for (data, cells) in [a, b].iter().zip(&mut cells) {
            self.visit(data, |cell| cells.push(cell.to_owned()))?;
        }
        let [a, b] = cells;
        // The first column is the time, which is no cell of the message.
        let mut columns = self.columns.iter().skip(1).zip(a.into_iter().zip(b));
        let differs = columns.find(|(_, (a, b))| a != b);
        Ok(differs.map(|(column, (a, b))| [column.clone(), a, b]))
    }

    /// Shows the cells of a message in the order of the columns.
    fn visit(&self, data: &[u8], mut show: impl FnMut(&str)) -> Result<(), String> {
        let mut values = Values::new(data)?;
        for step in &self.steps {
            match step {
                Step::Cell(kind) => show(values.next(kind)?),
                Step::Skip(kind) => {
                    values.next(kind)?;
                }
                Step::Length(expected) => {
                    let found = values.length()?;
                    if found != *expected {
                        return Err(format!(
                            "a sequence of {found}, in the first message it had {expected}"
                        ));
                    }
                }
                Step::List(kind) => {
                    let mut list = Vec::new();
                    for _ in 0..values.length()? {
                        list.push(values.next(kind)?.to_owned());
                    }
                    show(&list.join(" "));
                }
            }
        }
        values.end()
    }
}

struct Layout<'a> {
    definitions: &'a Definitions,
    joints: &'a [String],
    values: Values<'a>,
    steps: Vec<Step>,
    columns: Vec<String>,
    /// Fields and elements visited so far.
    fields: usize,
}

impl Layout<'_> {
    fn count(&mut self, name: &str) -> Result<(), String> {
        self.fields += 1;
        match self.fields > MOST_FIELDS {
            true => Err(format!(
                "at {name}: a table has at most {MOST_FIELDS} fields, elements of arrays included; export \
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
                self.steps.push(Step::Length(count));
                self.elements(&field.kind, name, count as usize, skip)
            }
            Count::Bounded => {
                for _ in 0..self.values.length()? {
                    self.values.next(&field.kind)?;
                }
                self.steps.push(Step::List(field.kind.clone()));
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
            self.steps.push(Step::Skip(kind.clone()));
        } else {
            self.steps.push(Step::Cell(kind.clone()));
            self.columns.push(name.to_owned());
        }
        Ok(())
    }
}

/// The values of a message, one after the other.
struct Values<'a> {
    reader: CdrDeserializer<'a, LittleEndian>,
    bytes: usize,
    text: String,
}

impl<'a> Values<'a> {
    fn new(data: &'a [u8]) -> Result<Self, String> {
        let values = cdr::values(data)?;
        Ok(Values {
            reader: CdrDeserializer::new(values),
            bytes: values.len(),
            text: String::new(),
        })
    }

    /// The next value, as a cell has it.
    fn next(&mut self, kind: &Kind) -> Result<&str, String> {
        self.text.clear();
        let written = match kind {
            Kind::Bool => {
                let value: bool = self.read()?;
                write!(self.text, "{}", u8::from(value))
            }
            Kind::Int8 => self.print::<i8>()?,
            Kind::Int16 => self.print::<i16>()?,
            Kind::Int32 => self.print::<i32>()?,
            Kind::Int64 => self.print::<i64>()?,
            Kind::Uint8 => self.print::<u8>()?,
            Kind::Uint16 => self.print::<u16>()?,
            Kind::Uint32 => self.print::<u32>()?,
            Kind::Uint64 => self.print::<u64>()?,
            Kind::Float32 => self.print::<f32>()?,
            Kind::Float64 => self.print::<f64>()?,
            Kind::String => {
                let text: String = self.read()?;
                self.text.push_str(&text);
                Ok(())
            }
            Kind::Message(name) => return Err(format!("a list of {name} makes no table")),
        };
        written.map_err(|error| error.to_string())?;
        Ok(&self.text)
    }

    /// Debug prints a number with the digits that read back as the same number, and no more.
    fn print<T: Deserialize<'a> + std::fmt::Debug>(&mut self) -> Result<std::fmt::Result, String> {
        let value: T = self.read()?;
        Ok(write!(self.text, "{value:?}"))
    }

    fn length(&mut self) -> Result<u32, String> {
        self.read()
    }

    fn read<T: Deserialize<'a>>(&mut self) -> Result<T, String> {
        T::deserialize(&mut self.reader).map_err(|error| error.to_string())
    }

    fn end(&self) -> Result<(), String> {
        match self.bytes - self.reader.bytes_consumed() {
            0 => Ok(()),
            left => Err(format!("{left} bytes more than its definition has")),
        }
    }
}

/// A cell and the comma after it; quoted where its text would break the line apart.
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

/// The last comma becomes the end of the line.
fn end_line(line: &mut String) {
    line.pop();
    line.push('\n');
}
