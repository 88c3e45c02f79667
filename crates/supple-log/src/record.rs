//! The record of a cycle as a message: message definition, encoding, and decoding of messages of this or another
//! version. The decoder finds fields by their names in the definition inside the log. A field that the log lacks gets its
//! default; a field that only the log has is skipped.

use crate::definition::{self, Count, Definitions, Field as Defined, Kind};
use crate::scan::{Channel, Schema};
use crate::values::Values;
use serde::ser::SerializeTuple;
use serde::{Serialize, Serializer};
use std::collections::BTreeSet;
use std::fmt::Write;
use std::sync::Arc;
use supple_core::codes;
use supple_core::controller::CycleRecord;
use supple_core::record::{Element, Field, Shape, Term};
use supple_core::torques::TERMS;

/// Channel of the records.
pub(crate) const CONTROLLER_STATE: &str = "/controller_state";
/// Type of the terms of the torque.
const TERMS_TYPE: &str = "supple_msgs/TorqueTerms";
/// Type of a vector.
const VECTOR_TYPE: &str = "geometry_msgs/Vector3";
/// Fields that earlier versions lack and whose default is not zero.
const DEFAULTS: &[(&str, u64)] = &[("drives_active", 1)];
/// Names of fields in earlier versions, and their names now.
const RENAMED: &[(&str, &str)] = &[("least_singular_value_m", "min_singular_value_m")];
/// Text before the fields of a record.
const HEAD: &str = "\
# One step of the controller: input, output, and every term of the torque.
#
# N is the number of joints, in the order of /joint_states. SI units, base axes. If a has_x is false there was no x
# and its entries are zero. header.stamp is the time of the measurement, header.frame_id the base link.

std_msgs/Header header
";

/// Every field of a record.
const FIELDS: &[Field] = CycleRecord::<1>::FIELDS;

/// Fields of `supple_msgs/ControllerState`; `[N]` stands for the number of joints.
pub(crate) fn definition() -> String {
    let mut text = HEAD.to_owned();
    for field in FIELDS {
        comment(&mut text, field.description);
        for (name, number) in constants(field.name) {
            let _ = writeln!(text, "uint8 {}_{name}={number}", field.name.to_uppercase());
        }
        let _ = match field.shape {
            Shape::One(element) => writeln!(text, "{} {}", type_of(element), field.name),
            Shape::PerJoint(element) => writeln!(text, "{}[N] {}", type_of(element), field.name),
            Shape::Vector => writeln!(text, "{VECTOR_TYPE} {}", field.name),
            Shape::Terms(_) => writeln!(text, "{TERMS_TYPE} {}", field.name),
            Shape::List(max) => writeln!(text, "float64[<={max}] {}", field.name),
            Shape::Text => writeln!(text, "string {}", field.name),
        };
    }
    text
}

/// Fields of `supple_msgs/TorqueTerms`.
pub(crate) fn terms_definition() -> String {
    let mut text =
        "# The terms whose sum, once limited, is the joint torque (N m). N is the number of joints.\n"
            .to_owned();
    for term in TERMS {
        comment(&mut text, term.description);
        let _ = writeln!(text, "float64[N] {}", term.name);
    }
    text
}

/// Returns the names of the numbers of a field that holds codes.
fn constants(field: &str) -> Vec<(String, u8)> {
    let named = |all: &[codes::Code]| {
        let owned = |code: &codes::Code| (code.name.to_uppercase(), code.number);
        all.iter().map(owned).collect()
    };
    match field {
        "request" => named(codes::request_kind::ALL),
        "trajectory" => named(codes::trajectory_kind::ALL),
        "fault" => named(codes::fault_kind::ALL),
        "refusal" => named(codes::refusal_kind::ALL),
        "mode" => {
            let modes = codes::MODES.iter();
            modes
                .map(|mode| (mode.name().to_uppercase(), *mode as u8))
                .collect()
        }
        _ => Vec::new(),
    }
}

