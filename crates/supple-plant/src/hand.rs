//! A hand on the tip of a simulated arm: it guides the tip along a path, by a spring, or pushes it with given forces.
//!
//! `F = clip(k (x_hand - x) + b (x_hand' - x'))`, where `x_hand` is the tip's position when the hand took hold, plus the
//! path's displacement. The force sensor behind the tip measures it like any other force on the tip.

use crate::injection::ControllerView;
use serde::{Deserialize, Serialize};
use supple_core::controller::Mode;
use supple_core::nalgebra::Vector3;

/// Most rows of a path or of forces.
const MAX_ROWS: usize = 1000;
/// Longest time \[s\].
const MAX_TIME_S: f64 = 3600.0;
/// Greatest displacement \[m\].
const MAX_DISPLACEMENT_M: f64 = 2.0;
/// Greatest force \[N\].
const MAX_FORCE_N: f64 = 500.0;

/// When the hand takes hold.
#[derive(
    Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// Whenever float begins; it lets go when float ends. An arm on a bus does not receive the mode.
    #[default]
    Float,
    /// When the drives first become active.
    Active,
}

/// What the hand does: one of `path` and `force`. After the last row it lets go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Hand {
    /// When it takes hold.
    pub when: Grip,
    /// Stiffness of its spring \[N/m\], 0 to 5000; 400 by default.
    pub stiffness_n_per_m: f64,
    /// Damping against its own motion \[N s/m\], 0 to 500; 40 by default.
    pub damping_n_s_per_m: f64,
    /// Largest force of its spring \[N\], up to 500; 50 by default.
    pub max_force_n: f64,
    /// Rows of time since it took hold \[s\] and displacement x, y, z in base axes \[m\]; smooth in between.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub path: Vec<[f64; 4]>,
    /// Rows of time since it took hold \[s\] and force x, y, z in base axes \[N\]; linear in between.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub force: Vec<[f64; 4]>,
}

impl Default for Hand {
    fn default() -> Hand {
        Hand {
            when: Grip::Float,
            stiffness_n_per_m: 400.0,
            damping_n_s_per_m: 40.0,
            max_force_n: 50.0,
            path: Vec::new(),
            force: Vec::new(),
        }
    }
}

impl Hand {
    /// Checks the values.
    ///
    /// # Errors
    /// The invalid entry, its value, and the requirement.
    pub fn validate(&self) -> Result<(), (&'static str, f64, String)> {
        for (entry, value, max) in [
            ("hand.stiffness_n_per_m", self.stiffness_n_per_m, 5000.0),
            ("hand.damping_n_s_per_m", self.damping_n_s_per_m, 500.0),
            ("hand.max_force_n", self.max_force_n, MAX_FORCE_N),
        ] {
            if !(0.0..=max).contains(&value) {
                return Err((entry, value, format!("from 0 to {max}")));
            }
        }
        let (path, force) = (self.path.len(), self.force.len());
        let (entry, rows, max) = match (path, force) {
            (_, 0) => ("hand.path", &self.path, MAX_DISPLACEMENT_M),
            (0, _) => ("hand.force", &self.force, MAX_FORCE_N),
            _ => {
                let must = "0 rows next to hand.path: give one of the two".to_owned();
                return Err(("hand.force", force as f64, must));
            }
        };
        if !(2..=MAX_ROWS).contains(&rows.len()) {
            let must = format!("2 to {MAX_ROWS} rows of [time, x, y, z]");
            return Err((entry, rows.len() as f64, must));
        }
        let mut before_s = -1.0;
        for [time_s, xyz @ ..] in rows {
            if !(*time_s > before_s && (0.0..=MAX_TIME_S).contains(time_s)) {
                let must = format!("times that increase, from 0 to {MAX_TIME_S} s");
                return Err((entry, *time_s, must));
            }
            before_s = *time_s;
            if let Some(value) = xyz.iter().find(|value| !(-max..=max).contains(*value)) {
                return Err((entry, *value, format!("from -{max} to {max}")));
            }
        }
        Ok(())
    }

