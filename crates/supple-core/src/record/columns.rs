//! The words of a record as the columns of a table.

use super::Text;
use super::layout::{Element, Field, Recorded, Shape, Unpack};
use core::fmt;

/// A column: a field, or a part of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Column {
    /// The field.
    pub field: &'static str,
    /// The term of a field that has several.
    pub term: Option<&'static str>,
    /// Joint or axis, counted from 0.
    pub part: Option<Part>,
}

/// Part of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// Value of a joint.
    Joint(usize),
    /// x, y or z.
    Axis(usize),
}

impl fmt::Display for Column {
    /// Writes `name`, `name.0`, `name.x` or `name.term.0`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.field)?;
        if let Some(term) = self.term {
            write!(f, ".{term}")?;
        }
        match self.part {
            None => Ok(()),
            Some(Part::Joint(joint)) => write!(f, ".{joint}"),
            Some(Part::Axis(axis)) => write!(f, ".{}", ["x", "y", "z"][axis.min(2)]),
        }
    }
}

/// A cell of a table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// 0 or 1.
    Flag(bool),
    /// A small integer.
    Index(i8),
    /// A code or a counter.
    Count(u64),
    /// A number.
    Number(f64),
    /// The bits of several numbers.
    Numbers(&'a [u64]),
    /// The words of a text, its length first.
    Text(&'a [u64]),
}

impl fmt::Display for Cell<'_> {
    /// Writes numbers with enough digits to read back the same number; several numbers are separated by spaces.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Cell::Flag(flag) => write!(f, "{}", u8::from(*flag)),
            Cell::Index(index) => write!(f, "{index}"),
            Cell::Count(count) => write!(f, "{count}"),
            Cell::Number(number) => write!(f, "{number:?}"),
            Cell::Numbers(numbers) => {
                for (i, number) in numbers.iter().enumerate() {
                    let space = if i == 0 { "" } else { " " };
                    write!(f, "{space}{:?}", f64::from_bits(*number))?;
                }
                Ok(())
            }
            Cell::Text(words) => {
                let text = <Text as Recorded<0>>::unpack(&mut Unpack::new(words, 0));
                f.write_str(text.as_str())
            }
        }
    }
}

impl Cell<'_> {
    fn new(element: Element, word: u64) -> Self {
        match element {
            Element::Bool => Cell::Flag(word != 0),
            Element::Int8 => Cell::Index(word as i8),
            Element::Uint8 | Element::Uint64 => Cell::Count(word),
            Element::Float64 => Cell::Number(f64::from_bits(word)),
        }
    }
}

/// Visits every column of a record for an arm of `joints` joints, in order; words that are missing are zero.
pub fn for_each_column(
    fields: &[Field],
    words: &[u64],
    joints: usize,
    mut visit: impl FnMut(Column, Cell<'_>),
) {
    let mut rest = words;
    for field in fields {
        let (words, after) = rest.split_at(field.shape.words(joints).min(rest.len()));
        rest = after;
        let word = |i: usize| words.get(i).copied().unwrap_or_default();
        let column = |term, part| Column {
            field: field.name,
            term,
            part,
        };
        match field.shape {
            Shape::One(element) => visit(column(None, None), Cell::new(element, word(0))),
            Shape::PerJoint(element) => {
                for joint in 0..joints {
                    let part = Some(Part::Joint(joint));
                    visit(column(None, part), Cell::new(element, word(joint)));
                }
            }
            Shape::Vector => {
                for axis in 0..3 {
                    let cell = Cell::new(Element::Float64, word(axis));
                    visit(column(None, Some(Part::Axis(axis))), cell);
                }
            }
            Shape::Terms(terms) => {
                for (row, term) in terms.iter().enumerate() {
                    for joint in 0..joints {
                        let cell = Cell::new(Element::Float64, word(row * joints + joint));
                        visit(column(Some(term.name), Some(Part::Joint(joint))), cell);
                    }
                }
            }
            Shape::List(max) => {
                let count = usize::try_from(word(0)).map_or(max, |count| count.min(max));
                let numbers = words.get(1..=count).unwrap_or_default();
                visit(column(None, None), Cell::Numbers(numbers));
            }
            Shape::Text => visit(column(None, None), Cell::Text(words)),
        }
    }
}
