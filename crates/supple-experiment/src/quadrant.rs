//! Tracking error on each piece of the quadrant.

use crate::metrics::Rms;
use serde::Serialize;
use supple_core::trajectory::{Piece, Quadrant};

/// One pass along one piece.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Edge {
    /// `out`, `ellipse` or `back`.
    pub piece: &'static str,
    /// Number of rounds completed before.
    pub round: u32,
    /// Whether the run starts here from rest, without a jump of the velocity.
    pub from_rest: bool,
    /// Maximum error \[m\].
    pub peak_error_m: f64,
    /// Mean error over the last quarter of the piece \[m\].
    pub last_quarter_error_m: f64,
}

/// Collects edges from the cycles of a run.
#[derive(Debug)]
pub struct EdgeMeter {
    quadrant: Quadrant,
    current: Option<(Piece, u32)>,
    all: Rms,
    last_quarter: (f64, u32),
    edges: Vec<Edge>,
}

impl EdgeMeter {
    /// Creates a meter for a quadrant.
    pub fn new(quadrant: Quadrant) -> EdgeMeter {
        EdgeMeter {
            quadrant,
            current: None,
            all: Rms::default(),
            last_quarter: (0.0, 0),
            edges: Vec::new(),
        }
    }

    /// Adds one cycle: distance of the tip from its reference at `time_s`.
    pub fn cycle(&mut self, time_s: f64, error_m: f64) {
        let (piece, fraction, round) = self.quadrant.piece_at(time_s);
        if self.current != Some((piece, round)) {
            self.close();
            self.current = Some((piece, round));
        }
        self.all.add(error_m);
        if fraction >= 0.75 {
            self.last_quarter.0 += error_m;
            self.last_quarter.1 += 1;
        }
    }

    fn close(&mut self) {
        if let Some((piece, round)) = self.current.take()
            && self.last_quarter.1 > 0
        {
            self.edges.push(Edge {
                piece: match piece {
                    Piece::Out => "out",
                    Piece::Ellipse => "ellipse",
                    Piece::Back => "back",
                },
                round,
                from_rest: piece == Piece::Out && round == 0,
                peak_error_m: self.all.max_abs(),
                last_quarter_error_m: self.last_quarter.0 / f64::from(self.last_quarter.1),
            });
        }
        self.all = Rms::default();
        self.last_quarter = (0.0, 0);
    }

    /// All edges of which the last quarter was reached.
    pub fn finish(mut self) -> Vec<Edge> {
        self.close();
        self.edges
    }
}
