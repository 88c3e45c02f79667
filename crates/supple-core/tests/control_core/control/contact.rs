//! The contact latch in the loop: when it closes, what it fades, when it opens.

use crate::support::configs::{friction, three, unlimited};
use crate::support::plant::{Plant, nothing, push};
use crate::support::random::{Draws, Random};
use crate::support::rig::Rig;
use supple_core::config::{ContactLatch, Gains};
use supple_core::controller::Request;
use supple_core::inverse_kinematics::inverse_kinematics;
use supple_core::math::Vector3;
use supple_core::trajectory::{Line, Sinusoid};
use supple_core::{Arm, Config, Friction, Input, Output, Trajectory, Vector};

const CENTRE: Vector3<f64> = Vector3::new(0.6, 0.0, 0.0);

fn config(change: impl FnOnce(&mut ContactLatch)) -> Config<3> {
    let mut config = three();
    unlimited(&mut config);
    config.law.gains = Gains::isotropic(100.0, 20.0);
    config.limits.joint_speed_rad_per_s.fill(20.0);
    config.limits.tip_speed_m_per_s = 20.0;
    change(&mut config.latch);
    config
}

/// The arm at the centre, tracking a line downwards at 0.05 m/s on average.
struct Bench {
    rig: Rig<3>,
    plant: Plant<3>,
}

fn line(from_m: Vector3<f64>, way_m: Vector3<f64>) -> Request<3> {
    Request::Track(Trajectory::Line(Line {
        from_m,
        to_m: from_m + way_m,
        duration_s: 2.0,
    }))
}

const DOWN: Vector3<f64> = Vector3::new(0.0, 0.0, -0.1);

impl Bench {
    fn new(config: Config<3>) -> Bench {
        let seed = Vector::<3>::new(0.0, 0.4, 1.4);
        let place = inverse_kinematics(&config.arm, &config.roles, &config.limits, &seed, &CENTRE);
        let plant = Plant::at_rest(config.arm, place.position_rad);
        let mut rig = Rig::holding(config, place.position_rad);
        let mut bench = Bench {
            plant,
            rig: rig.clone(),
        };
        let first = rig.drive(&mut bench.plant, Some(line(CENTRE, DOWN)), nothing);
        assert_eq!((first.refusal, first.fault), (None, None));
        bench.rig = rig;
        bench
    }

    /// One cycle with `force` on the tip. The arm has the friction that the controller expects at
    /// the reference's velocity, so that only the force is observed.
    fn cycle(&mut self, request: Option<Request<3>>, force: Vector3<f64>) -> Output<3> {
        let output = self
            .rig
            .drive(&mut self.plant, request, |arm, q, _| push(arm, q, &force));
        assert_eq!((output.refusal, output.fault), (None, None));
        output
    }

    fn cycles(&mut self, count: usize, force: Vector3<f64>) -> Vec<Output<3>> {
        (0..count).map(|_| self.cycle(None, force)).collect()
    }
}

fn up(newtons: f64) -> Vector3<f64> {
    Vector3::new(0.0, 0.0, newtons)
}

/// Contact is latched exactly from the cycle in which the force exceeds the reported threshold.
#[test]
fn the_latch_closes_when_the_force_exceeds_the_threshold() {
    let mut bench = Bench::new(config(|_| {}));
    bench.cycles(600, up(0.0));
    let mut closed = 0;
    for k in 0..800 {
        let output = bench.cycle(None, up(0.01 * f64::from(k)));
        assert!(
            (output.contact_threshold_n - 3.0).abs() < 1e-12,
            "no friction, no uncertainty"
        );
        if closed == 0 {
            let passed = output.force_against_n > output.contact_threshold_n;
            assert_eq!(output.in_contact, passed, "at {} N", output.force_against_n);
        }
        closed += u32::from(output.in_contact);
    }
    assert!(closed > 300, "it never closed");
}

#[test]
fn assisting_and_lateral_forces_do_not_latch() {
    for force in [
        up(-20.0),
        Vector3::new(8.0, 0.0, 0.0),
        Vector3::new(0.0, 8.0, 0.0),
    ] {
        let mut bench = Bench::new(config(|_| {}));
        bench.cycles(300, up(0.0));
        for output in bench.cycles(500, force) {
            assert!(!output.in_contact, "{} N against", output.force_against_n);
        }
    }
}

