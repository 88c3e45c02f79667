//! Layout of a record in words: fields, their shapes, and how each is packed and unpacked.

use super::text::Text;
use crate::math::Vector;

/// Type of one element of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Element {
    /// True or false.
    Bool,
    /// A small signed integer.
    Int8,
    /// A numeric code, such as a mode.
    Uint8,
    /// A counter.
    Uint64,
    /// A number.
    Float64,
}

/// One of several torques that a field has for each joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Term {
    /// Name.
    pub name: &'static str,
    /// Description, one sentence per line.
    pub description: &'static str,
}

/// Number and type of the values of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// One value.
    One(Element),
    /// One value per joint.
    PerJoint(Element),
    /// Three numbers: x, y, z.
    Vector,
    /// One number per joint for each term.
    Terms(&'static [Term]),
    /// The count, then this many numbers, of which the first `count` are valid.
    List(usize),
    /// The length in bytes, then UTF-8 in [`Text::MAX_BYTES`] bytes.
    Text,
}

impl Shape {
    /// Returns the number of 64-bit words of a field of this shape, for an arm of `joints` joints.
    pub const fn words(self, joints: usize) -> usize {
        match self {
            Shape::One(_) => 1,
            Shape::PerJoint(_) => joints,
            Shape::Vector => 3,
            Shape::Terms(terms) => terms.len() * joints,
            Shape::List(max) => 1 + max,
            Shape::Text => 1 + Text::MAX_BYTES / 8,
        }
    }
}

/// A field of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name, with the unit.
    pub name: &'static str,
    /// Its values.
    pub shape: Shape,
    /// Description, one sentence per line.
    pub description: &'static str,
}

/// Returns the number of 64-bit words of a record, for an arm of `joints` joints.
pub const fn words_of(fields: &[Field], joints: usize) -> usize {
    let (mut sum, mut i) = (0, 0);
    while i < fields.len() {
        sum += fields[i].shape.words(joints);
        i += 1;
    }
    sum
}

/// Writes 64-bit words one after another.
#[derive(Debug)]
pub struct Pack<'a> {
    words: &'a mut [u64],
    next: usize,
}

impl<'a> Pack<'a> {
    /// Starts at the first of `words`.
    pub fn new(words: &'a mut [u64]) -> Self {
        Pack { words, next: 0 }
    }

    /// Writes the next word.
    ///
    /// # Panics
    /// Beyond the last word.
    pub fn word(&mut self, word: u64) {
        self.words[self.next] = word;
        self.next += 1;
    }
}

/// Reads 64-bit words one after another; beyond the last word it returns zeros.
#[derive(Debug)]
pub struct Unpack<'a> {
    words: &'a [u64],
    next: usize,
    joints: usize,
}

impl<'a> Unpack<'a> {
    /// Starts at the first of `words`, the record of an arm of `joints` joints.
    pub fn new(words: &'a [u64], joints: usize) -> Self {
        Unpack {
            words,
            next: 0,
            joints,
        }
    }

    /// Reads the next word.
    pub fn word(&mut self) -> u64 {
        let word = self.words.get(self.next).copied().unwrap_or_default();
        self.next += 1;
        word
    }

    /// Reads one value per joint into the first entries of an array of `N`; the other entries keep the default.
    pub fn per_joint<T: Copy + Default, const N: usize>(
        &mut self,
        mut read: impl FnMut(&mut Self) -> T,
    ) -> [T; N] {
        let mut values = [T::default(); N];
        for joint in 0..self.joints {
            let value = read(self);
            if let Some(entry) = values.get_mut(joint) {
                *entry = value;
            }
        }
        values
    }
}

/// A value of a record of an arm with `N` joints.
pub trait Recorded<const N: usize>: Sized {
    /// Number and type of its values.
    const SHAPE: Shape;

