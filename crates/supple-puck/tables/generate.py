#!/usr/bin/env python3
"""Writes src/property/{names,ids}.rs from tests/data/property_ids.csv."""

import csv
import subprocess
from collections import defaultdict
from pathlib import Path

CRATE = Path(__file__).resolve().parent.parent
SOURCE = CRATE / "tests/data/property_ids.csv"
FOLDER = CRATE / "src/property"

ALIASES = {"TORQ": "T", "AP": "P", "B": "FET0", "TENSION": "FET1"}

# 32 bits wide if the next id is unused (upper half); the pendant word always.
WIDE = "P DP E OT CT M MECH CTS IOFF HALLH EN JP JOFST".split()
WIDE_WITHOUT_PLACE_HOLDER = "PEN"

MEANING = {
    "VERS": "Firmware version. Same id in every firmware.",
    "ROLE": "Type and options of the puck, see [`Role`](crate::status::Role). Same id in every firmware.",
    "SN": "Serial number. Same id in every firmware.",
    "ID": "Node id. Same id in every firmware.",
    "ERROR": "Error; its codes are not published. Same id in every firmware.",
    "STAT": "Monitor (boot program) or firmware, see [`Stat`](crate::status::Stat). Same id in every firmware.",
    "ADDR": "`ADDR` in libbarrett's property lists; its meaning is not recorded here. Same id in every firmware.",
    "VALUE": "`VALUE` in libbarrett's property lists; its meaning is not recorded here. Same id in every firmware.",
    "MODE": "[`MotorMode`](crate::status::MotorMode) or [`SafetyMode`](crate::safety::SafetyMode).",
    "TEMP": "Temperature \\\\[degrees Celsius\\\\].",
    "PTEMP": "Peak temperature \\\\[degrees Celsius\\\\].",
    "OTEMP": "Temperature limit \\\\[degrees Celsius\\\\], 60 by default.",
    "LOCK": "Command: accepts the sequence that unlocks a change of node id or role.",
    "FET1": "`FET1` or `TENSION` in libbarrett's property lists; its meaning is not recorded here.",
    "FET0": "`FET0` or `B` in libbarrett's property lists; its meaning is not recorded here.",
    "THERM": "Temperature of the thermistor \\[degrees Celsius\\].",
    "VBUS": "Bus voltage; 48 V nominal.",
    "GRPA": "First group of the puck.",
    "GRPB": "Second group of the puck.",
    "GRPC": "Third group of the puck.",
    "CMD": "Command: 13 initialises the hand, 18 closes it, 19 moves it, 20 opens it.",
    "SAVE": "Command: saves the property of the given id to the EEPROM, or all for -1.",
    "LOAD": "Command: loads the property of the given id from the EEPROM.",
    "DEF": "Command: restores the factory default of the property of the given id.",
    "T": "Torque command \\\\[puck units\\\\], usually packed, see [`PackedTorques`](crate::torque::PackedTorques); `TORQ` is another name.",
    "MT": "Maximum torque that the puck applies \\\\[puck units\\\\].",
    "P": "Position \\\\[counts\\\\]; its reply is packed, see [`PositionReply`](crate::position::PositionReply); `AP` is another name.",
    "MECH": "Absolute magnetic angle \\\\[counts\\\\]; firmware 118 and later, with the magnetic encoder of [`Role`](crate::status::Role).",
    "CTS": "Encoder counts per revolution: 4096 magnetic, 40960 optical.",
    "PIDX": "The puck's slot in the packed torque frame, 1 to 4.",
    "JIDX": "Number of the joint.",
    "IPNM": "Puck torque units per N m, see [`TorqueScale`](crate::torque::TorqueScale).",
    "POLES": "Number of poles of the motor: 12, 8 or 6.",
    "ACCEL": "Acceleration of the trapezoidal mode; 100 by default.",
    "KP": "Proportional gain of the PID mode; 2000 by default.",
    "KI": "Integral gain of the PID mode; 0 by default.",
    "KD": "Derivative gain of the PID mode; 8000 by default.",
    "JP": "`JP` in libbarrett's property lists \\[counts\\].",
    "JOFST": "`JOFST` in libbarrett's property lists \\[counts\\].",
    "ECMAX": "This or `ECMIN` is not 0 after the joint encoder has passed its index.",
    "ECMIN": "See `ECMAX`.",
    "LFLAGS": "Loop flags; their bits are not published.",
    "TACT": "Kind of tactile report: 0 none, 1 top ten, 2 full, 3 tare.",
    "ZERO": "1 after the host has notified the safety module that the encoder positions are set.",
    "PEN": "State of the pendant, see [`PenWord`](crate::safety::PenWord).",
    "SAFE": "Service command of the safety module; 0, 4 and 5 are known, for the voltage calibration.",
    "VL1": "Speed warning, see [`SpeedLimit`](crate::safety::SpeedLimit).",
    "VL2": "Speed fault, see [`SpeedLimit`](crate::safety::SpeedLimit).",
    "TL1": "Torque warning \\\\[puck units\\\\].",
    "TL2": "Torque fault \\\\[puck units\\\\].",
    "VOLTL1": "Low voltage warning \\\\[V\\\\], 36 by default.",
    "VOLTL2": "Low voltage fault \\\\[V\\\\], 30 by default.",
    "VOLTH1": "High voltage warning \\\\[V\\\\], 54 by default.",
    "VOLTH2": "High voltage fault \\\\[V\\\\], 57 by default.",
    "IFAULT": "Number of speed faults that the safety module still ignores; it counts down.",
    "FT": "Force and torque, see [`force_torque`](crate::force_torque); setting it to 0 tares.",
    "A": "Acceleration, see [`force_torque`](crate::force_torque).",
}
UNKNOWN = "`{}` in libbarrett's property lists; its meaning is not recorded here."


