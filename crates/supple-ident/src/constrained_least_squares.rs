//! Least squares with physical consistency constraints.
//!
//! ```text
//! min 1/2 |A x - b|^2 + gamma sum_k [tr(P0_k^-1 P_k) - log det P_k]
//! P_k(x) positive definite for every link,   g_i . x >= 0
//! ```
//!
//! `P = [S h; h' m]`, `S = tr(I)/2 - I`, is the pseudo-inertia: positive definite if and only if some mass
//! distribution realises it (Wensing, Kim and Slotine, 2018). The second term is the log-det divergence from
//! the model `P0`, up to a constant; it also determines the parameters that the data leave undetermined.
//!
//! The solver applies Newton's method to `objective - mu (sum log det P_k + sum log g_i . x)`, with `mu` reduced in
//! steps. At the minimum for one `mu` (a point of the central path), the objective is within `mu nu` of its own minimum, where
//! `nu` is four for each link plus one for each `g_i`. The solver returns this bound with the result. While `mu` exceeds `gamma`,
//! it takes the place of `gamma`: such a barrier against a weaker prior would move what the data leave undetermined far from `P0`,
//! up to `mu / gamma` times as heavy.

use crate::error::{IdentError, positive};
use crate::qr_reduction::ReducedSystem;
use nalgebra::{Cholesky, DMatrix, DVector, Matrix4, SVector};

/// Factor from one `mu` to the next.
const REDUCTION: f64 = 0.1;
/// Ratio of the barrier to the prior at termination.
const BARRIER_TO_PRIOR_RATIO: f64 = 1e-6;
/// Maximum number of Newton steps for each `mu`.
const STEPS: usize = 60;

/// The constraints and the prior.
#[derive(Clone, Debug)]
pub struct Constraints {
    /// Prior: ten parameters of each link of the nominal model. They are the first unknowns.
    pub links: Vec<SVector<f64, 10>>,
    /// `g_i`: linear forms that must not be negative, each as a list of (index of the unknown, coefficient).
    pub not_negative: Vec<Vec<(usize, f64)>>,
    /// `gamma`, positive: weight of the prior in equivalent observations.
    pub prior_weight: f64,
    /// Stop when the optimality gap is at most this, relative to `1 + |objective|`.
    pub tolerance: f64,
}

/// A strictly feasible solution.
#[derive(Clone, Debug, PartialEq)]
pub struct Solution {
    /// The unknowns.
    pub x: DVector<f64>,
    /// Objective, without the barrier.
    pub objective: f64,
    /// Upper bound on the distance of the objective from its minimum.
    pub optimality_gap: f64,
    /// Number of Newton steps.
    pub steps: usize,
}

/// Returns the pseudo-inertia of ten parameters.
pub fn pseudo_inertia(p: &SVector<f64, 10>) -> Matrix4<f64> {
    let [m, hx, hy, hz, xx, xy, yy, xz, yz, zz] = p.data.0[0];
    let half = 0.5 * (xx + yy + zz);
    Matrix4::new(
        half - xx,
        -xy,
        -xz,
        hx, //
        -xy,
        half - yy,
        -yz,
        hy, //
        -xz,
        -yz,
        half - zz,
        hz, //
        hx,
        hy,
        hz,
        m,
    )
}

impl Constraints {
    /// Returns the degree of the barrier.
    fn nu(&self) -> f64 {
        (4 * self.links.len() + self.not_negative.len()) as f64
    }
}

