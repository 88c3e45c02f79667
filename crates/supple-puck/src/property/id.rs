//! A property, and its id and width in one firmware.

pub(crate) const SET_BIT: u8 = 0x80;

/// A property, named as in the property lists of Barrett's libbarrett. A [`super::PropertyTable`] gives its id.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Property(pub(super) u8);

/// Number of a property in one firmware, 0 to 127.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PropertyId(pub(super) u8);

/// Width of a value on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Width {
    /// 16 bits, a frame of four bytes.
    Narrow,
    /// 32 bits, a frame of six bytes. The next id is unused.
    Wide,
}