    /// Writes its words.
    fn pack(&self, to: &mut Pack<'_>);

    /// Reads its words.
    fn unpack(from: &mut Unpack<'_>) -> Self;
}

/// Implements [`Recorded`] for types that take one word, with the functions from value to word and back.
macro_rules! single_word {
    ($($type:ty, $element:ident, $encode:expr, $decode:expr;)*) => {$(
        impl<const N: usize> Recorded<N> for $type {
            const SHAPE: Shape = Shape::One(Element::$element);

            fn pack(&self, to: &mut Pack<'_>) {
                let encode: fn($type) -> u64 = $encode;
                to.word(encode(*self));
            }

            fn unpack(from: &mut Unpack<'_>) -> Self {
                let decode: fn(u64) -> $type = $decode;
                decode(from.word())
            }
        }
    )*};
}

single_word! {
    bool, Bool, u64::from, |word| word != 0;
    u8, Uint8, u64::from, |word| word as u8;
    i8, Int8, |value| value as u64, |word| word as i8;
    u64, Uint64, |value| value, |word| word;
    f64, Float64, f64::to_bits, f64::from_bits;
}

impl<const N: usize> Recorded<N> for [f64; 3] {
    const SHAPE: Shape = Shape::Vector;

    fn pack(&self, to: &mut Pack<'_>) {
        for value in self {
            to.word(value.to_bits());
        }
    }

    fn unpack(from: &mut Unpack<'_>) -> Self {
        core::array::from_fn(|_| f64::from_bits(from.word()))
    }
}

impl<const N: usize> Recorded<N> for Vector<N> {
    const SHAPE: Shape = Shape::PerJoint(Element::Float64);

    fn pack(&self, to: &mut Pack<'_>) {
        for value in self {
            to.word(value.to_bits());
        }
    }

    fn unpack(from: &mut Unpack<'_>) -> Self {
        Vector::from(from.per_joint::<f64, N>(|from| f64::from_bits(from.word())))
    }
}

impl<const N: usize> Recorded<N> for [bool; N] {
    const SHAPE: Shape = Shape::PerJoint(Element::Bool);

    fn pack(&self, to: &mut Pack<'_>) {
        for value in self {
            to.word(u64::from(*value));
        }
    }

    fn unpack(from: &mut Unpack<'_>) -> Self {
        from.per_joint::<bool, N>(|from| from.word() != 0)
    }
}

/// A list of at most `MAX` numbers.
#[derive(Clone, Copy, PartialEq)]
pub struct List<const MAX: usize> {
    count: usize,
    values: [f64; MAX],
}

impl<const MAX: usize> List<MAX> {
    /// Creates a list of the first `MAX` of these numbers.
    pub fn new(values: &[f64]) -> Self {
        let count = values.len().min(MAX);
        let mut list = List {
            count,
            values: [0.0; MAX],
        };
        list.values[..count].copy_from_slice(&values[..count]);
        list
    }

    /// Returns the numbers.
    pub fn values(&self) -> &[f64] {
        &self.values[..self.count]
    }
}

impl<const MAX: usize> core::fmt::Debug for List<MAX> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.values().fmt(f)
    }
}

impl<const N: usize, const MAX: usize> Recorded<N> for List<MAX> {
    const SHAPE: Shape = Shape::List(MAX);

    fn pack(&self, to: &mut Pack<'_>) {
        to.word(self.count as u64);
        for value in &self.values {
            to.word(value.to_bits());
        }
    }

    fn unpack(from: &mut Unpack<'_>) -> Self {
        let count = usize::try_from(from.word()).map_or(MAX, |count| count.min(MAX));
        List {
            count,
            values: core::array::from_fn(|_| f64::from_bits(from.word())),
        }
    }
}

impl<const N: usize> Recorded<N> for Text {
    const SHAPE: Shape = Shape::Text;

    fn pack(&self, to: &mut Pack<'_>) {
        let bytes = self.as_str().as_bytes();
        to.word(bytes.len() as u64);
        for i in 0..Text::MAX_BYTES / 8 {
            let mut word = [0; 8];
            for (byte, source) in word.iter_mut().zip(bytes.iter().skip(8 * i)) {
                *byte = *source;
            }
            to.word(u64::from_le_bytes(word));
        }
    }

    fn unpack(from: &mut Unpack<'_>) -> Self {
        let length = from.word();
        let mut bytes = [0; Text::MAX_BYTES];
        for chunk in bytes.chunks_exact_mut(8) {
            chunk.copy_from_slice(&from.word().to_le_bytes());
        }
        Text::from_utf8_lossy(&bytes, length)
    }
}