/// Writes a description from a doc comment as a comment, without the escapes of its mark-up.
fn comment(text: &mut String, description: &str) {
    for line in description.lines() {
        let line = line
            .replace("\\[", "(")
            .replace("\\]", ")")
            .replace('`', "");
        let _ = writeln!(text, "#{}", line.trim_end());
    }
}

fn type_of(element: Element) -> &'static str {
    match element {
        Element::Bool => "bool",
        Element::Int8 => "int8",
        Element::Uint8 => "uint8",
        Element::Uint64 => "uint64",
        Element::Float64 => "float64",
    }
}

fn kind_of(element: Element) -> Kind {
    match element {
        Element::Bool => Kind::Bool,
        Element::Int8 => Kind::Int8,
        Element::Uint8 => Kind::Uint8,
        Element::Uint64 => Kind::Uint64,
        Element::Float64 => Kind::Float64,
    }
}

/// The words of a record, for serialisation.
pub(crate) struct RecordWords<'a> {
    pub words: &'a [u64],
    pub joints: usize,
}

impl Serialize for RecordWords<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.words.len())?;
        let mut rest = self.words;
        for field in FIELDS {
            let (words, after) = rest.split_at(field.shape.words(self.joints));
            rest = after;
            match field.shape {
                Shape::One(element) | Shape::PerJoint(element) => {
                    for word in words {
                        one(&mut tuple, element, *word)?;
                    }
                }
                Shape::Vector | Shape::Terms(_) => {
                    for word in words {
                        one(&mut tuple, Element::Float64, *word)?;
                    }
                }
                Shape::List(max) => {
                    let count = usize::try_from(words[0]).map_or(max, |count| count.min(max));
                    let values = words[1..=count].iter().map(|word| f64::from_bits(*word));
                    tuple.serialize_element(&values.collect::<Vec<f64>>())?;
                }
                Shape::Text => {
                    let max = 8 * (words.len() - 1);
                    let length = usize::try_from(words[0]).map_or(max, |length| length.min(max));
                    let bytes = words[1..].iter().flat_map(|word| word.to_le_bytes());
                    let bytes: Vec<u8> = bytes.take(length).collect();
                    tuple.serialize_element(&String::from_utf8_lossy(&bytes))?;
                }
            }
        }
        tuple.end()
    }
}

fn one<T: SerializeTuple>(tuple: &mut T, element: Element, word: u64) -> Result<(), T::Error> {
    match element {
        Element::Bool => tuple.serialize_element(&(word != 0)),
        Element::Int8 => tuple.serialize_element(&(word as i8)),
        Element::Uint8 => tuple.serialize_element(&(word as u8)),
        Element::Uint64 => tuple.serialize_element(&word),
        Element::Float64 => tuple.serialize_element(&f64::from_bits(word)),
    }
}

/// Decodes records of one message definition.
struct RecordDecoder {
    definitions: Definitions,
    joints: usize,
    steps: Vec<DecodeOperation>,
    defaults: Vec<u64>,
}

/// For each word of a record of this version: whether a message definition contains it.
#[derive(Clone, Debug)]
pub(crate) struct PresentWords(Vec<bool>);

impl PresentWords {
    /// Copies each word that the log's definition lacks from the logged record, where it has its default, to the replayed one, so that
    /// a comparison finds no difference there.
    pub fn restore_absent(&self, logged: &[u64], replayed: &mut [u64]) {
        let words = replayed.iter_mut().zip(logged).zip(&self.0);
        for ((replayed, logged), _) in words.filter(|(_, present)| !**present) {
            *replayed = *logged;
        }
    }
}

enum DecodeOperation {
    /// Reads values of this type to the given number of words from the given index on.
    Words(Kind, usize, usize),
    /// Reads a list of numbers to the words from this index on, with its maximum length.
    List(usize, usize),
    /// Reads a text to the words from this index on.
    Text(usize),
    /// Skips a field.
    Skip(Defined),
}

