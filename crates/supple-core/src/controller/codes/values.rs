//! A request as an array of numbers, and the errors of decoding; `request.rs` defines the meaning of the numbers.

/// Maximum number of values of a request, which an excitation of 7 joints needs.
pub const VALUES: usize = 80;

/// A request as numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequestCode {
    /// One of [`request_kind`](super::request_kind).
    pub kind: u8,
    /// For a track or track-pose request one of [`trajectory_kind`](super::trajectory_kind), otherwise none.
    pub trajectory: u8,
    /// Number of valid `values`.
    pub count: u8,
    /// Values of the request's fields, in their order; zero beyond `count`.
    pub values: [f64; VALUES],
}

/// Reason why numbers encode no request.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RequestCodeError {
    /// No request has this number.
    Kind(u8),
    /// No trajectory has this number.
    Trajectory(u8),
    /// Too few or too many values.
    Count {
        /// Values found.
        found: usize,
        /// Values that the request takes.
        expected: usize,
    },
    /// A number of strokes, of a joint, of a switch or of a cycle that is not whole or too great.
    Whole(f64),
}

impl RequestCode {
    /// No request.
    pub const NONE: RequestCode = RequestCode {
        kind: 0,
        trajectory: 0,
        count: 0,
        values: [0.0; VALUES],
    };

    /// Creates the code from its parts, as a log contains them.
    ///
    /// # Errors
    /// More than [`VALUES`] values.
    pub fn from_parts(
        kind: u8,
        trajectory: u8,
        values: &[f64],
    ) -> Result<RequestCode, RequestCodeError> {
        let mut code = RequestCode {
            kind,
            trajectory,
            ..RequestCode::NONE
        };
        if values.len() > VALUES {
            return Err(RequestCodeError::Count {
                found: values.len(),
                expected: VALUES,
            });
        }
        code.numbers(values);
        Ok(code)
    }

    /// Returns the valid values.
    pub fn values(&self) -> &[f64] {
        &self.values[..usize::from(self.count).min(VALUES)]
    }

    /// Appends values.
    pub(super) fn numbers(&mut self, numbers: &[f64]) {
        let count = usize::from(self.count);
        self.values[count..count + numbers.len()].copy_from_slice(numbers);
        self.count += numbers.len() as u8;
    }
}

/// Reader of the values in order; beyond the last value it returns zeros and counts them.
pub(super) struct CodeReader<'a> {
    pub values: &'a [f64],
    pub taken: usize,
    /// Number of the trajectory.
    pub trajectory: u8,
}

impl CodeReader<'_> {
    /// Returns the next number.
    pub fn number(&mut self) -> f64 {
        let number = self.values.get(self.taken).copied().unwrap_or(0.0);
        self.taken += 1;
        number
    }

    /// Returns a value that older logs lack; zero if it is missing.
    pub fn number_if_present(&mut self) -> f64 {
        match self.taken < self.values.len() {
            true => self.number(),
            false => 0.0,
        }
    }
}
