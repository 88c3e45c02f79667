//! Compares the property tables with the lists from which they were generated, including the gaps.

use std::collections::{BTreeMap, BTreeSet};
use supple_puck::property::Slot;
use supple_puck::{Property, PropertyId, PropertyTable, PuckKind, Width};

type Lists = BTreeMap<(String, i32), BTreeMap<String, u8>>;

fn lists() -> Lists {
    let mut lists = Lists::new();
    let mut rows = include_str!("../data/property_ids.csv").lines();
    assert_eq!(rows.next(), Some("puck_type,min_firmware,property,id"));
    for row in rows {
        let [kind, version, property, id] = row.split(',').collect::<Vec<_>>()[..] else {
            panic!("{row}");
        };
        let list = lists.entry((kind.to_owned(), version.parse().unwrap()));
        let before = list
            .or_default()
            .insert(property.to_owned(), id.parse().unwrap());
        assert_eq!(before, None, "{row}");
    }
    assert_eq!(lists.values().map(BTreeMap::len).sum::<usize>(), 3173);
    lists
}

fn table(kind: &str, version: i32) -> PropertyTable {
    let kind = match kind {
        "Motor" => PuckKind::Motor,
        "Safety" => PuckKind::Safety,
        "ForceTorque" => PuckKind::ForceTorque,
        "Monitor" => return PropertyTable::MONITOR,
        other => panic!("{other}"),
    };
    PropertyTable::of_firmware(kind, version).unwrap()
}

fn assert_same(table: PropertyTable, list: &BTreeMap<String, u8>, context: &str) {
    for (name, &id) in list {
        let property = Property::from_name(name).unwrap_or_else(|| panic!("{name}"));
        let found = table.id(property).map(PropertyId::number);
        assert_eq!(found, Some(id), "{context} {name}");
    }
    let in_list: BTreeSet<_> = list.keys().map(|n| Property::from_name(n)).collect();
    for property in Property::all().filter(|p| !in_list.contains(&Some(*p))) {
        assert_eq!(table.id(property), None, "{context} {property}");
        assert_eq!(table.width(property), None, "{context} {property}");
    }
}

/// Tests each list at the first and the last version for which it is valid.
#[test]
fn every_list_matches_the_published_one() {
    let lists = lists();
    for ((kind, version), list) in &lists {
        let of_kind = |other: &&(String, i32)| other.0 == *kind && other.1 > *version;
        let next = lists.keys().filter(of_kind).map(|(_, v)| *v).min();
        for version in [*version, next.unwrap_or(i32::MAX) - 1] {
            assert_same(table(kind, version), list, &format!("{kind} {version}"));
        }
    }
}

#[test]
fn the_first_ids_of_the_monitor_are_valid_in_every_firmware() {
    let names = "VERS ROLE SN ID ERROR STAT ADDR VALUE";
    for ((kind, version), _) in lists() {
        for (number, name) in names.split(' ').enumerate() {
            let property = Property::from_name(name).unwrap();
            let found = table(&kind, version).id(property);
            assert_eq!(found.map(PropertyId::number), Some(number as u8));
        }
    }
}

#[test]
fn property_to_id_and_back_is_the_identity() {
    for ((kind, version), _) in lists() {
        let table = table(&kind, version);
        for property in Property::all() {
            let Some(id) = table.id(property) else {
                continue;
            };
            assert_eq!(table.slot(id), Slot::Property(property));
            if table.width(property) == Some(Width::Wide) && property != Property::PEN {
                let next = PropertyId::new(id.number() + 1).unwrap();
                assert_eq!(table.slot(next), Slot::PlaceHolder(property));
            }
        }
    }
    let newest = table("Motor", 175);
    assert_eq!(newest.slot(PropertyId::new(127).unwrap()), Slot::Unused);
    assert_eq!(
        table("Safety", 61).slot(PropertyId::new(44).unwrap()),
        Slot::Property(Property::SAFE)
    );
}

/// Compares the widths in the newest firmware with the documentation.
#[test]
fn thirty_two_bit_properties_match_the_documentation() {
    let wide_in = |kind, version| -> BTreeSet<&str> {
        let table = table(kind, version);
        Property::all()
            .filter(|p| table.width(*p) == Some(Width::Wide))
            .map(Property::name)
            .collect()
    };
    let documented = "P DP E OT CT M MECH CTS IOFF HALLH EN JP JOFST";
    assert_eq!(wide_in("Motor", 175), documented.split(' ').collect());
    assert_eq!(wide_in("Safety", 61), BTreeSet::from(["PEN"]));
    // In this version IOFF and EN have no placeholder after them, and JP and JOFST do not exist yet.
    let older = "P DP E OT CT M MECH CTS HALLH";
    assert_eq!(wide_in("Motor", 61), older.split(' ').collect());
}

#[test]
fn names_are_unique_and_identify_their_properties() {
    for property in Property::all() {
        assert_eq!(Property::from_name(property.name()), Some(property));
    }
    for (alias, property) in [
        ("AP", Property::P),
        ("TORQ", Property::T),
        ("B", Property::FET0),
        ("TENSION", Property::FET1),
    ] {
        assert_eq!(Property::from_name(alias), Some(property));
    }
    assert_eq!(Property::from_name("LFAULT"), None);
}

#[test]
fn firmware_older_than_the_lists_is_rejected() {
    for kind in [PuckKind::Motor, PuckKind::Safety] {
        let error = PropertyTable::of_firmware(kind, 31).unwrap_err();
        assert_eq!(
            error.to_string(),
            "firmware version is 31, property ids are known from version 32"
        );
    }
    let sensor = PropertyTable::of_firmware(PuckKind::ForceTorque, -1);
    assert_eq!(sensor, Ok(PropertyTable::FORCE_TORQUE));
}