impl RecordDecoder {
    /// Creates a decoder for the definition inside a log of an arm with `joints` joints.
    ///
    /// # Errors
    /// An error if a field has another type than in this version.
    pub fn new(definitions: Definitions, joints: usize) -> Result<RecordDecoder, String> {
        let mut defaults = vec![0; CycleRecord::<1>::words(joints)];
        for (name, word) in DEFAULTS {
            if let Some((_, at)) = find(name, joints) {
                defaults[at] = *word;
            }
        }
        check(&definitions)?;
        let (mut steps, mut names) = (Vec::new(), BTreeSet::new());
        for defined in definitions.root() {
            if !names.insert(&defined.name) {
                return Err(format!("field {} is defined twice", defined.name));
            }
            match find(&defined.name, joints) {
                None => steps.push(DecodeOperation::Skip(defined.clone())),
                Some((Shape::Terms(terms), at)) => {
                    expect(defined, &Kind::Message(TERMS_TYPE.to_owned()), Count::One)?;
                    for inner in definitions.fields(TERMS_TYPE) {
                        steps.push(term(inner, terms, at, joints)?);
                    }
                }
                Some((shape, at)) => steps.push(step(defined, shape, at, joints)?),
            }
        }
        Ok(RecordDecoder {
            definitions,
            joints,
            steps,
            defaults,
        })
    }

    /// Returns which words the definition contains.
    fn present(&self) -> PresentWords {
        let mut present = vec![false; self.defaults.len()];
        for step in &self.steps {
            let (at, count) = match step {
                DecodeOperation::Words(_, at, count) => (*at, *count),
                DecodeOperation::List(at, max) => (*at, 1 + max),
                DecodeOperation::Text(at) => (*at, Shape::Text.words(0)),
                DecodeOperation::Skip(_) => continue,
            };
            present[at..at + count].fill(true);
        }
        PresentWords(present)
    }

    /// Decodes a message.
    ///
    /// # Errors
    /// An error if the bytes do not match the definition.
    pub fn decode<const N: usize>(&self, data: &[u8]) -> Result<CycleRecord<N>, String> {
        let mut values = Values::new(data)?;
        let mut words = self.defaults.clone();
        for step in &self.steps {
            match step {
                DecodeOperation::Words(kind, at, count) => {
                    for word in &mut words[*at..at + count] {
                        *word = values.word(kind)?;
                    }
                }
                DecodeOperation::List(at, max) => {
                    let count = values.length()? as usize;
                    if count > *max {
                        return Err(format!("a list has {count} values, the maximum is {max}"));
                    }
                    words[*at] = count as u64;
                    for word in &mut words[at + 1..=at + count] {
                        *word = values.word(&Kind::Float64)?;
                    }
                }
                DecodeOperation::Text(at) => {
                    let text = values.string()?;
                    let places = &mut words[*at..at + Shape::Text.words(0)];
                    let mut end = text.len().min(8 * (places.len() - 1));
                    while !text.is_char_boundary(end) {
                        end -= 1;
                    }
                    places[0] = end as u64;
                    let chunks = text.as_bytes()[..end].chunks(8);
                    for (word, chunk) in places[1..].iter_mut().zip(chunks) {
                        let mut bytes = [0; 8];
                        bytes[..chunk.len()].copy_from_slice(chunk);
                        *word = u64::from_le_bytes(bytes);
                    }
                }
                DecodeOperation::Skip(field) => values.skip(&self.definitions, field)?,
            }
        }
        values.end()?;
        Ok(CycleRecord::unpack(&words, self.joints))
    }
}

/// Decodes the records of one channel with the channel's own definition.
#[derive(Default)]
pub(crate) struct ChannelDecoder(Option<(Arc<Schema>, RecordDecoder)>);

impl ChannelDecoder {
    /// Returns which words the definition of a channel contains.
    ///
    /// # Errors
    /// As [`ChannelDecoder::decode`].
    pub fn present(channel: &Channel, joints: usize) -> Result<PresentWords, String> {
        let text = String::from_utf8_lossy(&channel.schema.text);
        let definitions = definition::parse(&channel.schema.name, &text)?;
        Ok(RecordDecoder::new(definitions, joints)?.present())
    }

