//! The pendant word: the value of [`Property::PEN`](crate::Property::PEN).
//!
//! ```text
//! 27..26 button   25 activate light   24 idle light   23..16 seven segments
//! 14..0  five fields of three bits, lowest first: velocity, torque, voltage, heartbeat, other
//! ```
//!
//! Source: libbarrett, Barrett's answer in its issue 47.

use core::fmt;

/// The raw word: a view that names the fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PenWord(pub u32);

const BUTTON_SHIFT: u32 = 26;
const ACTIVATE_LIGHT: u32 = 1 << 25;
const IDLE_LIGHT: u32 = 1 << 24;
const SEGMENTS_SHIFT: u32 = 16;
const FIELD_NAMES: [&str; 5] = ["velocity", "torque", "voltage", "heartbeat", "other"];

impl PenWord {
    /// The bits that have a meaning.
    pub const MASK: u32 = 0x0fff_7fff;

    /// Converts the property's value, whose sign has no meaning.
    pub const fn from_value(value: i32) -> PenWord {
        PenWord(value as u32)
    }

    /// The property's value.
    pub const fn value(self) -> i32 {
        self.0 as i32
    }

    const fn field(self, index: u32) -> u8 {
        (self.0 >> (3 * index)) as u8 & 0b111
    }
}

/// Button that the operator is pressing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Button {
    /// The emergency stop is latched.
    EStop = 0b00,
    /// Activate.
    Activate = 0b01,
    /// Idle.
    Idle = 0b10,
    /// No button.
    None = 0b11,
}

/// Level of a monitored quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Level {
    /// Below its limits.
    Safe = 0b001,
    /// Above the warning limit.
    Warning = 0b010,
    /// Above the fault limit.
    Fault = 0b100,
}

/// The raw bits of the seven-segment digit, `0 MID TL BL BOT BR TR TOP`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SevenSegment(pub u8);

impl SevenSegment {
    const DIGITS: [(u8, char); 12] = [
        (0x3f, '0'),
        (0x06, '1'),
        (0x5b, '2'),
        (0x4f, '3'),
        (0x66, '4'),
        (0x6d, '5'),
        (0x7d, '6'),
        (0x07, '7'),
        (0x77, 'A'),
        (0x79, 'E'),
        (0x76, 'H'),
        (0x38, 'L'),
    ];

    /// Returns the character that the digit shows; `None` if it is not one of `0` to `7`, `A`, `E`, `H`, `L`.
    pub fn character(self) -> Option<char> {
        let digit = SevenSegment::DIGITS
            .iter()
            .find(|(bits, _)| *bits == self.0);
        digit.map(|&(_, character)| character)
    }

    /// Returns the segments of a character; `None` if it is not one of `0` to `7`, `A`, `E`, `H`, `L`.
    pub fn of(character: char) -> Option<SevenSegment> {
        let digit = SevenSegment::DIGITS.iter().find(|(_, c)| *c == character);
        digit.map(|&(bits, _)| SevenSegment(bits))
    }
}

/// State of the pendant: buttons, lights, and the level of each monitored quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pendant {
    /// Button pressed.
    pub button: Button,
    /// Light of the activate button.
    pub activate_light: bool,
    /// Light of the idle button.
    pub idle_light: bool,
    /// Seven-segment digit.
    pub segments: SevenSegment,
    /// Speed of the arm relative to VL1 and VL2.
    pub velocity: Level,
    /// Commanded torques relative to TL1 and TL2.
    pub torque: Level,
    /// Bus voltage relative to its limits.
    pub voltage: Level,
    /// Whether positions arrive in time.
    pub heartbeat: Level,
    /// Indicates an emergency stop.
    pub other: Level,
}

/// Error: a field does not have exactly one bit set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PendantError {
    /// Name of the field.
    pub field: &'static str,
    /// Its three bits.
    pub bits: u8,
}

impl fmt::Display for PendantError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let PendantError { field, bits } = self;
        write!(
            f,
            "pendant's {field} is {bits:03b}, expected 001 (safe), 010 (warning) or 100 (fault)"
        )
    }
}

impl core::error::Error for PendantError {}

impl Pendant {
    /// Parses a word; ignores bits without a meaning.
    ///
    /// # Errors
    /// [`PendantError`] with the first field, starting with velocity, that does not have exactly one bit set.
    pub fn parse(word: PenWord) -> Result<Pendant, PendantError> {
        let level = |index: u32| match word.field(index) {
            0b001 => Ok(Level::Safe),
            0b010 => Ok(Level::Warning),
            0b100 => Ok(Level::Fault),
            bits => Err(PendantError {
                field: FIELD_NAMES[index as usize],
                bits,
            }),
        };
        Ok(Pendant {
            button: match (word.0 >> BUTTON_SHIFT) & 0b11 {
                0b00 => Button::EStop,
                0b01 => Button::Activate,
                0b10 => Button::Idle,
                _ => Button::None,
            },
            activate_light: word.0 & ACTIVATE_LIGHT != 0,
            idle_light: word.0 & IDLE_LIGHT != 0,
            segments: SevenSegment((word.0 >> SEGMENTS_SHIFT) as u8),
            velocity: level(0)?,
            torque: level(1)?,
            voltage: level(2)?,
            heartbeat: level(3)?,
            other: level(4)?,
        })
    }

    /// Encodes the word of the safety module's reply.
    pub fn emit(&self) -> PenWord {
        let levels = self.levels().into_iter().enumerate();
        let fields = levels.map(|(index, (_, level))| (level as u32) << (3 * index));
        let light = |lit, bit| if lit { bit } else { 0 };
        PenWord(
            (self.button as u32) << BUTTON_SHIFT
                | light(self.activate_light, ACTIVATE_LIGHT)
                | light(self.idle_light, IDLE_LIGHT)
                | u32::from(self.segments.0) << SEGMENTS_SHIFT
                | fields.sum::<u32>(),
        )
    }

    /// Level of every monitored quantity, by name.
    pub fn levels(&self) -> [(&'static str, Level); 5] {
        let levels = [
            self.velocity,
            self.torque,
            self.voltage,
            self.heartbeat,
            self.other,
        ];
        core::array::from_fn(|index| (FIELD_NAMES[index], levels[index]))
    }

    /// Most severe level.
    pub fn worst(&self) -> Level {
        let levels = self.levels().into_iter().map(|(_, level)| level);
        levels.fold(Level::Safe, Level::max)
    }
}