/// Solves for the unknowns of `system`, starting from the prior.
///
/// # Errors
/// [`IdentError::Option`] for a prior weight or tolerance that is not positive; [`IdentError::Singular`] if a
/// link of the prior is physically inconsistent or the data are not finite.
pub fn solve(system: &ReducedSystem, constraints: &Constraints) -> Result<Solution, IdentError> {
    positive("prior_weight", constraints.prior_weight)?;
    positive("tolerance", constraints.tolerance)?;
    let problem = Problem::new(system, constraints)?;
    let mut x = problem.start();
    let mut steps = 0;
    let nu = constraints.nu();
    let mut mu = problem.objective(&x).ok_or_else(inconsistent_link)?.abs() / nu;
    loop {
        steps += problem.centre(&mut x, mu)?;
        let objective = problem.objective(&x).ok_or_else(inconsistent_link)?;
        // Undetermined parameters take the prior's values only if the barrier is negligible against the prior.
        let barrier_negligible = mu <= BARRIER_TO_PRIOR_RATIO * constraints.prior_weight;
        if barrier_negligible && mu * nu <= constraints.tolerance * (1.0 + objective.abs()) {
            return Ok(Solution {
                x,
                objective,
                optimality_gap: mu * nu,
                steps,
            });
        }
        mu *= REDUCTION;
    }
}

fn inconsistent_link() -> IdentError {
    IdentError::Singular {
        problem: "a link of the model has no positive definite pseudo-inertia".to_owned(),
        remedy: "correct its mass, centre of mass and inertia",
    }
}

struct Problem<'a> {
    constraints: &'a Constraints,
    /// `A' A`.
    gram: DMatrix<f64>,
    a: DMatrix<f64>,
    b: DVector<f64>,
    prior_inverse: Vec<Matrix4<f64>>,
    basis: [Matrix4<f64>; 10],
}

impl<'a> Problem<'a> {
    fn new(system: &ReducedSystem, constraints: &'a Constraints) -> Result<Self, IdentError> {
        let a = system.a();
        let inverse = |p: &SVector<f64, 10>| {
            let inverse = Cholesky::new(pseudo_inertia(p)).map(|c| c.inverse());
            inverse.ok_or_else(inconsistent_link)
        };
        let basis = std::array::from_fn(|i| {
            let mut unit = SVector::<f64, 10>::zeros();
            unit[i] = 1.0;
            pseudo_inertia(&unit)
        });
        Ok(Self {
            constraints,
            gram: a.tr_mul(&a),
            b: system.b(),
            a,
            prior_inverse: constraints
                .links
                .iter()
                .map(inverse)
                .collect::<Result<_, _>>()?,
            basis,
        })
    }

    /// Returns the start values: the prior for the links, 1 for every other unknown that must not be negative, 0 for the rest.
    fn start(&self) -> DVector<f64> {
        let mut x = DVector::zeros(self.a.ncols());
        for (k, link) in self.constraints.links.iter().enumerate() {
            x.rows_mut(10 * k, 10).copy_from(link);
        }
        for form in &self.constraints.not_negative {
            if let [(i, _)] = form[..] {
                x[i] = 1.0;
            }
        }
        x
    }

    fn link(&self, x: &DVector<f64>, k: usize) -> Option<Cholesky<f64, nalgebra::U4>> {
        Cholesky::new(pseudo_inertia(&x.fixed_rows::<10>(10 * k).into_owned()))
    }

    fn form(form: &[(usize, f64)], x: &DVector<f64>) -> f64 {
        form.iter().map(|(i, c)| c * x[*i]).sum()
    }

    /// Returns the weight of the prior on the way to `mu = 0`.
    fn gamma(&self, mu: f64) -> f64 {
        self.constraints.prior_weight.max(mu)
    }

    /// Returns the objective without the barrier; `None` outside the constraints.
    fn objective(&self, x: &DVector<f64>) -> Option<f64> {
        self.value(x, 0.0)
    }

    /// Returns the objective with the barrier of weight `mu` and the prior of [`Problem::gamma`]; `None` outside the constraints.
    fn value(&self, x: &DVector<f64>, mu: f64) -> Option<f64> {
        let gamma = self.gamma(mu);
        let mut value = 0.5 * (&self.a * x - &self.b).norm_squared();
        for (k, inverse) in self.prior_inverse.iter().enumerate() {
            let cholesky = self.link(x, k)?;
            let p = pseudo_inertia(&x.fixed_rows::<10>(10 * k).into_owned());
            value += gamma * inverse.dot(&p) - (gamma + mu) * cholesky.ln_determinant();
        }
        for form in &self.constraints.not_negative {
            let slack = Self::form(form, x);
            if slack <= 0.0 {
                return None;
            }
            value -= if mu > 0.0 { mu * slack.ln() } else { 0.0 };
        }
        value.is_finite().then_some(value)
    }

