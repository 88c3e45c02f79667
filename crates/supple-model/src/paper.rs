//! The paper's own arm: its closed-form dynamics, and the printed parameter set.
//!
//! Three joints: base yaw `q1`, shoulder pitch `q2` measured from the horizontal and positive upwards,
//! elbow `q3` relative to the upper arm. Link frames have x along the link, z along the joint axis.
//! With `'` for "about the joint axis, m r^2 added", `c2 = cos q2`, `s23 = sin(q2 + q3)` and so on:
//!
//! ```text
//! H11 = Iz1 + Ix2 s2^2 + Iy2' c2^2 + Ix3 s23^2 + Iy3' c23^2 + m3 l2^2 c2^2 + 2 l2 m3r3 c2 c23
//! H22 = Iz2' + Iz3' + m3 l2^2 + 2 l2 m3r3 c3     H23 = Iz3' + l2 m3r3 c3     H33 = Iz3'
//! H12 = H13 = 0
//! G2  = g [(m2r2 + m3 l2) c2 + m3r3 c23]         G3 = g m3r3 c23             G1 = 0
//! tip = (r cos q1, r sin q1, l2 s2 + l3 s23),    r = l2 c2 + l3 c23
//! ```
//!
//! There are two versions of the paper's arm. [`Parameters::PUBLISHED`] is the printed set: for the closed form,
//! for tests, and for comparison with an identification (through [`Parameters::base`] or through torques,
//! never entry by entry). The asset `paper3` is the physically consistent arm closest to it, for the simulator.
//!
//! Three observations on the printed parameters:
//! - `Iz1 = Ix2 - Iy2' = Ix3 - Iy3' = 0.0917` to the last digit, which is typical of a least-norm solution with
//!   columns in which `Iy2'` and `Iy3'` have the opposite sign to the others. Because `sin^2 + cos^2 = 1`, the
//!   columns are linearly dependent, so that ten combinations of the twelve can be identified.
//! - Link 3 is physically inconsistent: about its centre of mass, `Ix3` exceeds `Iy3 + Iz3`, and no change of
//!   the unidentifiable parameters can repair it. Link 2 can be consistent.
//! - The mass matrix is nevertheless positive definite over the whole workspace.

use supple_core::math::{Matrix3, Vector, Vector3, sin_cos};
use supple_core::{Body, Friction, Joint, Pose};

/// Parameters of the closed form. Moments of inertia \[kg m^2\] are about link frame axes at the
/// joint; those about y and z of links 2 and 3 include `m r^2`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// `Iz1`.
    pub iz1_kg_m2: f64,
    /// `Ix2`.
    pub ix2_kg_m2: f64,
    /// `Iy2'`.
    pub iy2_kg_m2: f64,
    /// `Iz2'`.
    pub iz2_kg_m2: f64,
    /// `m2r2`, first moment of link 2 along x \[kg m\].
    pub m2r2_kg_m: f64,
    /// `Ix3`.
    pub ix3_kg_m2: f64,
    /// `Iy3'`.
    pub iy3_kg_m2: f64,
    /// `Iz3'`.
    pub iz3_kg_m2: f64,
    /// `m3r3`, first moment of link 3 along x \[kg m\].
    pub m3r3_kg_m: f64,
    /// `m3` \[kg\].
    pub m3_kg: f64,
    /// `V` \[N m s/rad\].
    pub viscous_nm_s_per_rad: [f64; 3],
    /// `S` \[N m\].
    pub coulomb_nm: [f64; 3],
    /// Length of the upper arm \[m\].
    pub l2_m: f64,
    /// Length of the forearm, to the tip \[m\].
    pub l3_m: f64,
    /// `g` \[m/s^2\].
    pub g_m_per_s2: f64,
}

impl Parameters {
    /// The printed set. The link lengths are not in the paper; they are the lengths of the WAM, 0.55 m and 0.35 m.
    #[expect(clippy::approx_constant, reason = "m2r2 is a first moment, not pi / 4")]
    pub const PUBLISHED: Parameters = Parameters {
        iz1_kg_m2: 0.0917,
        ix2_kg_m2: 0.3331,
        iy2_kg_m2: 0.2414,
        iz2_kg_m2: 0.4255,
        m2r2_kg_m: 0.7853,
        ix3_kg_m2: 0.1939,
        iy3_kg_m2: 0.1022,
        iz3_kg_m2: 0.1058,
        m3r3_kg_m: 0.3798,
        m3_kg: 2.7069,
        viscous_nm_s_per_rad: [1.1643, 1.9823, 1.0211],
        coulomb_nm: [1.0233, 1.4985, 0.5837],
        l2_m: 0.55,
        l3_m: 0.35,
        g_m_per_s2: 9.81,
    };

