//! Tests that timeouts below one microsecond expire.

use core::time::Duration;
use supple_ipc::{ControllerLink, Domain, PlantLink};

#[test]
fn timeouts_below_the_socket_resolution_expire() {
    let folder = tempfile::tempdir().unwrap();
    let domain = Domain::in_folder(&folder.path().join("system"), "short").unwrap();
    let plant = PlantLink::new(&domain).unwrap();
    let controller = ControllerLink::new(&domain).unwrap();
    for nanoseconds in [1, 300, 999] {
        let wait = Duration::from_nanos(nanoseconds);
        assert_eq!(plant.answer(0, wait).unwrap().answer, None);
        assert_eq!(controller.wait(wait).unwrap(), None);
    }
}
