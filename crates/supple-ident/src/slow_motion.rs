//! The second stage of a fit: the Stribeck effect from slow motion.

use crate::columns::{Column, Columns};
use crate::joint_rows::JointRows;
use nalgebra::{DMatrix, DVector};

/// Minimum number of slow samples of a joint, and of those in which a direction shows the effect.
const MIN_ROWS: usize = 20;
/// Smallest eigenvalue of the scaled normal equations of the slow samples from which their torques are determined.
const LEAST_INFORMATION: f64 = 1e-4;

/// Number of equal intervals of speed that have the same weight in the fit of slow motion.
const SPEED_BINS: usize = 15;
/// Greatest weight of one of their samples, so that a few samples do not count for all.
const MAX_SPEED_WEIGHT: f64 = 10.0;
/// Part of the Stribeck effect that a direction must have shown in [`MIN_ROWS`] samples; less would be extrapolated by its inverse.
const SEEN_SHARE: f64 = 0.3;

/// Second stage: fits `B >= |O|` of each joint to samples below three Stribeck speeds in steady sliding outside
/// the band. Inside the band the friction law is a parabola through zero, but real friction persists until standstill,
/// which would bias the estimate. A constant is fitted together with them and discarded: it absorbs gravity errors.
pub(crate) fn fit_stribeck(columns: &Columns, parts: &[Vec<JointRows>], x: &mut DVector<f64>) {
    let reach = 3.0 * columns.friction().stribeck_rad_per_s.unwrap_or(0.0);
    let band = columns.friction().band_rad_per_s;
    for (row, &joint) in columns.identified_joints().iter().enumerate() {
        let Some(stribeck) = columns.position(Column::Stribeck(joint)) else {
            continue;
        };
        let offset = columns.position(Column::StribeckOffset(joint));
        let (mut shapes, mut torques_nm, mut speeds) = (Vec::new(), Vec::new(), Vec::new());
        for part in parts {
            let part = &part[row];
            let residual = &part.b - &part.a * &*x;
            for i in (0..residual.len()).filter(|i| part.is_slow_sliding(*i, &(band..=reach))) {
                shapes.push([stribeck, offset.unwrap_or(stribeck)].map(|c| part.a[(i, c)]));
                torques_nm.push(residual[i]);
                speeds.push(part.speed[i]);
            }
        }
        if shapes.len() < MIN_ROWS {
            continue;
        }
        let weights = speed_weights(&speeds, reach);
        // Each column is this sum of the shapes of `B` and `O`. The mean of the residuals is a nuisance.
        let fitted = |columns: &[[f64; 2]]| {
            let a = DMatrix::from_fn(shapes.len(), 1 + columns.len(), |i, c| {
                let shape = c.checked_sub(1).map_or(1.0, |c| {
                    columns[c][0] * shapes[i][0] + columns[c][1] * shapes[i][1]
                });
                weights[i].sqrt() * shape
            });
            let b = torques_nm.iter().zip(&weights);
            normal_solution(
                &a,
                &b.map(|(nm, weight)| nm * weight.sqrt()).collect::<Vec<_>>(),
            )
        };
        // The excess of each direction, B + O and B - O, is not negative.
        let (positive, negative) = ([0.5, 0.5], [0.5, -0.5]);
        let both = offset.and_then(|_| fitted(&[positive, negative]));
        let alone = |column: [f64; 2]| fitted(&[column]).map_or(0.0, |x| x[1].max(0.0));
        let excess_nm = both.map(|both| match (both[1] < 0.0, both[2] < 0.0) {
            (false, false) => [both[1], both[2]],
            (false, true) => [alone(positive), 0.0],
            (true, false) => [0.0, alone(negative)],
            (true, true) => [0.0; 2],
        });
        // What gears show is below the Coulomb friction.
        let coulomb = columns.position(Column::Coulomb(joint));
        let most_nm = coulomb.map_or(0.0, |c| x[c].max(0.0));
        let is_seen = |sign: f64| {
            let seen = shapes.iter().filter(|of| sign * of[0] >= SEEN_SHARE);
            seen.count() >= MIN_ROWS
        };
        let seen = [is_seen(1.0), is_seen(-1.0)];
        let [positive_nm, negative_nm] = match excess_nm {
            Some(of) => [0, 1].map(|k| if seen[k] { of[k].min(most_nm) } else { 0.0 }),
            // One direction alone does not tell them apart.
            None if seen[0] || seen[1] => [alone([1.0, 0.0]).min(most_nm); 2],
            None => [0.0; 2],
        };
        x[stribeck] = 0.5 * (positive_nm + negative_nm);
        if let Some(offset) = offset {
            x[offset] = 0.5 * (positive_nm - negative_nm);
        }
    }
}

/// Returns the weight of each slow sample with which all speeds up to `reach_rad_per_s` count the same, as far as the greatest weight
/// allows: most samples of a smooth motion are near its greatest speed, and what a joint does near rest would not count.
pub(crate) fn speed_weights(speeds_rad_per_s: &[f64], reach_rad_per_s: f64) -> Vec<f64> {
    let bin =
        |speed: &f64| ((speed / reach_rad_per_s * SPEED_BINS as f64) as usize).min(SPEED_BINS - 1);
    let mut counts = [0_usize; SPEED_BINS];
    speeds_rad_per_s
        .iter()
        .for_each(|speed| counts[bin(speed)] += 1);
    let filled = counts.iter().filter(|count| **count > 0).count().max(1);
    let share = speeds_rad_per_s.len() as f64 / filled as f64;
    let weights = speeds_rad_per_s.iter();
    weights
        .map(|speed| (share / counts[bin(speed)] as f64).min(MAX_SPEED_WEIGHT))
        .collect()
}

/// Returns the least-squares solution of a few columns; `None` if they do not determine it.
fn normal_solution(a: &DMatrix<f64>, torques_nm: &[f64]) -> Option<DVector<f64>> {
    let square = a.tr_mul(a);
    let scale: DVector<f64> = square.diagonal().map(|d| d.sqrt());
    if scale.iter().any(|size| *size <= 0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(square.nrows(), square.ncols(), |i, j| {
        square[(i, j)] / (scale[i] * scale[j])
    });
    let eigenvalues = scaled.symmetric_eigenvalues();
    if eigenvalues.min() < LEAST_INFORMATION {
        return None;
    }
    let right = a
        .tr_mul(&DVector::from_column_slice(torques_nm))
        .component_div(&scale);
    Some(scaled.cholesky()?.solve(&right).component_div(&scale))
}