    /// Returns `Psi` of the linear form, in the order of [`Parameters::PSI_NAMES`].
    pub fn psi(&self) -> [f64; 12] {
        let [v1, v2, v3] = self.viscous_nm_s_per_rad;
        [
            self.iz1_kg_m2,
            self.ix2_kg_m2,
            self.iz2_kg_m2,
            self.iy2_kg_m2,
            self.m2r2_kg_m,
            self.m3r3_kg_m,
            self.ix3_kg_m2,
            self.iy3_kg_m2,
            self.iz3_kg_m2,
            v1,
            v2,
            v3,
        ]
    }

    /// Names of the entries of [`Parameters::psi`].
    pub const PSI_NAMES: [&str; 12] = [
        "Iz1", "Ix2", "Iz2'", "Iy2'", "m2r2", "m3r3", "Ix3", "Iy3'", "Iz3'", "V1", "V2", "V3",
    ];

    /// Returns the ten combinations that torques can identify, with `m3` and `S` known, in the order of
    /// [`Parameters::BASE_NAMES`].
    pub fn base(&self) -> [f64; 10] {
        let [v1, v2, v3] = self.viscous_nm_s_per_rad;
        [
            self.iz1_kg_m2 + self.ix2_kg_m2 + self.ix3_kg_m2,
            self.iy2_kg_m2 - self.ix2_kg_m2,
            self.iy3_kg_m2 - self.ix3_kg_m2,
            self.iz2_kg_m2,
            self.iz3_kg_m2,
            self.m2r2_kg_m,
            self.m3r3_kg_m,
            v1,
            v2,
            v3,
        ]
    }

    /// Names of the entries of [`Parameters::base`].
    pub const BASE_NAMES: [&str; 10] = [
        "Iz1+Ix2+Ix3",
        "Iy2'-Ix2",
        "Iy3'-Ix3",
        "Iz2'",
        "Iz3'",
        "m2r2",
        "m3r3",
        "V1",
        "V2",
        "V3",
    ];

    /// Returns the friction of each joint, the continuous form (3.2) with the default band.
    pub fn friction(&self) -> [Friction; 3] {
        core::array::from_fn(|i| {
            Friction::coulomb(self.viscous_nm_s_per_rad[i], self.coulomb_nm[i])
        })
    }

    /// Returns `H(q)` \[kg m^2\].
    pub fn mass_matrix(&self, q: &Vector<3>) -> Matrix3<f64> {
        let t = Angles::of(q);
        let coupling = self.l2_m * self.m3r3_kg_m;
        let upper = self.m3_kg * self.l2_m * self.l2_m;
        let h11 = self.iz1_kg_m2
            + self.ix2_kg_m2 * t.s2 * t.s2
            + (self.iy2_kg_m2 + upper) * t.c2 * t.c2
            + self.ix3_kg_m2 * t.s23 * t.s23
            + self.iy3_kg_m2 * t.c23 * t.c23
            + 2.0 * coupling * t.c2 * t.c23;
        let h22 = self.iz2_kg_m2 + self.iz3_kg_m2 + upper + 2.0 * coupling * t.c3;
        let h23 = self.iz3_kg_m2 + coupling * t.c3;
        let h33 = self.iz3_kg_m2;
        Matrix3::new(h11, 0.0, 0.0, 0.0, h22, h23, 0.0, h23, h33)
    }

    /// Returns `C(q, qd)` of the Christoffel symbols of `H`: `H' - 2 C` is skew \[kg m^2/s\].
    pub fn coriolis_matrix(&self, q: &Vector<3>, qd: &Vector<3>) -> Matrix3<f64> {
        let slopes = self.mass_matrix_slopes(q);
        Matrix3::from_fn(|i, j| {
            let symbol = |k: usize| slopes[k][(i, j)] + slopes[j][(i, k)] - slopes[i][(j, k)];
            (0..3).map(|k| 0.5 * symbol(k) * qd[k]).sum()
        })
    }

    /// Returns `C(q, qd) qd` \[N m\].
    pub fn coriolis(&self, q: &Vector<3>, qd: &Vector<3>) -> Vector<3> {
        self.coriolis_matrix(q, qd) * qd
    }

