//! The contact latch by itself: direction, threshold, memory. In the control loop: `control/contact.rs`.
#![allow(
    clippy::disallowed_methods,
    reason = "references take their mathematics elsewhere"
)]

use supple_core::config::ContactLatch;
use supple_core::latch::Latch;
use supple_core::math::Vector3;

mod support;
use support::configs::latch;

const PERIOD_S: f64 = 1e-3;

/// A latch whose reference has been moving along x for a second.
fn moving(config: &ContactLatch) -> Latch {
    let mut latch = Latch::default();
    for _ in 0..1000 {
        cycle(&mut latch, config, Vector3::x() * 0.04, 0.0);
    }
    assert!(!latch.in_contact());
    latch
}

/// One cycle with a force of `against_n` opposite to x.
fn cycle(latch: &mut Latch, config: &ContactLatch, velocity: Vector3<f64>, against_n: f64) {
    latch.follow(&velocity, PERIOD_S);
    latch.decide(config, &(-Vector3::x() * against_n), 0.0, PERIOD_S);
}

/// Held against by `newtons` while going on along x: is it contact?
fn closes(config: &ContactLatch, newtons: f64, doubt_n: f64) -> bool {
    let mut latch = moving(config);
    latch.follow(&(Vector3::x() * 0.04), PERIOD_S);
    latch.decide(config, &(-Vector3::x() * newtons), doubt_n, PERIOD_S);
    assert_eq!(latch.force_against_n(), newtons);
    latch.in_contact()
}

#[test]
fn it_closes_above_its_threshold_and_not_at_it() {
    let config = latch();
    assert!(!closes(&config, config.threshold_n, 0.0));
    assert!(closes(&config, config.threshold_n.next_up(), 0.0));
    assert!(!closes(&config, config.threshold_n + 1.0, 1.0));
    assert!(closes(&config, config.threshold_n + 1.01, 1.0));
    assert!(!closes(&config, -100.0, 0.0), "a push along the way");
}

#[test]
fn twice_the_threshold_for_a_while_after_a_start_and_a_reversal() {
    let config = latch();
    let mut latch = Latch::default();
    let mut doubled = [0, 0];
    for (k, direction) in [1.0, -1.0].into_iter().enumerate() {
        for _ in 0..1000 {
            cycle(&mut latch, &config, Vector3::x() * (0.04 * direction), 0.0);
            if latch.threshold_n() == 2.0 * config.threshold_n {
                doubled[k] += 1;
            } else {
                assert_eq!(latch.threshold_n(), config.threshold_n);
            }
        }
    }
    // 0.2 s of a millisecond each, to one.
    for count in doubled {
        assert!((199..=201).contains(&count), "{count} cycles");
    }
}

/// A bend of the way is no reversal, until it has turned by more than a right angle from where contact
/// was made, however gradually.
#[test]
fn contact_is_remembered_by_its_direction() {
    let config = latch();
    let mut latch = moving(&config);
    cycle(&mut latch, &config, Vector3::x() * 0.04, 10.0);
    assert!(latch.in_contact());
    for degrees in 0..180 {
        let angle = (f64::from(degrees) + 0.5) * std::f64::consts::PI / 180.0;
        let direction = Vector3::new(angle.cos(), angle.sin(), 0.0);
        cycle(&mut latch, &config, direction * 0.04, 0.0);
        assert_eq!(latch.in_contact(), degrees < 90, "at {degrees} degrees");
    }
}

/// The same bend without contact: the direction goes along, and nothing is doubled.
#[test]
fn without_contact_the_direction_follows_the_reference() {
    let config = latch();
    let mut latch = moving(&config);
    for degrees in 0..360 {
        let angle = f64::from(degrees) * std::f64::consts::PI / 180.0;
        let direction = Vector3::new(angle.cos(), 0.0, angle.sin());
        cycle(&mut latch, &config, direction * 0.04, 0.0);
        assert!((latch.direction() - direction).norm() < 1e-12);
        assert_eq!(latch.threshold_n(), config.threshold_n);
    }
}

/// A reference that creeps has no direction: it neither releases nor begins anything.
#[test]
fn a_creeping_reference_is_at_rest() {
    let config = latch();
    let mut latch = moving(&config);
    cycle(&mut latch, &config, Vector3::x() * 0.04, 10.0);
    for speed in [0.0, -1e-9, -5e-4] {
        cycle(&mut latch, &config, Vector3::x() * speed, 0.0);
        assert!(latch.in_contact(), "released at {speed} m/s");
    }
    cycle(&mut latch, &config, Vector3::x() * -2e-3, 0.0);
    assert!(!latch.in_contact(), "the retreat releases");
    // Before it has moved there is no way to be in.
    let mut new = Latch::default();
    cycle(&mut new, &config, Vector3::x() * 5e-4, 50.0);
    assert_eq!(new.direction(), Vector3::zeros());
    assert!(!new.in_contact());
}

/// Whatever the fade and the pauses, the share stays a share.
#[test]
fn the_share_stays_between_its_ends() {
    for contact_share in [0.0, 0.4, 1.0] {
        let config = ContactLatch {
            contact_share,
            ..latch()
        };
        let mut latch = moving(&config);
        for k in 0..5000_u32 {
            let direction = if (k / 700) % 2 == 0 { 1.0 } else { -1.0 };
            let against = if k % 350 > 300 { 20.0 * direction } else { 0.0 };
            cycle(
                &mut latch,
                &config,
                Vector3::x() * (0.04 * direction),
                against,
            );
            let share = latch.friction_share();
            assert!((contact_share..=1.0).contains(&share), "{share}");
        }
    }
}

/// A state seen again takes no time: nothing fades.
#[test]
fn no_time_changes_nothing_but_the_verdict() {
    let config = latch();
    let mut latch = moving(&config);
    latch.follow(&(Vector3::x() * 0.04), 0.0);
    latch.decide(&config, &(-Vector3::x() * 10.0), 0.0, 0.0);
    assert!(latch.in_contact());
    assert_eq!(latch.friction_share(), 1.0);
}
