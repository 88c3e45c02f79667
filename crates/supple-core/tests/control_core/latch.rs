//! Unit tests of the contact latch: direction, threshold, memory. Tests in the control loop:
//! `control/contact.rs`.

use supple_core::config::ContactLatch;
use supple_core::latch::{Latch, LatchInput};
use supple_core::math::Vector3;

use crate::support::configs::latch;

const PERIOD_S: f64 = 1e-3;

/// A latch after one second of reference motion along x.
fn moving(config: &ContactLatch) -> Latch {
    let mut latch = Latch::new(config, 200.0);
    for _ in 0..1000 {
        cycle(&mut latch, config, Vector3::x() * 0.04, 0.0);
    }
    assert!(!latch.in_contact());
    latch
}

/// A force opposite to x on a tip at rest.
fn against(newtons: f64, friction_uncertainty_n: f64) -> LatchInput {
    LatchInput {
        force_n: -Vector3::x() * newtons,
        friction_uncertainty_n,
        tip_velocity_m_per_s: Vector3::zeros(),
    }
}

/// One cycle with a force of `against_n` opposite to x.
fn cycle(latch: &mut Latch, config: &ContactLatch, velocity: Vector3<f64>, against_n: f64) {
    latch.update_direction(&velocity, PERIOD_S);
    latch.update_contact(config, &against(against_n, 0.0), PERIOD_S);
}

/// Returns whether `newtons` against a continued motion along x latch contact.
fn closes(config: &ContactLatch, newtons: f64, friction_uncertainty_n: f64) -> bool {
    let mut latch = moving(config);
    latch.update_direction(&(Vector3::x() * 0.04), PERIOD_S);
    latch.update_contact(config, &against(newtons, friction_uncertainty_n), PERIOD_S);
    assert_eq!(latch.force_against_n(), newtons);
    latch.in_contact()
}

#[test]
fn the_latch_closes_above_its_threshold_and_not_at_it() {
    let config = latch();
    assert!(!closes(&config, config.threshold_n, 0.0));
    assert!(closes(&config, config.threshold_n.next_up(), 0.0));
    assert!(!closes(&config, config.threshold_n + 1.0, 1.0));
    assert!(closes(&config, config.threshold_n + 1.01, 1.0));
    assert!(!closes(&config, -100.0, 0.0), "a push along the way");
}

#[test]
fn the_threshold_is_doubled_after_a_start_and_a_reversal() {
    let config = latch();
    let mut latch = Latch::new(&config, 200.0);
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
    // 0.2 s in cycles of 1 ms, to within one cycle.
    for count in doubled {
        assert!((199..=201).contains(&count), "{count} cycles");
    }
}

/// A curved path is no reversal until its direction differs by more than a right angle from that at
/// contact, however gradually.
#[test]
fn the_latch_stores_the_direction_of_the_contact() {
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

/// The same curve without contact: the direction follows, and the threshold is not doubled.
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

/// A reference slower than the minimum speed has no direction: it neither releases contact nor
/// starts a new direction.
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
    // Before the reference has moved there is no direction.
    let mut new = Latch::new(&config, 200.0);
    cycle(&mut new, &config, Vector3::x() * 5e-4, 50.0);
    assert_eq!(new.direction(), Vector3::zeros());
    assert!(!new.in_contact());
}

