//! CDR in the wire format of ROS 2: a four-byte header for "plain, little endian", then the values, each aligned
//! to its size relative to the end of the header.

use byteorder::LittleEndian;
use serde::{Deserialize, Serialize};

const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Encodes `value`, replacing the content of `into`.
///
/// # Errors
/// `cdr_encoding::Error` for a value that CDR does not have, such as a map.
pub fn encode<T: Serialize>(value: &T, into: &mut Vec<u8>) -> cdr_encoding::Result<()> {
    into.clear();
    into.extend_from_slice(&ENCAPSULATION);
    cdr_encoding::to_writer::<T, LittleEndian, _>(into, value)
}

/// Decodes a message.
///
/// # Errors
/// What is wrong: another byte order, missing bytes, excess bytes.
pub fn decode<'a, T: Deserialize<'a>>(data: &'a [u8]) -> Result<T, String> {
    let values = values(data)?;
    let (value, read) =
        cdr_encoding::from_bytes::<T, LittleEndian>(values).map_err(|error| error.to_string())?;
    if read != values.len() {
        return Err(format!(
            "the message has {} bytes, expected {read}",
            values.len()
        ));
    }
    Ok(value)
}

/// Returns the values after the encapsulation header.
pub(crate) fn values(data: &[u8]) -> Result<&[u8], String> {
    let values = data.strip_prefix(&ENCAPSULATION);
    values.ok_or_else(|| "not plain little-endian CDR".to_owned())
}

/// Arrays of const generic length, which serde does not support.
pub(crate) mod array {
    use serde::de::{Error, SeqAccess, Visitor};
    use serde::ser::SerializeTuple;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};
    use std::fmt;
    use std::marker::PhantomData;

    pub fn serialize<S: Serializer, T: Serialize, const N: usize>(
        array: &[T; N],
        serializer: S,
    ) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(N)?;
        for element in array {
            tuple.serialize_element(element)?;
        }
        tuple.end()
    }

    pub fn deserialize<'de, D, T, const N: usize>(deserializer: D) -> Result<[T; N], D::Error>
    where
        D: Deserializer<'de>,
        T: Deserialize<'de> + Copy + Default,
    {
        deserializer.deserialize_tuple(N, Elements(PhantomData))
    }

    struct Elements<T, const N: usize>(PhantomData<T>);

    impl<'de, T, const N: usize> Visitor<'de> for Elements<T, N>
    where
        T: Deserialize<'de> + Copy + Default,
    {
        type Value = [T; N];

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "{N} elements")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<[T; N], A::Error> {
            let mut array = [T::default(); N];
            for (i, element) in array.iter_mut().enumerate() {
                *element = sequence
                    .next_element()?
                    .ok_or_else(|| Error::invalid_length(i, &self))?;
            }
            Ok(array)
        }
    }
}