    /// Decodes a message of the channel.
    ///
    /// # Errors
    /// An error if the definition is not that of a record, or if the bytes do not match it.
    pub fn decode<const N: usize>(
        &mut self,
        channel: &Channel,
        data: &[u8],
    ) -> Result<CycleRecord<N>, String> {
        // Channels with the same topic may have different definitions: a decoder is used again only for an equal one.
        let known = self.0.as_ref().is_some_and(|(schema, _)| {
            Arc::ptr_eq(schema, &channel.schema) || *schema == channel.schema
        });
        if !known {
            let text = String::from_utf8_lossy(&channel.schema.text);
            let definitions = definition::parse(&channel.schema.name, &text)?;
            self.0 = Some((channel.schema.clone(), RecordDecoder::new(definitions, N)?));
        }
        match &self.0 {
            Some((_, decoder)) => decoder.decode(data),
            None => Err("the channel has no message definition".to_owned()),
        }
    }
}

/// Rejects a definition that is not that of a record, because its records would decode to zeros.
fn check(definitions: &Definitions) -> Result<(), String> {
    for needed in [
        "step",
        "input_cycle",
        "cycle",
        "mode",
        "position_rad",
        "velocity_rad_per_s",
        "torque_nm",
    ] {
        let mut fields = definitions.root().iter();
        if !fields.any(|field| field.name == needed) {
            return Err(format!("the definition has no field {needed}"));
        }
    }
    let axes = definitions.fields(VECTOR_TYPE).iter();
    let axes: Vec<_> = axes
        .map(|axis| (axis.name.as_str(), &axis.kind, axis.count))
        .collect();
    let expected = ["x", "y", "z"].map(|name| (name, &Kind::Float64, Count::One));
    match axes.is_empty() || axes == expected {
        true => Ok(()),
        false => Err(format!("{VECTOR_TYPE} is not three numbers")),
    }
}

/// Finds a field by its present or earlier name; returns its shape and the index of its first word.
fn find(name: &str, joints: usize) -> Option<(Shape, usize)> {
    let renamed = RENAMED.iter().find(|(earlier, _)| *earlier == name);
    let name = renamed.map_or(name, |(_, now)| now);
    let mut at = 0;
    for field in FIELDS {
        if field.name == name {
            return Some((field.shape, at));
        }
        at += field.shape.words(joints);
    }
    None
}

fn step(
    defined: &Defined,
    shape: Shape,
    at: usize,
    joints: usize,
) -> Result<DecodeOperation, String> {
    Ok(match shape {
        Shape::One(element) => {
            expect(defined, &kind_of(element), Count::One)?;
            DecodeOperation::Words(kind_of(element), at, 1)
        }
        Shape::PerJoint(element) => {
            expect(defined, &kind_of(element), Count::Array(joints))?;
            DecodeOperation::Words(kind_of(element), at, joints)
        }
        Shape::Vector | Shape::Terms(_) => {
            expect(defined, &Kind::Message(VECTOR_TYPE.to_owned()), Count::One)?;
            DecodeOperation::Words(Kind::Float64, at, 3)
        }
        Shape::List(max) => {
            expect(defined, &Kind::Float64, Count::Bounded)?;
            DecodeOperation::List(at, max)
        }
        Shape::Text => {
            expect(defined, &Kind::String, Count::One)?;
            DecodeOperation::Text(at)
        }
    })
}

fn term(
    defined: &Defined,
    terms: &[Term],
    at: usize,
    joints: usize,
) -> Result<DecodeOperation, String> {
    match terms.iter().position(|term| term.name == defined.name) {
        None => Ok(DecodeOperation::Skip(defined.clone())),
        Some(row) => {
            expect(defined, &Kind::Float64, Count::Array(joints))?;
            Ok(DecodeOperation::Words(
                Kind::Float64,
                at + row * joints,
                joints,
            ))
        }
    }
}

fn expect(defined: &Defined, kind: &Kind, count: Count) -> Result<(), String> {
    if (&defined.kind, defined.count) == (kind, count) {
        return Ok(());
    }
    Err(format!(
        "field {} is {:?}, {:?}; expected {kind:?}, {count:?}",
        defined.name, defined.kind, defined.count
    ))
}