    /// Returns displacement \[m\] and velocity \[m/s\] of the hand at a time since it took hold; `None` outside its path.
    fn motion(&self, time_s: f64) -> Option<(Vector3<f64>, Vector3<f64>)> {
        let (row, share, dt_s) = interpolation_interval(&self.path, time_s)?;
        // A cubic through the rows, with the velocity of the chord between the neighbours; at rest at both ends.
        let velocity = |i: usize| match i {
            0 => Vector3::zeros(),
            _ if i + 1 >= self.path.len() => Vector3::zeros(),
            _ => {
                let (before, after) = (&self.path[i - 1], &self.path[i + 1]);
                (xyz(after) - xyz(before)) / (after[0] - before[0])
            }
        };
        let (p, q) = (xyz(&self.path[row]), xyz(&self.path[row + 1]));
        let (u, v) = (velocity(row) * dt_s, velocity(row + 1) * dt_s);
        let (x, x2, x3) = (share, share * share, share * share * share);
        let position = p * (2.0 * x3 - 3.0 * x2 + 1.0)
            + u * (x3 - 2.0 * x2 + x)
            + q * (3.0 * x2 - 2.0 * x3)
            + v * (x3 - x2);
        let rate = p * (6.0 * x2 - 6.0 * x)
            + u * (3.0 * x2 - 4.0 * x + 1.0)
            + q * (6.0 * x - 6.0 * x2)
            + v * (3.0 * x2 - 2.0 * x);
        Some((position, rate / dt_s))
    }

    /// Returns the given force at a time since the hand took hold \[N\]; `None` outside its rows.
    fn given_force(&self, time_s: f64) -> Option<Vector3<f64>> {
        let (row, share, _) = interpolation_interval(&self.force, time_s)?;
        Some(xyz(&self.force[row]) * (1.0 - share) + xyz(&self.force[row + 1]) * share)
    }
}

/// Returns the row before this time, the fraction of the interval to the next row, and the length of the interval \[s\].
fn interpolation_interval(rows: &[[f64; 4]], time_s: f64) -> Option<(usize, f64, f64)> {
    let after = rows.iter().position(|row| row[0] > time_s)?;
    let row = after.checked_sub(1)?;
    let dt_s = rows[after][0] - rows[row][0];
    Some((row, (time_s - rows[row][0]) / dt_s, dt_s))
}

fn xyz(row: &[f64; 4]) -> Vector3<f64> {
    Vector3::new(row[1], row[2], row[3])
}

/// The hand in a running plant.
#[derive(Clone, Debug)]
pub(crate) struct HandState {
    hand: Hand,
    /// Time at which the hand took hold \[s\].
    since_s: Option<f64>,
    /// Position of the tip when the path began \[m\].
    grip_m: Option<Vector3<f64>>,
}

impl HandState {
    pub fn new(hand: Hand) -> HandState {
        HandState {
            hand,
            since_s: None,
            grip_m: None,
        }
    }

    /// Sets the mode of the controller from this time on, which decides whether the hand holds the tip. In a cycle without an answer
    /// of the controller, a hand that holds the tip keeps hold of it, until the drives are idle.
    pub fn set_controller_view(&mut self, view: ControllerView, time_s: f64) {
        let holds = match self.hand.when {
            Grip::Float => match view.mode {
                Some(mode) => view.active && mode == Mode::Float,
                None => view.active && self.since_s.is_some(),
            },
            Grip::Active => view.active || self.since_s.is_some(),
        };
        match (holds, self.since_s) {
            (true, None) => self.since_s = Some(time_s),
            (false, Some(_)) => (self.since_s, self.grip_m) = (None, None),
            _ => {}
        }
    }

