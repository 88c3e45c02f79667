//! CSV file of a motion, with a header row and one line for each sample.
//!
//! The columns may have any order: `x_m`, `y_m`, `z_m` are the tip position in base axes; `time_s` is the time of the sample, and
//! without this column the lines are waypoints; `q1_rad` and so on are the joint angles. Other columns are ignored.

use std::fmt::Write;
use std::path::Path;
use supple_core::math::Vector3;

/// Maximum size of a file \[bytes\].
const MAX_BYTES: u64 = 64 << 20;
/// Maximum duration of a motion \[s\].
const MAX_S: f64 = 3600.0;
/// Speed below which the tip counts as at rest before and after the motion \[m/s\].
const REST_M_PER_S: f64 = 0.01;
/// Time that is kept before and after the motion \[s\].
const MARGIN_S: f64 = 0.3;
/// Time over which that speed is averaged \[s\].
const SPEED_S: f64 = 0.1;

/// Error of a motion file.
#[derive(Debug, thiserror::Error)]
pub enum PointsError {
    /// The file cannot be read or written.
    #[error("{file}: {source}; give a CSV file of a motion, as `supple teach` writes it")]
    File {
        /// The file.
        file: String,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A column is missing.
    #[error(
        "{file}: the header has no column {column}: name the columns x_m,y_m,z_m (waypoints), and time_s for a motion with \
         times"
    )]
    Column {
        /// The file.
        file: String,
        /// The column.
        column: &'static str,
    },
    /// A value is not a finite number.
    #[error("{file}, line {line}: {column} is {value:?}: give a finite number")]
    Value {
        /// The file.
        file: String,
        /// Its line, from 1.
        line: usize,
        /// The column.
        column: String,
        /// Text found.
        value: String,
    },
    /// A time does not increase, or exceeds the maximum.
    #[error("{file}, line {line}: time_s is {value_s}: times must increase, over at most 3600 s")]
    Time {
        /// The file.
        file: String,
        /// Its line, from 1.
        line: usize,
        /// Value found \[s\].
        value_s: f64,
    },
    /// The file has too few lines.
    #[error("{file}: the file has {found} points: a motion needs at least {needed}")]
    TooShort {
        /// The file.
        file: String,
        /// Points found.
        found: usize,
        /// Points needed.
        needed: usize,
    },
}

/// A motion of the tip over time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RecordedMotion {
    /// Times, increasing \[s\].
    pub time_s: Vec<f64>,
    /// Tip in base axes \[m\].
    pub tip_m: Vec<Vector3<f64>>,
    /// Joint angles of each sample \[rad\]; empty if unknown.
    pub joints_rad: Vec<Vec<f64>>,
}

/// Content of a file.
#[derive(Clone, Debug, PartialEq)]
pub enum Points {
    /// A motion with its times.
    RecordedMotion(RecordedMotion),
    /// Points of the tip \[m\].
    Waypoints(Vec<Vector3<f64>>),
}

impl RecordedMotion {
    /// Adds a sample.
    pub fn push(&mut self, time_s: f64, tip_m: Vector3<f64>, joints_rad: &[f64]) {
        self.time_s.push(time_s);
        self.tip_m.push(tip_m);
        self.joints_rad.push(joints_rad.to_vec());
    }

    /// Returns the duration \[s\].
    pub fn duration_s(&self) -> f64 {
        match (self.time_s.first(), self.time_s.last()) {
            (Some(first), Some(last)) => last - first,
            _ => 0.0,
        }
    }

    /// Returns the motion without the rest before and after it, beginning at time zero; `None` if the tip never moves.
    pub fn trimmed(&self) -> Option<RecordedMotion> {
        let moves = |i: usize| {
            let until = self.time_s[i] + SPEED_S;
            let j = self.time_s.partition_point(|time_s| *time_s < until);
            let j = j.min(self.time_s.len() - 1);
            let dt_s = self.time_s[j] - self.time_s[i];
            j > i && (self.tip_m[j] - self.tip_m[i]).norm() > REST_M_PER_S * dt_s
        };
        let first = (0..self.time_s.len()).find(|i| moves(*i))?;
        let last = (0..self.time_s.len()).rfind(|i| moves(*i))?;
        let (from_s, to_s) = (
            self.time_s[first] - MARGIN_S,
            self.time_s[last] + SPEED_S + MARGIN_S,
        );
        let begin = self.time_s.partition_point(|time_s| *time_s < from_s);
        let end = self.time_s.partition_point(|time_s| *time_s <= to_s);
        let start_s = self.time_s[begin];
        Some(RecordedMotion {
            time_s: self.time_s[begin..end]
                .iter()
                .map(|t| t - start_s)
                .collect(),
            tip_m: self.tip_m[begin..end].to_vec(),
            joints_rad: match self.joints_rad.is_empty() {
                true => Vec::new(),
                false => self.joints_rad[begin..end].to_vec(),
            },
        })
    }

