//! Tracking error along each segment of the quadrant.

use crate::metrics::Rms;
use serde::Serialize;
use supple_core::trajectory::{PathSegment, Quadrant};

/// Tracking error of one pass along one segment.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SegmentPass {
    /// Name of the segment: `out`, `ellipse` or `back`.
    #[serde(rename = "piece")]
    pub segment: &'static str,
    /// Number of laps completed before this pass.
    #[serde(rename = "round")]
    pub lap: u32,
    /// Whether the pass starts from rest, without a velocity jump.
    pub from_rest: bool,
    /// Maximum error \[m\].
    pub peak_error_m: f64,
    /// Mean error over the last quarter of the segment \[m\].
    pub last_quarter_error_m: f64,
}

/// Accumulates the tracking error of each segment pass over the cycles of a run.
#[derive(Debug)]
pub struct SegmentErrorAccumulator {
    quadrant: Quadrant,
    current: Option<(PathSegment, u32)>,
    all: Rms,
    last_quarter: (f64, u32),
    edges: Vec<SegmentPass>,
}

impl SegmentErrorAccumulator {
    /// Creates an accumulator for a quadrant.
    pub fn new(quadrant: Quadrant) -> SegmentErrorAccumulator {
        SegmentErrorAccumulator {
            quadrant,
            current: None,
            all: Rms::default(),
            last_quarter: (0.0, 0),
            edges: Vec::new(),
        }
    }

    /// Adds the distance of the tip from its reference in the cycle at `time_s`.
    pub fn add_cycle(&mut self, time_s: f64, error_m: f64) {
        let (segment, fraction, lap) = self.quadrant.segment_at(time_s);
        if self.current != Some((segment, lap)) {
            self.close();
            self.current = Some((segment, lap));
        }
        self.all.add(error_m);
        if fraction >= 0.75 {
            self.last_quarter.0 += error_m;
            self.last_quarter.1 += 1;
        }
    }

    fn close(&mut self) {
        if let Some((segment, lap)) = self.current.take()
            && self.last_quarter.1 > 0
        {
            self.edges.push(SegmentPass {
                segment: match segment {
                    PathSegment::Out => "out",
                    PathSegment::Ellipse => "ellipse",
                    PathSegment::Back => "back",
                },
                lap,
                from_rest: segment == PathSegment::Out && lap == 0,
                peak_error_m: self.all.max_abs(),
                last_quarter_error_m: self.last_quarter.0 / f64::from(self.last_quarter.1),
            });
        }
        self.all = Rms::default();
        self.last_quarter = (0.0, 0);
    }

    /// Returns all passes that reached the last quarter of their segment.
    pub fn finish(mut self) -> Vec<SegmentPass> {
        self.close();
        self.edges
    }
}