/// After a start or a reversal the observer has not settled: the threshold is doubled for the
/// configured time.
#[test]
fn the_threshold_is_doubled_after_a_start_and_a_reversal() {
    let mut bench = Bench::new(config(|_| {}));
    let thresholds = |outputs: &[Output<3>]| -> Vec<f64> {
        outputs
            .iter()
            .map(|output| output.contact_threshold_n)
            .collect()
    };
    let mut seen = thresholds(&bench.cycles(1000, up(0.0)));
    let from = bench.rig.tip();
    bench.cycle(Some(line(from, -DOWN)), up(0.0));
    seen.extend(thresholds(&bench.cycles(1000, up(0.0))));
    let doubled = seen.iter().filter(|threshold| **threshold == 6.0).count();
    let single = seen.iter().filter(|threshold| **threshold == 3.0).count();
    assert_eq!(doubled + single, seen.len());
    // 0.2 s from the start of the reference's motion, which is a little after each request.
    assert!((400..600).contains(&doubled), "{doubled} ms doubled");
    assert_eq!(seen[999], 3.0);
    assert_eq!(seen[1100], 6.0);
    assert_eq!(seen[1999], 3.0);
}

/// Contact with the arm, then a reversal of the reference.
fn touch_and_retreat(latch: impl FnOnce(&mut ContactLatch)) -> (Vec<Output<3>>, Vec<Output<3>>) {
    let mut config = config(latch);
    config.friction = friction().map(|friction: Friction| Friction {
        offset_nm: 0.0,
        ..friction
    });
    let mut bench = Bench::new(config);
    bench.cycles(700, up(0.0));
    let touching = bench.cycles(600, up(12.0));
    let from = touching[599].tip_position_m;
    let mut leaving = vec![bench.cycle(Some(line(from, -DOWN)), up(0.0))];
    leaving.extend(bench.cycles(600, up(0.0)));
    (touching, leaving)
}

fn first_contact(outputs: &[Output<3>]) -> usize {
    outputs
        .iter()
        .position(|output| output.in_contact)
        .expect("contact is noticed")
}

#[test]
fn friction_fades_in_10_ms_and_is_restored_after_the_retreat() {
    let (touching, leaving) = touch_and_retreat(|_| {});
    let at = first_contact(&touching);
    assert!(at < 60, "noticed after {at} ms");
    for (k, output) in touching[at..].iter().enumerate() {
        let expected = (1.0 - f64::from(k as u32 + 1) * 0.1).max(0.0);
        assert!(
            (output.friction_share - expected).abs() < 1e-9,
            "{k} ms after contact"
        );
        assert!(
            output.in_contact,
            "contact stays latched while the reference continues"
        );
    }
    assert!(touching[at + 9].friction_share < 1e-12, "gone in 10 ms");
    // The reference reverses: contact is released, and the latch stays open on the way back.
    let share = |k: usize| leaving[k].friction_share;
    assert!(leaving.iter().all(|output| !output.in_contact));
    assert!((share(600) - 1.0).abs() < 1e-12 && share(0) <= share(30) && share(30) <= share(60));
}

/// A configured fraction stays on in contact: the fade has the same rate, but stops there.
#[test]
fn the_configured_friction_fraction_stays_in_contact() {
    let (touching, leaving) = touch_and_retreat(|latch| latch.contact_share = 0.35);
    let at = first_contact(&touching);
    for (k, output) in touching[at..].iter().enumerate() {
        let expected = (1.0 - f64::from(k as u32 + 1) * 0.1).max(0.35);
        assert!(
            (output.friction_share - expected).abs() < 1e-9,
            "{k} ms after contact"
        );
    }
    assert!((leaving[600].friction_share - 1.0).abs() < 1e-12);
}

/// The feed-forward is restored over the configured time.
#[test]
fn the_friction_fraction_is_restored_within_its_time() {
    let mut bench = Bench::new(config(|latch| latch.restore_s = 0.1));
    bench.cycles(700, up(0.0));
    let touched = bench.cycles(300, up(12.0));
    assert!(touched[299].in_contact && touched[299].friction_share == 0.0);
    // A new trajectory resets the latch, so the reversal must be in the same trajectory.
    let mut probing = Bench::new(config(|latch| latch.restore_s = 0.1));
    let probe = crate::support::rig::probe_at(&probing.rig.tip());
    probing.cycle(Some(Request::Track(probe)), up(0.0));
    let mut outputs = probing.cycles(1000, up(0.0));
    outputs.extend(probing.cycles(1000, up(12.0)));
    assert!(outputs[1999].in_contact && outputs[1999].friction_share == 0.0);
    let after = probing.cycles(1500, up(0.0));
    let released = after
        .iter()
        .position(|output| !output.in_contact)
        .expect("the retreat releases");
    let velocity = after[released].reference.expect("a reference").velocity;
    assert!(velocity.z > 0.0, "released by the retreat, not before it");
    for (k, output) in after[released..].iter().take(150).enumerate() {
        let expected = (f64::from(k as u32 + 1) * 0.01).min(1.0);
        assert!(
            (output.friction_share - expected).abs() < 1e-9,
            "{k} ms after"
        );
    }
}