    /// Returns the force on the tip \[N\] at its position \[m\] and velocity \[m/s\].
    pub fn force_n(
        &mut self,
        time_s: f64,
        tip_m: &Vector3<f64>,
        velocity_m_per_s: &Vector3<f64>,
    ) -> Vector3<f64> {
        let Some(since_s) = self.since_s else {
            return Vector3::zeros();
        };
        let time_s = time_s - since_s;
        if let Some(force_n) = self.hand.given_force(time_s) {
            return force_n;
        }
        let Some((displacement_m, rate_m_per_s)) = self.hand.motion(time_s) else {
            return Vector3::zeros();
        };
        let grip_m = *self.grip_m.get_or_insert(tip_m - displacement_m);
        let force_n = (grip_m + displacement_m - tip_m) * self.hand.stiffness_n_per_m
            + (rate_m_per_s - velocity_m_per_s) * self.hand.damping_n_s_per_m;
        let norm_n = force_n.norm();
        match norm_n > self.hand.max_force_n {
            true => force_n * (self.hand.max_force_n / norm_n),
            false => force_n,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hand() -> Hand {
        Hand {
            path: vec![
                [1.0, 0.0, 0.0, 0.0],
                [2.0, 0.1, 0.0, 0.0],
                [4.0, 0.1, 0.2, 0.0],
            ],
            ..Hand::default()
        }
    }

    fn seen(active: bool, mode: Mode) -> ControllerView {
        ControllerView {
            active,
            mode: Some(mode),
        }
    }

    #[test]
    fn the_path_passes_its_rows_smoothly_and_begins_and_ends_at_rest() {
        let hand = hand();
        assert_eq!(hand.motion(0.9), None);
        assert_eq!(hand.motion(4.0), None);
        let (start, rate) = hand.motion(1.0).expect("there");
        assert_eq!((start, rate), (Vector3::zeros(), Vector3::zeros()));
        assert!((hand.motion(2.0).expect("there").0 - Vector3::new(0.1, 0.0, 0.0)).norm() < 1e-12);
        let h = 1e-6;
        for k in 1..29 {
            let time_s = 1.0 + 0.1 * f64::from(k) + 0.003;
            let (before, _) = hand.motion(time_s - h).expect("there");
            let (after, _) = hand.motion(time_s + h).expect("there");
            let (_, rate) = hand.motion(time_s).expect("there");
            assert!(
                ((after - before) / (2.0 * h) - rate).norm() < 1e-6,
                "{time_s}"
            );
        }
        assert!(hand.motion(4.0 - 1e-9).expect("there").1.norm() < 1e-6);
    }

    #[test]
    fn the_hand_holds_only_in_float_and_its_force_stays_within_its_limit() {
        let mut state = HandState::new(hand());
        let (tip_m, rest) = (Vector3::new(0.5, 0.0, 0.3), Vector3::zeros());
        state.set_controller_view(seen(true, Mode::GravityHold), 9.0);
        assert_eq!(state.force_n(11.0, &tip_m, &rest), rest);
        state.set_controller_view(seen(true, Mode::Float), 10.0);
        assert_eq!(
            state.force_n(10.5, &tip_m, &rest),
            rest,
            "before the first row"
        );
        assert_eq!(
            state.force_n(11.0, &tip_m, &rest),
            rest,
            "it has just taken hold"
        );
        // The tip does not move: 400 N/m over 0.1 m, and the hand's own speed at that row.
        let force_n = state.force_n(12.0, &tip_m, &rest);
        assert!(
            (force_n.x - (40.0 + 40.0 * 0.1 / 3.0)).abs() < 1e-9,
            "{force_n}"
        );
        assert_eq!(force_n.norm().min(50.0), force_n.norm());
        let held_n = state.force_n(13.9, &tip_m, &rest).norm();
        assert!((held_n - 50.0).abs() < 1e-9, "{held_n}");
        let unanswered = ControllerView {
            active: true,
            mode: None,
        };
        state.set_controller_view(unanswered, 13.9);
        assert!((state.force_n(13.9, &tip_m, &rest).norm() - 50.0).abs() < 1e-9);
        let idle = ControllerView {
            active: false,
            ..unanswered
        };
        let mut left = state.clone();
        left.set_controller_view(idle, 13.9);
        assert_eq!(left.force_n(13.9, &tip_m, &rest), rest);
        state.set_controller_view(seen(true, Mode::Fault), 14.0);
        assert_eq!(state.force_n(14.0, &tip_m, &rest), rest);
    }

    #[test]
    fn forces_are_linear_between_their_rows() {
        let mut state = HandState::new(Hand {
            when: Grip::Active,
            force: vec![[0.0, 0.0, 0.0, 0.0], [2.0, 4.0, 0.0, -2.0]],
            ..Hand::default()
        });
        let rest = Vector3::zeros();
        state.set_controller_view(seen(true, Mode::Track), 5.0);
        state.set_controller_view(seen(false, Mode::Idle), 5.5);
        assert_eq!(
            state.force_n(6.0, &rest, &rest),
            Vector3::new(2.0, 0.0, -1.0)
        );
        assert_eq!(state.force_n(7.5, &rest, &rest), rest);
    }

    #[test]
    fn an_invalid_hand_is_rejected_with_the_name_of_the_entry() {
        assert_eq!(hand().validate(), Ok(()));
        let refused = |change: &dyn Fn(&mut Hand)| {
            let mut wrong = hand();
            change(&mut wrong);
            wrong.validate().expect_err("wrong").0
        };
        assert_eq!(refused(&|h| h.path.truncate(1)), "hand.path");
        assert_eq!(refused(&|h| h.path[1][0] = 1.0), "hand.path");
        assert_eq!(refused(&|h| h.path[2][3] = f64::NAN), "hand.path");
        assert_eq!(refused(&|h| h.force = h.path.clone()), "hand.force");
        assert_eq!(refused(&|h| h.max_force_n = -1.0), "hand.max_force_n");
        assert_eq!(
            refused(&|h| h.stiffness_n_per_m = f64::NAN),
            "hand.stiffness_n_per_m"
        );
    }
}
