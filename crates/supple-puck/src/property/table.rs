//! Which id a property has in which firmware.
//!
//! The lists are those of libbarrett (2018), made there from the headers of the firmware; a list holds
//! from its version up to the next. Read [`Property::VERS`] first: from 58 upwards the motor's ids
//! moved between versions.

use super::ids::{FORCE_TORQUE_COLUMN, IDS, MONITOR_COLUMN, MOTOR_VERSIONS, NO, SAFETY_COLUMN, W};
use super::{Property, PropertyId, Width};
use core::fmt;

/// From this version the safety module has a list of its own; before, it is the motor's.
const SAFETY_VERSION: i32 = 61;

/// Which family of lists a puck has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PuckKind {
    /// Motor pucks, of the arm or the hand.
    Motor,
    /// Safety module.
    Safety,
    /// Force/torque sensor: one list, whatever its version, which it is known to report wrongly.
    ForceTorque,
}

/// A firmware older than every list.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FirmwareTooOld {
    /// Version found.
    pub version: i32,
}

impl FirmwareTooOld {
    /// Least version that has a list.
    pub const OLDEST: u16 = MOTOR_VERSIONS[0];
}

impl fmt::Display for FirmwareTooOld {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "firmware version is {}, property ids are known from version {}",
            self.version,
            FirmwareTooOld::OLDEST
        )
    }
}

impl core::error::Error for FirmwareTooOld {}

/// What an id stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// A property.
    Property(Property),
    /// The upper half of the 32-bit property before it.
    PlaceHolder(Property),
    /// Nothing.
    Unused,
}

/// Ids of the properties in one firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PropertyTable {
    column: u8,
}

impl PropertyTable {
    /// Of the monitor, which runs while [`Property::STAT`] is 0, in pucks of every kind. What it lists
    /// up to id 7 is valid in every firmware.
    pub const MONITOR: PropertyTable = PropertyTable {
        column: MONITOR_COLUMN,
    };

    /// Of the force/torque sensor.
    pub const FORCE_TORQUE: PropertyTable = PropertyTable {
        column: FORCE_TORQUE_COLUMN,
    };

    /// Of a puck whose [`Property::VERS`] is `version`. A version newer than the newest list has that
    /// list.
    ///
    /// # Errors
    /// A motor puck or safety module older than version 32.
    pub fn of_firmware(kind: PuckKind, version: i32) -> Result<PropertyTable, FirmwareTooOld> {
        let column = match kind {
            PuckKind::ForceTorque => FORCE_TORQUE_COLUMN,
            PuckKind::Safety if version >= SAFETY_VERSION => SAFETY_COLUMN,
            PuckKind::Safety | PuckKind::Motor => MOTOR_VERSIONS
                .iter()
                .rposition(|&least| i32::from(least) <= version)
                .ok_or(FirmwareTooOld { version })?
                as u8,
        };
        Ok(PropertyTable { column })
    }

    const fn cell(&self, property: Property) -> Option<u8> {
        match IDS[property.0 as usize][self.column as usize] {
            NO => None,
            cell => Some(cell),
        }
    }

    /// Id of a property, `None` where this firmware does not have it.
    pub const fn id(&self, property: Property) -> Option<PropertyId> {
        match self.cell(property) {
            None => None,
            Some(cell) => Some(PropertyId::from_byte(cell)),
        }
    }

    /// Width of a property's value, `None` where this firmware does not have it. 32 bits where Barrett
    /// documents them and the next id is left free, and for [`Property::PEN`]; else 16.
    pub fn width(&self, property: Property) -> Option<Width> {
        let cell = self.cell(property)?;
        Some(if cell & W == 0 {
            Width::Narrow
        } else {
            Width::Wide
        })
    }

    /// What an id stands for.
    pub fn slot(&self, id: PropertyId) -> Slot {
        let holder = |number| {
            Property::all().find(|&property| self.id(property).map(PropertyId::number) == number)
        };
        if let Some(property) = holder(Some(id.number())) {
            return Slot::Property(property);
        }
        let before = id.number().checked_sub(1);
        match before.and_then(|number| holder(Some(number))) {
            Some(property) if self.width(property) == Some(Width::Wide) => {
                Slot::PlaceHolder(property)
            }
            _ => Slot::Unused,
        }
    }
}