/// The fraction stays between its bounds for any fade time and any pauses.
#[test]
fn the_friction_fraction_stays_within_its_bounds() {
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

/// A repeated state takes no time: nothing fades.
#[test]
fn zero_elapsed_time_updates_contact_without_fading() {
    let config = latch();
    let mut latch = moving(&config);
    latch.update_direction(&(Vector3::x() * 0.04), 0.0);
    latch.update_contact(&config, &against(10.0, 0.0), 0.0);
    assert!(latch.in_contact());
    assert_eq!(latch.friction_share(), 1.0);
}

/// Contact on a tip that moves with the reference.
fn following(newtons: f64) -> LatchInput {
    LatchInput {
        tip_velocity_m_per_s: Vector3::x() * 0.04,
        ..against(newtons, 0.0)
    }
}

fn releasing() -> ContactLatch {
    ContactLatch {
        release_s: 0.2,
        ..latch()
    }
}

/// Cycles until the latch is open, at most a second.
fn open_after(latch: &mut Latch, config: &ContactLatch, input: &LatchInput) -> u32 {
    for cycle in 1..=1000 {
        latch.update_direction(&(Vector3::x() * 0.04), PERIOD_S);
        latch.update_contact(config, input, PERIOD_S);
        if !latch.in_contact() {
            return cycle;
        }
    }
    u32::MAX
}

fn cycle_of(latch: &mut Latch, config: &ContactLatch, input: &LatchInput) {
    latch.update_direction(&(Vector3::x() * 0.04), PERIOD_S);
    latch.update_contact(config, input, PERIOD_S);
}

fn close(latch: &mut Latch, config: &ContactLatch, input: &LatchInput) {
    cycle_of(latch, config, input);
    assert!(latch.in_contact());
}

/// If the tip continues to move with the reference, there is no obstacle: the latch opens before friction could stop the tip.
#[test]
fn a_latch_opens_while_the_tip_follows_the_reference() {
    let config = releasing();
    let mut latch = moving(&config);
    close(&mut latch, &config, &following(10.0));
    let cycles = open_after(&mut latch, &config, &following(0.0));
    assert!((10..=11).contains(&cycles), "{cycles} ms");
    // While the force is above the threshold, the tip pushes an object along.
    close(&mut latch, &config, &following(10.0));
    assert_eq!(open_after(&mut latch, &config, &following(10.0)), u32::MAX);
}

/// The motion of the tip does not confirm the contact, and the arm stands still without its feed-forward: the latch
/// opens, and the next force above the threshold confirms it.
#[test]
fn an_unconfirmed_contact_needs_a_second_force_peak() {
    let config = releasing();
    let mut latch = moving(&config);
    close(&mut latch, &config, &following(10.0));
    // Friction stops the tip a little later, without its feed-forward.
    (0..6).for_each(|_| cycle_of(&mut latch, &config, &following(0.0)));
    let cycles = open_after(&mut latch, &config, &against(0.5, 0.0));
    assert!((193..=195).contains(&cycles), "{cycles} ms");
    close(&mut latch, &config, &following(10.0));
    let confirmed = open_after(&mut latch, &config, &against(0.5, 0.0));
    assert_eq!(confirmed, u32::MAX);
}

#[test]
fn contact_that_stops_the_tip_stays_closed() {
    let config = releasing();
    let mut latch = moving(&config);
    close(&mut latch, &config, &against(10.0, 0.0));
    let cycles = open_after(&mut latch, &config, &against(0.5, 0.0));
    assert_eq!(cycles, u32::MAX);
}

/// The force of an obstacle is no residual of free motion: a tip that pressed below the threshold would raise it for ever.
#[test]
fn a_blocked_tip_does_not_raise_the_threshold() {
    let config = ContactLatch {
        false_alarms_per_hour: 1.0,
        ..latch()
    };
    let mut latch = moving(&config);
    (0..5000).for_each(|k| cycle_of(&mut latch, &config, &following(f64::from(k % 2))));
    cycle_of(&mut latch, &config, &against(0.0, 0.0));
    let free_n = latch.threshold_n();
    assert!(free_n > 1.1 * config.threshold_n, "{free_n} N");
    for k in 0..3000 {
        let pressed_n = 0.99 * free_n * f64::from(k) / 3000.0;
        cycle_of(&mut latch, &config, &against(pressed_n, 0.0));
        assert!(!latch.in_contact());
        assert_eq!(latch.threshold_n(), free_n);
    }
    close(&mut latch, &config, &against(1.01 * free_n, 0.0));
}
