//! A request as an array of numbers, and why numbers are no request. What they mean is not here.

/// Most values that a request carries: those of an excitation of 7 joints.
pub const VALUES: usize = 80;

/// A request as numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RequestCode {
    /// One of [`request_kind`](super::request_kind).
    pub kind: u8,
    /// Of a track or track-pose request one of [`trajectory_kind`](super::trajectory_kind), otherwise none.
    pub trajectory: u8,
    /// How many of `values` count.
    pub count: u8,
    /// What the request carries, in the order of its fields; zero beyond `count`.
    pub values: [f64; VALUES],
}

/// Why numbers are no request.
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

    /// From its parts, such as a log holds them.
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

    /// The values that count.
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

/// Values taken one after another; zero beyond the last, which the count then shows.
pub(super) struct Rest<'a> {
    pub values: &'a [f64],
    pub taken: usize,
    /// Number of the trajectory.
    pub trajectory: u8,
}

impl Rest<'_> {
    /// The next number.
    pub fn number(&mut self) -> f64 {
        let number = self.values.get(self.taken).copied().unwrap_or(0.0);
        self.taken += 1;
        number
    }

    /// A value that older logs lack; zero without it.
    pub fn number_if_present(&mut self) -> f64 {
        match self.taken < self.values.len() {
            true => self.number(),
            false => 0.0,
        }
    }
}
