//! Sequential reader of the values of a message.

use crate::cdr;
use crate::definition::{Count, Definitions, Field, Kind, MAX_FIELDS};
use byteorder::LittleEndian;
use cdr_encoding::CdrDeserializer;
use serde::Deserialize;
use std::fmt::Write;

/// Sequential reader of the values of a message.
pub(crate) struct Values<'a> {
    reader: CdrDeserializer<'a, LittleEndian>,
    bytes: usize,
    text: String,
    /// Number of fields and elements skipped so far.
    skipped: usize,
}

impl<'a> Values<'a> {
    pub fn new(data: &'a [u8]) -> Result<Self, String> {
        let values = cdr::values(data)?;
        Ok(Values {
            reader: CdrDeserializer::new(values),
            bytes: values.len(),
            text: String::new(),
            skipped: 0,
        })
    }

    /// Returns the next value as the text of a table cell.
    pub fn next(&mut self, kind: &Kind) -> Result<&str, String> {
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
            Kind::Message(name) => {
                return Err(format!("a bounded list of {name} cannot be a table cell"));
            }
        };
        written.map_err(|error| error.to_string())?;
        Ok(&self.text)
    }

    /// Prints the next number in its debug format: the shortest digits that read back as the same number.
    fn print<T: Deserialize<'a> + std::fmt::Debug>(&mut self) -> Result<std::fmt::Result, String> {
        let value: T = self.read()?;
        Ok(write!(self.text, "{value:?}"))
    }

    /// Returns the next value as a word: the bits of a number, sign-extended for a signed integer.
    pub fn word(&mut self, kind: &Kind) -> Result<u64, String> {
        Ok(match kind {
            Kind::Bool => u64::from(self.read::<bool>()?),
            Kind::Int8 => self.read::<i8>()? as u64,
            Kind::Uint8 => u64::from(self.read::<u8>()?),
            Kind::Uint64 => self.read()?,
            Kind::Float64 => self.read::<f64>()?.to_bits(),
            other => {
                return Err(format!(
                    "a value of type {other:?} has no representation as a word"
                ));
            }
        })
    }

    /// Returns the next value, which must be a text.
    pub fn string(&mut self) -> Result<String, String> {
        self.read()
    }

    /// Skips all values of a field.
    pub fn skip(&mut self, definitions: &Definitions, field: &Field) -> Result<(), String> {
        self.count_skipped(&field.name)?;
        let count = match field.count {
            Count::One => 1,
            Count::Array(count) => count,
            Count::Sequence | Count::Bounded => self.length()? as usize,
        };
        for _ in 0..count {
            self.count_skipped(&field.name)?;
            match &field.kind {
                Kind::Message(name) => {
                    for inner in definitions.fields(name) {
                        self.skip(definitions, inner)?;
                    }
                }
                kind => {
                    self.next(kind)?;
                }
            }
        }
        Ok(())
    }

    /// Limits the number of skipped values: values of zero size take no bytes, so that the length of the message does not limit
    /// their number.
    fn count_skipped(&mut self, name: &str) -> Result<(), String> {
        self.skipped += 1;
        match self.skipped > self.bytes + MAX_FIELDS {
            true => Err(format!(
                "at {name}: more fields than a message of {} bytes has",
                self.bytes
            )),
            false => Ok(()),
        }
    }

    /// Returns the length of a sequence.
    pub fn length(&mut self) -> Result<u32, String> {
        self.read()
    }

    fn read<T: Deserialize<'a>>(&mut self) -> Result<T, String> {
        T::deserialize(&mut self.reader).map_err(|error| error.to_string())
    }

    pub fn end(&self) -> Result<(), String> {
        match self.bytes - self.reader.bytes_consumed() {
            0 => Ok(()),
            left => Err(format!(
                "the message has {left} bytes more than its definition"
            )),
        }
    }
}
