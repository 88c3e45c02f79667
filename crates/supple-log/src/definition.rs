//! Parser of message definitions in `ros2msg` format.

use std::collections::BTreeMap;

/// Maximum number of fields (array elements included) in a table; zero-size fields occupy no bytes, so the message
/// length does not bound their number.
pub(crate) const MAX_FIELDS: usize = 100_000;
/// Maximum nesting depth of messages; ROS messages have five levels.
const MAX_DEPTH: usize = 32;
/// Maximum size of a definition \[bytes\]: a hundred times that of any message.
const MAX_BYTES: usize = 1 << 20;

/// Line between the definitions of a text.
pub(crate) const SEPARATOR: &str =
    "================================================================================";

/// Element type of a field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Bool,
    Int8,
    Int16,
    Int32,
    Int64,
    Uint8,
    Uint16,
    Uint32,
    Uint64,
    Float32,
    Float64,
    String,
    /// `package/Type`.
    Message(String),
}

/// Number of elements of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Count {
    One,
    Array(usize),
    Sequence,
    /// A sequence with a maximum length.
    Bounded,
}

/// One field of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Field {
    pub name: String,
    pub kind: Kind,
    pub count: Count,
}

/// A message type and all types that it uses.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Definitions {
    root: String,
    types: BTreeMap<String, Vec<Field>>,
}

impl Definitions {
    /// Fields of the message itself.
    pub fn root(&self) -> &[Field] {
        self.fields(&self.root)
    }

    /// Fields of a type; empty for an undefined type.
    pub fn fields(&self, name: &str) -> &[Field] {
        self.types.get(name).map_or(&[], Vec::as_slice)
    }

    /// Rejects undefined, empty and recursive types.
    pub fn check(&self) -> Result<(), String> {
        let used = self.types.values().flatten().filter_map(|f| match &f.kind {
            Kind::Message(name) => Some(name),
            _ => None,
        });
        for name in used.chain([&self.root]) {
            if self.fields(name).is_empty() {
                return Err(format!("{name} is used but not defined"));
            }
        }
        let mut depths = BTreeMap::new();
        for name in self.types.keys() {
            self.depth(name, 0, &mut depths)?;
        }
        Ok(())
    }

    /// Returns the nesting depth from `name` on, itself included. `above` is the number of enclosing messages; `depths` caches
    /// results.
    fn depth<'a>(
        &'a self,
        name: &'a str,
        above: usize,
        depths: &mut BTreeMap<&'a str, usize>,
    ) -> Result<usize, String> {
        let too_deep = || {
            format!(
                "{name} is recursive, or messages are nested more than {MAX_DEPTH} levels deep: such a type \
                 cannot be written as a table"
            )
        };
        if let Some(depth) = depths.get(name) {
            return match above + depth > MAX_DEPTH {
                true => Err(too_deep()),
                false => Ok(*depth),
            };
        }
        if above >= MAX_DEPTH {
            return Err(too_deep());
        }
        let mut depth = 1;
        for field in self.fields(name) {
            if let Kind::Message(inner) = &field.kind {
                depth = depth.max(1 + self.depth(inner, above + 1, depths)?);
            }
        }
        depths.insert(name, depth);
        Ok(depth)
    }
}

/// Parses the definitions in `text`; the first is that of `root`. `package/msg/Type` equals `package/Type`.
pub(crate) fn parse(root: &str, text: &str) -> Result<Definitions, String> {
    if text.len() > MAX_BYTES {
        let bytes = text.len();
        return Err(format!(
            "a message definition has {bytes} bytes, the maximum is {MAX_BYTES}"
        ));
    }
    let root = root.replace("/msg/", "/");
    let mut types = BTreeMap::new();
    for (index, part) in text.split(SEPARATOR).enumerate() {
        let part = part.trim_start_matches(['=', '\n', '\r']);
        let (name, body) = if index == 0 {
            (root.clone(), part)
        } else {
            let (title, body) = part.split_once('\n').unwrap_or((part, ""));
            let name = title
                .strip_prefix("MSG: ")
                .ok_or_else(|| format!("expected `MSG: package/Type`, found {title:?}"))?;
            (name.trim().replace("/msg/", "/"), body)
        };
        let fields = fields(&name, body)?;
        types.insert(name, fields);
    }
    let definitions = Definitions { root, types };
    definitions.check()?;
    Ok(definitions)
}