    /// Returns the tip position at a time \[m\]: interpolated linearly between samples, constant before the first and after the
    /// last sample.
    pub fn tip_at(&self, time_s: f64) -> Vector3<f64> {
        let after = self.time_s.partition_point(|t| *t <= time_s);
        match (after.checked_sub(1), after < self.time_s.len()) {
            (None, _) => self.tip_m.first().copied().unwrap_or_default(),
            (Some(before), false) => self.tip_m[before],
            (Some(before), true) => {
                let (from_s, to_s) = (self.time_s[before], self.time_s[after]);
                let share = (time_s - from_s) / (to_s - from_s);
                self.tip_m[before] * (1.0 - share) + self.tip_m[after] * share
            }
        }
    }

    /// Writes the file.
    ///
    /// # Errors
    /// [`PointsError::File`].
    pub fn write(&self, file: &Path) -> Result<(), PointsError> {
        let joints = self.joints_rad.first().map_or(0, Vec::len);
        let names: String = (1..=joints).map(|i| format!(",q{i}_rad")).collect();
        let mut text = format!("time_s,x_m,y_m,z_m{names}\n");
        for (i, (time_s, tip_m)) in self.time_s.iter().zip(&self.tip_m).enumerate() {
            let _ = write!(
                text,
                "{time_s:.4},{:.6},{:.6},{:.6}",
                tip_m.x, tip_m.y, tip_m.z
            );
            for angle_rad in self.joints_rad.get(i).into_iter().flatten() {
                let _ = write!(text, ",{angle_rad:.7}");
            }
            text.push('\n');
        }
        supple_files::write_atomic(file, text.as_bytes()).map_err(|source| PointsError::File {
            file: file.display().to_string(),
            source,
        })
    }
}

/// Reads a file.
///
/// # Errors
/// [`PointsError`] with file, line, value and remedy.
pub fn read_points(path: &Path) -> Result<Points, PointsError> {
    let file = path.display().to_string();
    let text = supple_files::read_text(path, MAX_BYTES).map_err(|source| PointsError::File {
        file: file.clone(),
        source,
    })?;
    parse(&text, &file)
}