def read_tables():
    tables = defaultdict(dict)
    with SOURCE.open(newline="") as file:
        for row in csv.DictReader(file):
            names = tables[row["puck_type"], int(row["min_firmware"])]
            assert names.setdefault(row["property"], int(row["id"])) == int(row["id"]), row
    for names in tables.values():
        for alias, name in ALIASES.items():
            if alias in names:
                assert names.pop(alias) == names[name], alias
    return tables


def columns_of(tables):
    """The distinct lists: the motor's, then those of the other kinds that are not one of them."""
    motor = sorted(version for kind, version in tables if kind == "Motor")
    for kind, version in tables:
        if kind == "Safety" and version < 61:
            assert tables[kind, version] == tables["Motor", version]
    others = [("Safety", 61), ("ForceTorque", 0), ("Monitor", 0)]
    return motor, [("Motor", version) for version in motor] + others


def cell(names, name):
    if name not in names:
        return "NO"
    number = names[name]
    assert number < 127
    wide = name == WIDE_WITHOUT_PLACE_HOLDER or (
        name in WIDE and number + 1 not in names.values()
    )
    return f"W+{number}" if wide else str(number)


def main():
    tables = read_tables()
    motor, columns = columns_of(tables)
    newest = [tables[column] for column in (columns[motor.index(motor[-1])], *columns[len(motor):])]

    def rank(name):
        for index, names in enumerate(newest):
            if name in names:
                return (index, names[name], name)
        return (len(newest), 0, name)

    names = sorted({name for table in tables.values() for name in table}, key=rank)
    generated = "// Generated by tables/generate.py from tests/data/property_ids.csv: change those, not this."
    lines = [
        "//! Names of the pucks' properties, each with what it is.",
        generated,
        "",
        "use super::Property;",
        "",
        "impl Property {",
    ]
    for index, name in enumerate(names):
        meaning = MEANING.get(name, UNKNOWN.format(name)).replace("\\\\", "\\")
        lines.append(f"    /// {meaning}")
        lines.append(f"    pub const {name}: Property = Property({index});")
    write("names.rs", lines + ["}"])

    lines = [
        "//! Ids of the properties in each version of the firmware, a column per list and a row per property.",
        generated,
        "",
        "use super::Property;",
        "",
        "/// Marks an id whose property is 32 bits wide.",
        "pub(super) const W: u8 = 0x80;",
        "/// Not in this list.",
        "pub(super) const NO: u8 = 0x7f;",
        "",
        "/// Minimum motor firmware of each of the first columns.",
        f"pub(super) const MOTOR_VERSIONS: [u16; {len(motor)}] = [{', '.join(map(str, motor))}];",
    ]
    for index, (kind, version) in enumerate(columns[len(motor):], start=len(motor)):
        lines.append(f"/// Column of {kind}{f', firmware {version} and later' if version else ''}.")
        constant = {"Safety": "SAFETY", "ForceTorque": "FORCE_TORQUE", "Monitor": "MONITOR"}[kind]
        lines.append(f"pub(super) const {constant}_COLUMN: u8 = {index};")
    lines += ["", f"pub(super) const ALIASES: [(&str, Property); {len(ALIASES)}] = ["]
    lines += [f'    ("{alias}", Property::{name}),' for alias, name in ALIASES.items()]
    lines += ["];", "", f"pub(super) const NAMES: [&str; {len(names)}] = ["]
    lines += [", ".join(f'"{name}"' for name in names)]
    lines += ["];", "", "/// Row per property, column per list.", "#[rustfmt::skip]"]
    lines.append(f"pub(super) const IDS: [[u8; {len(columns)}]; {len(names)}] = [")
    for name in names:
        cells = ", ".join(f"{cell(tables[column], name):>5}" for column in columns)
        lines.append(f"    [{cells}], // {name}")
    write("ids.rs", lines + ["];"])


def write(name, lines):
    path = FOLDER / name
    path.write_text("\n".join(lines) + "\n")
    subprocess.run(["rustfmt", "--edition", "2024", str(path)], check=True)


if __name__ == "__main__":
    main()
