//! Hashes of ROS 2 message types, version `RIHS01`: SHA-256 of the type's description as JSON.
//!
//! Source: REP 2016 and the comments of `rosidl_generator_type_description`.

use crate::error::RosError;
use serde::Serialize;
use serde_json::ser::{Formatter, Serializer};
use sha2::{Digest, Sha256};
use std::io;

/// Separator between the definitions of a type and of the types that it contains.
const SEPARATOR: &str =
    "================================================================================";

#[derive(Serialize)]
struct Description {
    type_description: Type,
    referenced_type_descriptions: Vec<Type>,
}

#[derive(Serialize)]
struct Type {
    type_name: String,
    fields: Vec<Field>,
}

#[derive(Serialize)]
struct Field {
    name: String,
    r#type: FieldType,
}

#[derive(Serialize)]
struct FieldType {
    type_id: u8,
    capacity: u64,
    string_capacity: u64,
    nested_type_name: String,
}

/// Returns the hash of a message type; `definition` has the definitions of the types that it contains after its own, as in a log.
///
/// # Errors
/// [`RosError::Definition`].
pub(crate) fn type_hash(name: &str, definition: &str) -> Result<String, RosError> {
    let error = |reason: String| RosError::Definition {
        name: name.to_owned(),
        reason,
    };
    let mut parts = definition.split(SEPARATOR);
    let own = parse(name, parts.next().unwrap_or_default()).map_err(error)?;
    let mut referenced = Vec::new();
    for part in parts {
        let part = part.trim_start();
        let (first, rest) = part.split_once('\n').unwrap_or((part, ""));
        let nested = first
            .strip_prefix("MSG: ")
            .ok_or_else(|| error(format!("`{first}` is not `MSG: TYPE`")))?;
        referenced.push(parse(&full_name(nested.trim(), name), rest).map_err(error)?);
    }
    referenced.sort_by(|a, b| a.type_name.cmp(&b.type_name));
    let description = Description {
        type_description: own,
        referenced_type_descriptions: referenced,
    };
    let mut json = Vec::new();
    description
        .serialize(&mut Serializer::with_formatter(&mut json, Spaced))
        .map_err(|json| error(json.to_string()))?;
    let digest = Sha256::digest(&json);
    let hex: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    Ok(format!("RIHS01_{hex}"))
}

/// Reads the fields of one definition.
fn parse(name: &str, definition: &str) -> Result<Type, String> {
    let mut fields = Vec::new();
    for line in definition.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let mut words = line.split_whitespace();
        let (Some(of_type), Some(field)) = (words.next(), words.next()) else {
            if line.is_empty() {
                continue;
            }
            return Err(format!("`{line}` is not `TYPE NAME`"));
        };
        // A constant, which is not part of the message.
        if field.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            continue;
        }
        fields.push(Field {
            name: field.to_owned(),
            r#type: field_type(of_type, name)?,
        });
    }
    Ok(Type {
        type_name: name.to_owned(),
        fields,
    })
}

/// Reads `float64`, `float64[3]`, `string[<=4]`, `geometry_msgs/Vector3[]`.
fn field_type(text: &str, within: &str) -> Result<FieldType, String> {
    const ARRAY: u8 = 48;
    const BOUNDED_SEQUENCE: u8 = 96;
    const SEQUENCE: u8 = 144;
    let (element, size) = match text.strip_suffix(']').and_then(|text| text.split_once('[')) {
        Some((element, size)) => (element, Some(size)),
        None => (text, None),
    };
    let number = |size: &str| {
        let count = size.parse::<u64>();
        count.map_err(|error| format!("{text}: {error}"))
    };
    let (offset, capacity) = match size {
        None => (0, 0),
        Some("") => (SEQUENCE, 0),
        Some(size) => match size.strip_prefix("<=") {
            Some(bound) => (BOUNDED_SEQUENCE, number(bound)?),
            None => (ARRAY, number(size)?),
        },
    };
    let (id, nested) = match element {
        "int8" => (2, None),
        "uint8" | "char" => (3, None),
        "int16" => (4, None),
        "uint16" => (5, None),
        "int32" => (6, None),
        "uint32" => (7, None),
        "int64" => (8, None),
        "uint64" => (9, None),
        "float32" => (10, None),
        "float64" => (11, None),
        "bool" => (15, None),
        "byte" => (16, None),
        "string" => (17, None),
        "wstring" => (18, None),
        nested => (1, Some(full_name(nested, within))),
    };
    Ok(FieldType {
        type_id: id + offset,
        capacity,
        string_capacity: 0,
        nested_type_name: nested.unwrap_or_default(),
    })
}

/// `geometry_msgs/Vector3` as `geometry_msgs/msg/Vector3`; a name without a package is of the package of the type `within`.
fn full_name(name: &str, within: &str) -> String {
    let package = within.split('/').next().unwrap_or_default();
    match name.split_once('/') {
        Some((_, rest)) if rest.contains('/') => name.to_owned(),
        Some((package, name)) => format!("{package}/msg/{name}"),
        None => format!("{package}/msg/{name}"),
    }
}

/// JSON as Python's `json.dumps` writes it: a space after commas and colons.
struct Spaced;

impl Formatter for Spaced {
    fn begin_array_value<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        separator(writer, first)
    }

    fn begin_object_key<W: ?Sized + io::Write>(
        &mut self,
        writer: &mut W,
        first: bool,
    ) -> io::Result<()> {
        separator(writer, first)
    }

    fn begin_object_value<W: ?Sized + io::Write>(&mut self, writer: &mut W) -> io::Result<()> {
        writer.write_all(b": ")
    }
}

fn separator<W: ?Sized + io::Write>(writer: &mut W, first: bool) -> io::Result<()> {
    match first {
        true => Ok(()),
        false => writer.write_all(b", "),
    }
}

#[cfg(test)]
mod tests {
    use super::type_hash;
    use crate::trajectory;
    use supple_log::LiveEncoder;

    /// Hashes of the distributions Humble to Jazzy.
    const PUBLISHED: [(&str, &str); 5] = [
        (
            "geometry_msgs/msg/WrenchStamped",
            "8dc3deaf06b2ab281f9f9a742a8961c328ca7cec16e3fd6586d3a5c83fa78f77",
        ),
        (
            "sensor_msgs/msg/JointState",
            "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
        ),
        (
            "std_msgs/msg/String",
            "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
        ),
        (
            "tf2_msgs/msg/TFMessage",
            "e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087",
        ),
        (
            trajectory::TYPE,
            "179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e",
        ),
    ];

    #[test]
    fn hashes_are_those_of_ros() {
        let mut types = vec![(
            trajectory::TYPE.to_owned(),
            trajectory::DEFINITION.to_owned(),
        )];
        for channel in LiveEncoder::<4>::channels().expect("channels") {
            types.push((channel.schema_name, channel.schema));
        }
        for (name, hash) in PUBLISHED {
            let (_, definition) = types.iter().find(|(of, _)| of == name).expect(name);
            assert_eq!(
                type_hash(name, definition).expect(name),
                format!("RIHS01_{hash}"),
                "{name}"
            );
        }
        for (name, definition) in &types {
            assert!(type_hash(name, definition).is_ok(), "{name}");
        }
    }

    #[test]
    fn a_definition_that_cannot_be_read_is_named() {
        for definition in ["float64", "float64[x] a", "float64 a\n=\n"] {
            let error = type_hash("a/msg/B", definition).expect_err(definition);
            assert!(error.to_string().contains("a/msg/B"), "{error}");
        }
    }
}