fn parse(text: &str, file: &str) -> Result<Points, PointsError> {
    let mut lines = text
        .lines()
        .enumerate()
        .filter(|(_, line)| !line.trim().is_empty() && !line.starts_with('#'));
    let header = lines.next().map_or("", |(_, line)| line);
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    let find = |name: &str| names.iter().position(|found| *found == name);
    let mut axes = [0; 3];
    for (axis, column) in axes.iter_mut().zip(["x_m", "y_m", "z_m"]) {
        *axis = find(column).ok_or_else(|| PointsError::Column {
            file: file.to_owned(),
            column,
        })?;
    }
    let time = find("time_s");
    let joints: Vec<usize> = (1..).map_while(|i| find(&format!("q{i}_rad"))).collect();
    let mut recorded = RecordedMotion::default();
    for (index, line) in lines {
        let values: Vec<&str> = line.split(',').map(str::trim).collect();
        let number = |column: usize| {
            let value = values.get(column).copied().unwrap_or_default();
            let parsed = value.parse::<f64>().ok().filter(|x| x.is_finite());
            parsed.ok_or_else(|| PointsError::Value {
                file: file.to_owned(),
                line: index + 1,
                column: names[column].to_owned(),
                value: supple_files::excerpt(value).into_owned(),
            })
        };
        let tip_m = Vector3::new(number(axes[0])?, number(axes[1])?, number(axes[2])?);
        let value_s = time.map_or(Ok(recorded.time_s.len() as f64), number)?;
        let first_s = recorded.time_s.first().copied().unwrap_or(value_s);
        let increases = recorded
            .time_s
            .last()
            .is_none_or(|last_s| value_s > *last_s);
        if time.is_some() && !(increases && value_s - first_s <= MAX_S) {
            return Err(PointsError::Time {
                file: file.to_owned(),
                line: index + 1,
                value_s,
            });
        }
        let angles: Result<Vec<f64>, PointsError> = joints.iter().map(|c| number(*c)).collect();
        recorded.push(value_s, tip_m, &angles?);
    }
    if joints.is_empty() {
        recorded.joints_rad.clear();
    }
    let (found, needed) = (recorded.time_s.len(), if time.is_some() { 10 } else { 2 });
    if found < needed {
        return Err(PointsError::TooShort {
            file: file.to_owned(),
            found,
            needed,
        });
    }
    Ok(match time {
        Some(_) => Points::RecordedMotion(recorded),
        None => Points::Waypoints(recorded.tip_m),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recorded() -> RecordedMotion {
        let mut recorded = RecordedMotion::default();
        // A second of rest, two seconds of motion, two of rest.
        for k in 0..500 {
            let time_s = 0.01 * f64::from(k);
            let way_m = 0.1 * (time_s - 1.0).clamp(0.0, 2.0);
            recorded.push(7.0 + time_s, Vector3::new(0.5, way_m, 0.25), &[way_m, -1.0]);
        }
        recorded
    }

    #[test]
    fn a_written_motion_is_read_back_unchanged() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("shown.csv");
        let recorded = recorded();
        recorded.write(&file).expect("written");
        let Ok(Points::RecordedMotion(read)) = read_points(&file) else {
            panic!("not a motion");
        };
        assert_eq!(read.time_s.len(), 500);
        for i in 0..500 {
            assert!((read.time_s[i] - recorded.time_s[i]).abs() < 1e-4);
            assert!((read.tip_m[i] - recorded.tip_m[i]).norm() < 1e-5);
            assert!((read.joints_rad[i][0] - recorded.joints_rad[i][0]).abs() < 1e-6);
        }
    }

    #[test]
    fn rest_before_and_after_is_left_out() {
        let trimmed = recorded().trimmed().expect("it moves");
        assert_eq!(trimmed.time_s[0], 0.0);
        assert!(
            (2.0..3.0).contains(&trimmed.duration_s()),
            "{}",
            trimmed.duration_s()
        );
        assert_eq!(trimmed.tip_m[0].y, 0.0);
        assert!((trimmed.tip_at(99.0).y - 0.2).abs() < 1e-12);
        let mut still = RecordedMotion::default();
        for k in 0..100 {
            still.push(0.01 * f64::from(k), Vector3::repeat(0.1), &[]);
        }
        assert_eq!(still.trimmed(), None);
    }

    #[test]
    fn points_without_times_are_waypoints_and_errors_name_line_and_column() {
        let points = parse("name,z_m,x_m,y_m\na,3,1,2\n\n# no point\nb,6,4,5\n", "f");
        let expected = vec![Vector3::new(1.0, 2.0, 3.0), Vector3::new(4.0, 5.0, 6.0)];
        assert_eq!(points.ok(), Some(Points::Waypoints(expected)));
        for (text, part) in [
            ("", "no column x_m"),
            ("x_m,y_m\n1,2\n", "no column z_m"),
            ("x_m,y_m,z_m\n1,2,3\n", "1 points"),
            ("x_m,y_m,z_m\n1,2,3\n1,2,nan\n", "line 3: z_m is \"nan\""),
            ("x_m,y_m,z_m\n1,2,3\n1,2\n", "line 3: z_m is \"\""),
            (
                "time_s,x_m,y_m,z_m\n0,1,2,3\n0,1,2,3\n",
                "line 3: time_s is 0",
            ),
            (
                "time_s,x_m,y_m,z_m\n0,1,2,3\n4000,1,2,3\n",
                "line 3: time_s is 4000",
            ),
        ] {
            let error = parse(text, "f").expect_err(text).to_string();
            assert!(error.contains(part), "{error}");
        }
    }
}
