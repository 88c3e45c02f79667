//! Tables of numbers: each entry is declared once, with its name, its meaning, and the variant that has the number.

/// A number of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Code {
    /// The number, which keeps its meaning in all versions.
    pub number: u8,
    /// Name in logs and status lines.
    pub name: &'static str,
    /// Meaning.
    pub meaning: &'static str,
}

/// Declares a module with the constants of a table, and all of them as [`Code`]s at the places of their numbers.
macro_rules! number_table {
    (
        $(#[doc = $doc:literal])+ $module:ident {
            $($(#[doc = $meaning:literal])+ $constant:ident = $number:literal $name:literal,)+
        }
    ) => {
        $(#[doc = $doc])+
        pub mod $module {
            use crate::controller::codes::Code;

            /// Nothing.
            pub const NONE: u8 = 0;
            $($(#[doc = $meaning])+ pub const $constant: u8 = $number;)+

            /// Every number of the table.
            pub const ALL: &[Code] = &[
                Code {
                    number: NONE,
                    name: "none",
                    meaning: "Nothing.",
                },
                $(Code {
                    number: $number,
                    name: $name,
                    meaning: concat!($($meaning),+).trim_ascii_start(),
                },)+
            ];

            const _: () = {
                let mut place = 0;
                while place < ALL.len() {
                    assert!(ALL[place].number as usize == place, "a number is missing or out of order");
                    place += 1;
                }
            };
        }
    };
}

/// A table of the variants of an enum that are numbered, with what goes with each number.
///
/// Generates the module of [`number_table`] and a function from a variant to its number and that.
macro_rules! numbered_variants {
    (@out $number:literal) => {
        $number
    };
    (@out $number:literal, $($with:expr),+) => {
        ($number, $($with),+)
    };
    (
        $(#[doc = $doc:literal])+ $module:ident;
        $(#[doc = $function_doc:literal])+ fn $function:ident(&$enum:ident) -> $out:ty;
        $(
            $(#[doc = $meaning:literal])+
            $constant:ident = $number:literal $name:literal: $variant:pat => [$($with:expr),*],
        )+
    ) => {
        number_table! {
            $(#[doc = $doc])+ $module {
                $($(#[doc = $meaning])+ $constant = $number $name,)+
            }
        }

        $(#[doc = $function_doc])+
        fn $function(value: &$enum) -> $out {
            match *value {
                $($variant => numbered_variants!(@out $number $(, $with)*),)+
            }
        }
    };
}

/// A table of the variants of an enum that are sent with what they carry: as the constructor of each, whose fields are
/// sent in the order in which they stand there.
///
/// Generates the module of [`number_table`] and both directions, for fields that are [`Coded`](super::coded::Coded).
macro_rules! carried_variants {
    (
        $(#[doc = $doc:literal])+ $module:ident;
        $enum:ident $(<const $size:ident>)?: fn $encode:ident, fn $decode:ident, $unknown:path;
        $(
            $(#[doc = $meaning:literal])+
            $constant:ident = $number:literal $name:literal:
                $variant:ident $({ $($field:ident),+ })? $(( $item:ident ))?,
        )+
    ) => {
        number_table! {
            $(#[doc = $doc])+ $module {
                $($(#[doc = $meaning])+ $constant = $number $name,)+
            }
        }

        /// Returns the number of the variant, and appends its fields to `to`.
        fn $encode $(<const $size: usize>)? (value: &$enum $(<$size>)?, to: &mut RequestCode) -> u8 {
            match value {
                $($enum::$variant $({ $($field),+ })? $(($item))? => {
                    $($($field.put(to);)+)?
                    $($item.put(to);)?
                    $number
                })+
            }
        }

        /// Returns the variant with this number, and takes its fields from `from`.
        fn $decode $(<const $size: usize>)? (
            number: u8,
            from: &mut CodeReader<'_>,
        ) -> Result<$enum $(<$size>)?, RequestCodeError> {
            Ok(match number {
                $($number => {
                    $($(let $field = Coded::take(from)?;)+)?
                    $(let $item = Coded::take(from)?;)?
                    $enum::$variant $({ $($field),+ })? $(($item))?
                })+
                unknown => return Err($unknown(unknown)),
            })
        }
    };
}

pub(super) use {carried_variants, number_table, numbered_variants};