/// Fields of one definition, without constants and comments.
pub(crate) fn fields(name: &str, body: &str) -> Result<Vec<Field>, String> {
    let package = name.split('/').next().unwrap_or(name);
    body.lines()
        .map(|line| line.split('#').next().unwrap_or("").trim())
        .filter(|line| !line.is_empty())
        .filter(|line| !is_constant(line))
        .map(|line| field(package, line).ok_or_else(|| format!("{name}: cannot read {line:?}")))
        .collect()
}

/// Returns whether a line defines a constant, `type NAME=value`; `<=` belongs to a type.
fn is_constant(line: &str) -> bool {
    line.replace("<=", "").contains('=')
}

/// Parses a field, `type name`, with an optional default value.
fn field(package: &str, line: &str) -> Option<Field> {
    let mut words = line.split_whitespace();
    let (of, name) = (words.next()?, words.next()?);
    let (of, count) = match of.split_once('[') {
        None => (of, Count::One),
        Some((of, count)) => (of, self::count(count.strip_suffix(']')?)?),
    };
    let kind = match of.split_once("<=").map_or(of, |(of, _)| of) {
        "bool" => Kind::Bool,
        "int8" => Kind::Int8,
        "int16" => Kind::Int16,
        "int32" => Kind::Int32,
        "int64" => Kind::Int64,
        "uint8" | "byte" | "char" => Kind::Uint8,
        "uint16" => Kind::Uint16,
        "uint32" => Kind::Uint32,
        "uint64" => Kind::Uint64,
        "float32" => Kind::Float32,
        "float64" => Kind::Float64,
        "string" => Kind::String,
        message if message.contains('/') => Kind::Message(message.replace("/msg/", "/")),
        message => Kind::Message(format!("{package}/{message}")),
    };
    Some(Field {
        name: name.to_owned(),
        kind,
        count,
    })
}

fn count(text: &str) -> Option<Count> {
    match text {
        "" => Some(Count::Sequence),
        _ if text.starts_with("<=") => Some(Count::Bounded),
        _ => text.parse().ok().map(Count::Array),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reads_arrays_constants_defaults_comments_and_relative_names() {
        let text = format!(
            "# what it is\nint8 LOW=-1\nfloat64[3] a # metres\nstring[] b\nbool[<=2] c\n\
             uint8 d 7\nPart e\n{SEPARATOR}\nMSG: p/Part\nint16 x\n"
        );
        let definitions = parse("p/msg/Whole", &text).expect("parses");
        let found: Vec<_> = definitions
            .root()
            .iter()
            .map(|f| (f.name.as_str(), f.kind.clone(), f.count))
            .collect();
        assert_eq!(
            found,
            [
                ("a", Kind::Float64, Count::Array(3)),
                ("b", Kind::String, Count::Sequence),
                ("c", Kind::Bool, Count::Bounded),
                ("d", Kind::Uint8, Count::One),
                ("e", Kind::Message("p/Part".into()), Count::One),
            ]
        );
        assert_eq!(definitions.fields("p/Part")[0].kind, Kind::Int16);
    }

    #[test]
    fn rejects_recursive_and_too_deeply_nested_types() {
        let own = |text: &str| parse("p/A", text).expect_err("no table has such a type");
        for text in [
            "A a\n".to_owned(),
            "A[] a\n".to_owned(),
            format!("B b\n{SEPARATOR}\nMSG: p/B\nA[2] a\n"),
        ] {
            let error = own(&text);
            assert!(error.contains("is recursive"), "{error}");
        }
        let chain = |length: usize| {
            let mut text = "M1 m\n".to_owned();
            for i in 1..length {
                text += &format!("{SEPARATOR}\nMSG: p/M{i}\nM{} m\n", i + 1);
            }
            text + &format!("{SEPARATOR}\nMSG: p/M{length}\nint8 x\n")
        };
        assert!(parse("p/A", &chain(MAX_DEPTH - 1)).is_ok());
        for length in [MAX_DEPTH, 10_000] {
            let error = own(&chain(length));
            assert!(error.contains("32 levels deep"), "{error}");
        }
    }

    #[test]
    fn rejects_undefined_types_and_malformed_fields() {
        assert!(parse("p/A", "Missing m\n").is_err());
        assert!(parse("p/A", "float64\n").is_err());
        assert!(parse("p/A", "float64[x] a\n").is_err());
        assert!(parse("p/A", &format!("int8 a\n{SEPARATOR}\nint8 b\n")).is_err());
    }
}