    /// Returns the gradient and Hessian of [`Problem::value`].
    fn derivatives(&self, x: &DVector<f64>, mu: f64) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let gamma = self.gamma(mu);
        let mut gradient = self.a.tr_mul(&(&self.a * x - &self.b));
        let mut hessian = self.gram.clone();
        for (k, prior) in self.prior_inverse.iter().enumerate() {
            let inverse = self.link(x, k)?.inverse();
            let inverse_times_basis = self.basis.map(|e| inverse * e);
            for (i, basis) in self.basis.iter().enumerate() {
                gradient[10 * k + i] +=
                    gamma * prior.dot(basis) - (gamma + mu) * inverse_times_basis[i].trace();
                for j in 0..10 {
                    hessian[(10 * k + i, 10 * k + j)] += (gamma + mu)
                        * inverse_times_basis[i].dot(&inverse_times_basis[j].transpose());
                }
            }
        }
        for form in &self.constraints.not_negative {
            let slack = Self::form(form, x);
            for (i, a) in form {
                gradient[*i] -= mu * a / slack;
                for (j, b) in form {
                    hessian[(*i, *j)] += mu * a * b / (slack * slack);
                }
            }
        }
        Some((gradient, hessian))
    }

    /// Moves `x` to the minimum of [`Problem::value`] by Newton's method with backtracking; returns the number
    /// of steps taken.
    fn centre(&self, x: &mut DVector<f64>, mu: f64) -> Result<usize, IdentError> {
        let mut value = self.value(x, mu).ok_or_else(inconsistent_link)?;
        for taken in 0..STEPS {
            let (gradient, hessian) = self.derivatives(x, mu).ok_or_else(inconsistent_link)?;
            let step = newton_step(&gradient, &hessian)?;
            let decrement = -gradient.dot(&step);
            if decrement <= 1e-6 * mu {
                return Ok(taken);
            }
            let mut length = 1.0;
            loop {
                let next = &*x + &step * length;
                let next_value = self.value(&next, mu);
                if let Some(v) = next_value
                    && v <= value - 1e-4 * length * decrement
                {
                    (*x, value) = (next, v);
                    break;
                }
                length *= 0.5;
                // Stop: further decrease is below rounding.
                if length < 1e-10 {
                    return Ok(taken);
                }
            }
        }
        Ok(STEPS)
    }
}

/// Returns `-H^-1 g`, with unknowns scaled so that the diagonal of `H` is one.
fn newton_step(
    gradient: &DVector<f64>,
    hessian: &DMatrix<f64>,
) -> Result<DVector<f64>, IdentError> {
    let n = gradient.len();
    let max_diagonal = hessian.diagonal().amax();
    let scale = DVector::from_fn(n, |i, _| {
        1.0 / hessian[(i, i)]
            .max(f64::EPSILON * f64::EPSILON * max_diagonal)
            .sqrt()
    });
    let scaled = DMatrix::from_fn(n, n, |i, j| hessian[(i, j)] * scale[i] * scale[j]);
    let mut ridge = 0.0;
    while ridge < 1e-3 {
        let shifted = &scaled + DMatrix::identity(n, n) * ridge;
        if let Some(cholesky) = Cholesky::new(shifted) {
            return Ok(-cholesky
                .solve(&gradient.component_mul(&scale))
                .component_mul(&scale));
        }
        ridge = if ridge == 0.0 { 1e-14 } else { 10.0 * ridge };
    }
    Err(IdentError::Singular {
        problem: "the data are not finite or leave a combination of parameters undetermined"
            .to_owned(),
        remedy: "remove columns of the regressor, or raise the prior weight",
    })
}