/// The force ends but the reference does not reverse: contact stays latched.
#[test]
fn contact_stays_latched_until_the_reference_retreats() {
    let mut bench = Bench::new(config(|_| {}));
    bench.cycles(700, up(0.0));
    assert!(bench.cycles(200, up(12.0))[199].in_contact);
    for output in bench.cycles(800, up(0.0)) {
        assert!(output.in_contact && output.friction_share == 0.0);
    }
    // The line has ended: a reference at rest does not retreat.
    for output in bench.cycles(500, up(0.0)) {
        assert!(output.in_contact);
    }
}

#[test]
fn without_the_fade_the_latch_only_reports() {
    let (touching, leaving) = touch_and_retreat(|latch| latch.fade = false);
    first_contact(&touching);
    for output in touching.iter().chain(&leaving) {
        assert_eq!(output.friction_share, 1.0);
    }
    assert!(touching[599].in_contact && !leaving[600].in_contact);
}

/// A faded friction feed-forward reduces the contact force, which is the purpose of the latch.
#[test]
fn contact_removes_the_dry_friction_torque() {
    let (fading, _) = touch_and_retreat(|_| {});
    let (pushing, _) = touch_and_retreat(|latch| latch.fade = false);
    let at = first_contact(&fading) + 30;
    let norm = |outputs: &[Output<3>]| outputs[at].torques.friction.norm();
    assert!(
        norm(&pushing) > 0.5,
        "{} N m are fed forward",
        norm(&pushing)
    );
    assert!(norm(&fading) < 0.5 * norm(&pushing));
}

/// Where presliding is known, the dry friction of a blocked arm has the direction of the measured motion: all of it stays on, a rebound
/// reverses it as it reverses the real friction (Dahl 1968), and the motion of the reference does not change it.
#[test]
fn in_contact_known_presliding_follows_the_measured_motion() {
    const PRESLIDING_RAD: f64 = 1e-3;
    let mut config = config(|latch| {
        latch.contact_share = 0.2;
        latch.hold_friction = true;
    });
    config.friction = friction().map(|friction: Friction| Friction {
        offset_nm: 0.0,
        breakaway_nm: friction.coulomb_nm,
        presliding_rad: PRESLIDING_RAD,
        ..friction
    });
    let mut bench = Bench::new(config);
    bench.cycles(700, up(0.0));
    let touched = bench.cycles(200, up(12.0));
    let output = &touched[199];
    assert!(output.in_contact && output.friction_share == 0.2);
    let dry = |output: &Output<3>| {
        Vector::<3>::from_fn(|i, _| output.torques.friction[i] / config.friction[i].coulomb_nm)
    };
    let before = dry(output);
    assert!(before[1].abs() > 0.9, "{before}");
    // The plant stops; its joints rebound by two presliding distances.
    let mut rig = bench.rig.clone();
    let mut last = *output;
    for _ in 0..100 {
        for i in 1..3 {
            rig.q[i] -= before[i].signum() * 2.0 * PRESLIDING_RAD / 100.0;
        }
        last = rig.cycle();
        assert!(last.in_contact && last.fault.is_none());
    }
    for i in 1..3 {
        let back = -before[i].signum();
        let reversed = back + (before[i] - back) * supple_core::math::exp(-2.0);
        let found = dry(&last)[i];
        assert!(
            (found - reversed).abs() < 0.1,
            "joint {i}: {found}, {reversed}"
        );
    }
    let at_rest = rig.cycles(300);
    assert_eq!(dry(&at_rest), dry(&last));
}

/// Larger friction, or a less accurate friction model, raises the threshold.
#[test]
fn friction_uncertainty_raises_the_threshold() {
    let threshold = |coulomb_nm: f64, error: f64| {
        let mut config = config(|latch| latch.friction_error = error);
        config.friction = [Friction::coulomb(0.0, coulomb_nm); 3];
        let mut bench = Bench::new(config);
        let outputs = bench.cycles(1000, up(0.0));
        outputs[999].contact_threshold_n
    };
    let none = threshold(0.0, 0.1);
    assert!((none - 3.0).abs() < 1e-12);
    assert!(threshold(1.0, 0.1) > none);
    assert!(threshold(2.0, 0.1) > threshold(1.0, 0.1));
    assert!(threshold(1.0, 0.3) > threshold(1.0, 0.1));
}

