//! Property ids by firmware version.
//!
//! The lists come from libbarrett (2018), where they were generated from the firmware headers; a list is valid
//! from its version up to the next listed version. Read [`Property::VERS`] first: from version 58 on, the
//! motor's ids changed between versions.

use super::ids::{FORCE_TORQUE_COLUMN, IDS, MONITOR_COLUMN, MOTOR_VERSIONS, NO, SAFETY_COLUMN, W};
use super::{Property, PropertyId, Width};
use core::fmt;

/// First version with a separate list for the safety module; older versions use the motor's list.
const SAFETY_VERSION: i32 = 61;

/// Family of property lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PuckKind {
    /// Motor pucks, of the arm or the hand.
    Motor,
    /// Safety module.
    Safety,
    /// Force/torque sensor: a single list, because the sensor reports a wrong version.
    ForceTorque,
}

/// Error: the firmware is older than all lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FirmwareTooOld {
    /// Version found.
    pub version: i32,
}

impl FirmwareTooOld {
    /// Minimum version that has a list.
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

/// Meaning of an id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Slot {
    /// The id belongs to this property.
    Property(Property),
    /// The id is the upper half of the 32-bit property before it.
    PlaceHolder(Property),
    /// The id belongs to no property.
    Unused,
}

/// Ids of the properties in one firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PropertyTable {
    column: u8,
}

impl PropertyTable {
    /// Ids of the monitor, which runs while [`Property::STAT`] is 0, in pucks of every kind. Its ids up to 7 are
    /// valid in every firmware.
    pub const MONITOR: PropertyTable = PropertyTable {
        column: MONITOR_COLUMN,
    };

    /// Ids of the force/torque sensor.
    pub const FORCE_TORQUE: PropertyTable = PropertyTable {
        column: FORCE_TORQUE_COLUMN,
    };

    /// Returns the ids of a puck whose [`Property::VERS`] is `version`. Versions newer than all lists use the newest list.
    ///
    /// # Errors
    /// [`FirmwareTooOld`] for a motor puck or safety module older than version 32.
    pub fn of_firmware(kind: PuckKind, version: i32) -> Result<PropertyTable, FirmwareTooOld> {
        let column = match kind {
            PuckKind::ForceTorque => FORCE_TORQUE_COLUMN,
            PuckKind::Safety if version >= SAFETY_VERSION => SAFETY_COLUMN,
            PuckKind::Safety | PuckKind::Motor => MOTOR_VERSIONS
                .iter()
                .rposition(|&min_version| i32::from(min_version) <= version)
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

    /// Id of a property; `None` if this firmware does not have it.
    pub const fn id(&self, property: Property) -> Option<PropertyId> {
        match self.cell(property) {
            None => None,
            Some(cell) => Some(PropertyId::from_byte(cell)),
        }
    }

    /// Width of a property's value; `None` if this firmware does not have it. 32 bits if documented by Barrett
    /// and the next id is unused, and for [`Property::PEN`]; otherwise 16.
    pub fn width(&self, property: Property) -> Option<Width> {
        let cell = self.cell(property)?;
        Some(if cell & W == 0 {
            Width::Narrow
        } else {
            Width::Wide
        })
    }

    /// Meaning of an id.
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
