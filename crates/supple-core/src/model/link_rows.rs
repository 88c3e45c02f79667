//! The links of an arm stored by rows, the storage order of [`crate::math::lanes`].

use crate::math::lanes::{LANES, Lanes, Rows};
use crate::model::link::Link;
use core::array::from_fn;

/// Rotation of the joint frame in its parent's at `q = 0`, by columns; then its origin there.
const PARENT_FROM_JOINT: usize = 0;
/// Mass, first moment, and inertia `xx, xy, yy, xz, yz, zz`, in the joint frame.
const BODY: usize = 12;
/// Rotation of the joint frame in the link frame, by columns.
const LINK_FROM_JOINT: usize = 22;
/// Centre of mass, and inertia about it `xx, xy, yy, xz, yz, zz`, in the joint frame.
const CENTRAL: usize = 31;
/// Padding: the last group of the last row is read beyond its end.
const ROWS: usize = 40 + LANES - 1;

/// Constants of the links, one row per constant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinkRows<const N: usize> {
    rows: [[f64; N]; ROWS],
}

impl<const N: usize> LinkRows<N> {
    pub fn new(links: &[Link; N]) -> Self {
        let mut rows = [[0.0; N]; ROWS];
        for (i, link) in links.iter().enumerate() {
            let pose = &link.parent_from_joint;
            let mut put = |first: usize, numbers: &[f64]| {
                for (row, x) in rows[first..].iter_mut().zip(numbers) {
                    row[i] = *x;
                }
            };
            let (inertia, central) = (&link.inertia, link.body());
            put(PARENT_FROM_JOINT, pose.rotation.as_slice());
            put(PARENT_FROM_JOINT + 9, pose.translation.as_slice());
            put(BODY, &[link.mass]);
            put(BODY + 1, link.first_moment.as_slice());
            let entries = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];
            put(BODY + 4, &entries.map(|entry| inertia[entry]));
            put(LINK_FROM_JOINT, link.link_from_joint.as_slice());
            put(CENTRAL, central.com_m.as_slice());
            put(
                CENTRAL + 3,
                &entries.map(|entry| central.inertia_kg_m2[entry]),
            );
        }
        LinkRows { rows }
    }

    /// Returns the rotation of each joint frame in its parent's at `q = 0`, by columns. Beyond the last joint:
    /// arbitrary finite values.
    #[inline(always)]
    pub fn rotations<const G: usize>(&self) -> Rows<9, G> {
        self.groups(PARENT_FROM_JOINT)
    }

    /// Returns the origin of each joint frame in its parent's. Beyond the last joint: arbitrary finite values.
    #[inline(always)]
    pub fn origins<const G: usize>(&self) -> Rows<3, G> {
        self.groups(PARENT_FROM_JOINT + 9)
    }

    /// Returns the rotation of each joint frame in its link frame, by columns. Beyond the last joint: arbitrary
    /// finite values.
    #[inline(always)]
    pub fn links_from_joints<const G: usize>(&self) -> Rows<9, G> {
        self.groups(LINK_FROM_JOINT)
    }

    /// Returns each link's ten numbers. Beyond the last joint: zeros.
    #[inline(always)]
    pub fn bodies<const G: usize>(&self) -> Rows<10, G> {
        only_joints::<10, N, G>(self.groups(BODY))
    }

    /// Returns each link's mass. Beyond the last joint: zeros.
    #[inline(always)]
    pub fn masses<const G: usize>(&self) -> Rows<1, G> {
        only_joints::<1, N, G>(self.groups(BODY))
    }

    /// Returns each link's centre of mass, then its inertia about it. Beyond the last joint: zeros.
    #[inline(always)]
    pub fn central<const G: usize>(&self) -> Rows<9, G> {
        only_joints::<9, N, G>(self.groups(CENTRAL))
    }

    /// Returns the inertial parameter `k` of link `i`: 0 its mass, 1 to 3 its first moment, 4 to 9 its inertia
    /// `xx, xy, yy, xz, yz, zz` about the origin of the joint frame.
    #[inline(always)]
    pub fn inertial_parameter(&self, k: usize, i: usize) -> f64 {
        self.rows[BODY + k][i]
    }

    #[inline(always)]
    fn groups<const K: usize, const G: usize>(&self, first: usize) -> Rows<K, G> {
        let numbers = self.rows.as_flattened();
        let mut out = [[Lanes::ZERO; G]; K];
        for (k, row) in out.iter_mut().enumerate() {
            for (group, x) in row.iter_mut().enumerate() {
                let begin = (first + k) * N + group * LANES;
                if group * LANES < N {
                    let n = &numbers[begin..begin + LANES];
                    *x = Lanes::new([n[0], n[1], n[2], n[3]]);
                }
            }
        }
        out
    }
}

/// Sets the lanes beyond the last joint to zero.
#[inline(always)]
fn only_joints<const K: usize, const N: usize, const G: usize>(mut rows: Rows<K, G>) -> Rows<K, G> {
    for row in &mut rows {
        for (group, x) in row.iter_mut().enumerate() {
            *x &= joints::<N>(group);
        }
    }
    rows
}

/// Returns the mask with all bits set in the lanes that have a joint.
#[inline(always)]
fn joints<const N: usize>(group: usize) -> Lanes {
    let all = f64::from_bits(u64::MAX);
    Lanes::new(from_fn(
        |lane| if group * LANES + lane < N { all } else { 0.0 },
    ))
}