/// A reference that has not moved has no direction.
#[test]
fn a_reference_at_rest_never_latches() {
    let config = config(|_| {});
    let mut bench = Bench::new(config);
    let hold = bench.rig.hold_tip_request();
    bench.cycle(Some(hold), up(0.0));
    for output in bench.cycles(1000, up(12.0)) {
        assert!(!output.in_contact);
        assert_eq!(output.force_against_n, 0.0);
    }
}

/// Motor counts of the WAM's encoders, at the joints \[rad\].
const COUNT_RAD: f64 = std::f64::consts::TAU / 4096.0 / 28.25;

/// A latch like that of the WAM, with the residuals of its model.
fn adapting(config: &mut Config<3>) {
    config.law.gains = Gains::isotropic(5.0, 1.5);
    config.friction = friction();
    config.estimator_rad_per_s = 500.0;
    config.latch = ContactLatch {
        observer_rad_per_s: 120.0,
        threshold_n: 3.5,
        settle_s: 0.1,
        hold_friction: true,
        false_alarms_per_hour: 1.0,
        release_s: 0.2,
        ..config.latch
    };
}

/// Friction of the arm: that of the model times `factor`, smooth through rest.
fn against_motion(qd: &Vector<3>, factor: f64) -> Vector<3> {
    let model: [Friction; 3] = friction();
    Vector::from_fn(|i, _| {
        let f = &model[i];
        -factor * (f.viscous_nm_s_per_rad * qd[i] + f.coulomb_nm * (qd[i] / 0.01).tanh())
            - f.offset_nm
    })
}

/// Number of contacts in a sinusoid of 20 s, and the longest contact in cycles.
fn in_free_motion(config: Config<3>, friction_factor: f64, noise_counts: f64) -> (u32, u32) {
    let mut bench = Bench::new(config);
    bench.rig.accept(Request::GravityHold);
    let mut random = Random::new(20_260_117);
    let sinusoid = Trajectory::Sinusoid(Sinusoid {
        centre_m: CENTRE,
        amplitude_m: Vector3::new(0.0, 0.0, -0.1),
        angular_frequency_rad_per_s: 0.8,
        ramp_s: 1.0,
    });
    let (mut contacts, mut longest, mut present) = (0, 0, 0);
    for k in 0..22_000 {
        let request = (k == 2_000).then_some(Request::Track(sinusoid));
        let noise = Vector::from_fn(|_, _| noise_counts * COUNT_RAD * random.normal());
        bench.rig.q = bench.plant.q + noise;
        let input = Input {
            request,
            ..bench.rig.input()
        };
        let output = bench.rig.step(&input);
        assert_eq!((output.refusal, output.fault), (None, None), "{k}");
        let friction =
            |_: &Arm<3>, _: &Vector<3>, qd: &Vector<3>| against_motion(qd, friction_factor);
        bench.plant.advance(&output.torque_nm, friction, 1e-3, 4);
        contacts += u32::from(output.in_contact && present == 0);
        present = if output.in_contact { present + 1 } else { 0 };
        longest = longest.max(present);
    }
    (contacts, longest)
}

/// Every encoder has noise with a standard deviation of two counts. With a threshold that does not depend on residuals, the latch
/// would close.
#[test]
fn encoder_noise_of_two_counts_does_not_trigger_the_latch() {
    let fixed = config(|_| {});
    let mut adapted = fixed;
    adapting(&mut adapted);
    assert_eq!(in_free_motion(adapted, 1.0, 2.0), (0, 0));
    let mut unaware = adapted;
    unaware.latch.false_alarms_per_hour = f64::INFINITY;
    let (contacts, _) = in_free_motion(unaware, 1.0, 2.0);
    assert!(contacts > 0, "the noise is too small to show anything");
}

/// The arm has 5 % more friction than the model and no Stribeck effect, and the threshold is low.
#[test]
fn a_moderately_wrong_model_does_not_trigger_the_latch() {
    let mut wrong = config(|_| {});
    adapting(&mut wrong);
    wrong.latch.threshold_n = 1.0;
    assert_eq!(in_free_motion(wrong, 1.05, 0.5), (0, 0));
}