    /// Returns `G(q)` \[N m\].
    pub fn gravity(&self, q: &Vector<3>) -> Vector<3> {
        let t = Angles::of(q);
        let forearm = self.m3r3_kg_m * t.c23;
        let shoulder = (self.m2r2_kg_m + self.m3_kg * self.l2_m) * t.c2 + forearm;
        Vector::<3>::new(0.0, shoulder, forearm) * self.g_m_per_s2
    }

    /// Returns `H qdd + C qd + G`, without friction \[N m\].
    pub fn inverse_dynamics(&self, q: &Vector<3>, qd: &Vector<3>, qdd: &Vector<3>) -> Vector<3> {
        self.mass_matrix(q) * qdd + self.coriolis(q, qd) + self.gravity(q)
    }

    /// Returns the position of the tip \[m\].
    pub fn tip(&self, q: &Vector<3>) -> Vector3<f64> {
        let t = Angles::of(q);
        let (s1, c1) = sin_cos(q[0]);
        let r = self.l2_m * t.c2 + self.l3_m * t.c23;
        Vector3::new(r * c1, r * s1, self.l2_m * t.s2 + self.l3_m * t.s23)
    }

    /// Returns bodies with these parameters, in the paper's frames, for [`supple_core::Arm::new`]
    /// with the tip at `(l3, 0, 0)`. Data that the parameters do not determine are chosen: link 1 is a ball of
    /// `m1_kg` about the origin, and all centres of mass lie on x. This function does not check the bodies: for the
    /// printed set, `Arm::new` rejects link 3.
    pub fn joints(&self, m1_kg: f64, m2_kg: f64) -> [Joint; 3] {
        let upright = Pose::from_xyz_rpy([0.0; 3], [core::f64::consts::FRAC_PI_2, 0.0, 0.0]);
        let elbow = Pose::from_translation(Vector3::new(self.l2_m, 0.0, 0.0));
        let link = |mass_kg: f64, first_moment: f64, [ix, iy, iz]: [f64; 3]| {
            let com = first_moment / mass_kg;
            let shift = first_moment * com;
            Body {
                mass_kg,
                com_m: Vector3::new(com, 0.0, 0.0),
                inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(ix, iy - shift, iz - shift)),
            }
        };
        let joint = |parent_from_link, body| Joint {
            parent_from_link,
            axis: Vector3::z(),
            body,
            armature_kg_m2: 0.0,
        };
        [
            joint(Pose::IDENTITY, link(m1_kg, 0.0, [self.iz1_kg_m2; 3])),
            joint(
                upright,
                link(
                    m2_kg,
                    self.m2r2_kg_m,
                    [self.ix2_kg_m2, self.iy2_kg_m2, self.iz2_kg_m2],
                ),
            ),
            joint(
                elbow,
                link(
                    self.m3_kg,
                    self.m3r3_kg_m,
                    [self.ix3_kg_m2, self.iy3_kg_m2, self.iz3_kg_m2],
                ),
            ),
        ]
    }

    /// Returns `dH/dq_k`, for each joint.
    fn mass_matrix_slopes(&self, q: &Vector<3>) -> [Matrix3<f64>; 3] {
        let t = Angles::of(q);
        let coupling = self.l2_m * self.m3r3_kg_m;
        let upper = self.m3_kg * self.l2_m * self.l2_m;
        let forearm = 2.0 * (self.ix3_kg_m2 - self.iy3_kg_m2) * t.s23 * t.c23;
        let by_q2 = 2.0 * (self.ix2_kg_m2 - self.iy2_kg_m2 - upper) * t.s2 * t.c2 + forearm
            - 2.0 * coupling * (t.s2 * t.c23 + t.c2 * t.s23);
        let by_q3 = forearm - 2.0 * coupling * t.c2 * t.s23;
        let bend = -coupling * t.s3;
        [
            Matrix3::zeros(),
            Matrix3::from_diagonal(&Vector3::new(by_q2, 0.0, 0.0)),
            Matrix3::new(by_q3, 0.0, 0.0, 0.0, 2.0 * bend, bend, 0.0, bend, 0.0),
        ]
    }
}

struct Angles {
    s2: f64,
    c2: f64,
    s3: f64,
    c3: f64,
    s23: f64,
    c23: f64,
}

impl Angles {
    fn of(q: &Vector<3>) -> Angles {
        let ((s2, c2), (s3, c3), (s23, c23)) = (sin_cos(q[1]), sin_cos(q[2]), sin_cos(q[1] + q[2]));
        Angles {
            s2,
            c2,
            s3,
            c3,
            s23,
            c23,
        }
    }
}
