//! Reads the excitation that `supple excite design` wrote.

use crate::exit::Failure;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use supple_core::trajectory::Fourier;
use supple_experiment::slow_motion;
use supple_ident::{FourierCoefficients, ReadError};
use supple_model::Description;

/// Maximum size of a design file \[bytes\].
const MAX_BYTES: u64 = 1 << 20;

/// The fields of a design's `summary.json` that the commands use.
#[derive(Clone, Debug, Deserialize)]
pub struct ExcitationDesign {
    /// Name of the arm that the motion was designed for.
    pub arm: String,
    /// The joints that move, counted from 0.
    pub moving: Vec<usize>,
    /// The motion.
    #[serde(flatten)]
    pub series: FourierCoefficients,
    /// Path of the file.
    #[serde(skip)]
    path: PathBuf,
}

impl ExcitationDesign {
    /// Reads a design from its folder or file.
    ///
    /// # Errors
    /// [`Failure`] if the file cannot be read, or is not a design.
    pub fn read(path: &Path) -> Result<ExcitationDesign, Failure> {
        let path = match path.is_dir() {
            true => path.join("summary.json"),
            false => path.to_owned(),
        };
        let file = path.display().to_string();
        let text = supple_files::read_text(&path, MAX_BYTES).map_err(|error| ReadError::File {
            file: file.clone(),
            error,
        })?;
        let design: ExcitationDesign =
            serde_json::from_str(&text).map_err(|error| ReadError::Table {
                file,
                problem: format!("not a design: {error}"),
                remedy: "give the folder that `supple excite design` wrote",
            })?;
        Ok(ExcitationDesign { path, ..design })
    }

    /// Returns the designed motion for an arm and, if asked, a slow motion of the same joints after it. If the motion was designed
    /// for another arm, prints a warning.
    ///
    /// # Errors
    /// [`Failure`] for joints that this arm does not have.
    pub fn series_for<const N: usize>(
        &self,
        arm: &Description,
        slow: bool,
    ) -> Result<Vec<Fourier<N>>, Failure> {
        if self.arm != arm.name() {
            crate::console::print_status(&format!(
                "warning: the motion was designed for {}, and runs on {}",
                self.arm,
                arm.name()
            ));
        }
        if let Some(joint) = self.moving.iter().find(|joint| **joint >= N) {
            return Err(Failure::from(ReadError::Table {
                file: self.path.display().to_string(),
                problem: format!(
                    "joint {joint} of `moving` is not one of the {N} joints of this arm"
                ),
                remedy: "give the arm of the design with --arm",
            }));
        }
        let mut series = vec![self.series.fourier::<N>()?];
        if slow {
            let (config, home_rad) = (arm.config::<N>()?, arm.home::<N>()?);
            series.push(slow_motion(&config, &home_rad, &self.moving)?);
        }
        Ok(series)
    }
}
