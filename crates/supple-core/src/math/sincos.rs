//! Branch-free sines and cosines of all joints, four joints at a time.
//!
//! `x = n pi/2 + r`: `pi/2` is subtracted in parts whose products with `n` are exact (Cody and
//! Waite): two with fused multiply-add, otherwise three, of which two are short. `r` is stored as a
//! double-double. On `|r| <= pi/4` sine and cosine are polynomials in `r^2`, interpolated at
//! Chebyshev points so that they are off by less than 0.06 units in the last place; with rounding
//! both results are within 1 unit (`tests/control_core/sincos.rs`). Beyond [`MAX_ANGLE_RAD`], and
//! for values that are not finite, `libm` is used.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::math::lanes::{Column, FUSED, Lanes, Number, column, in_groups, per_joint, splat};
use bytemuck::cast;
use core::f64::consts::{FRAC_2_PI, FRAC_PI_2};
use wide::u64x4;

/// Maximum angle for the polynomials \[rad\]: 159,000 revolutions of a joint.
pub const MAX_ANGLE_RAD: f64 = 1e6;

const SIGN: u64 = 1 << 63;
/// Adding and subtracting this number rounds to an integer, whose lowest bits are the lowest bits
/// of the sum.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// The first 33 bits of pi/2, the next 33, and the rest.
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];
/// Difference of pi/2 and its nearest `f64`.
const BEYOND_HALF_PI: f64 = 6.123_233_995_736_766e-17;
/// `(sin(r) - r) / r^3` in powers of `r^2`.
const SINE: [f64; 6] = [
    -0.166_666_666_666_666_32,
    0.008_333_333_333_322_413,
    -0.000_198_412_698_298_074_9,
    2.755_731_369_198_108e-6,
    -2.505_075_814_911_691e-8,
    1.589_679_886_229_076_8e-10,
];
/// `(cos(r) - 1 + r^2 / 2) / r^4` in powers of `r^2`.
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_664,
    -0.001_388_888_888_888_739_8,
    2.480_158_729_876_456e-5,
    -2.755_731_727_114_514_4e-7,
    2.087_614_614_655_861e-9,
    -1.138_262_364_747_460_4e-11,
];

/// Sines and cosines of angles in radians. Each depends on its own angle alone.
pub fn sin_cos_all<const N: usize>(angles_rad: &[f64; N]) -> ([f64; N], [f64; N]) {
    in_groups!(N, of_numbers(angles_rad))
}

fn of_numbers<const N: usize, const G: usize>(angles_rad: &[f64; N]) -> ([f64; N], [f64; N]) {
    let [sines, cosines] = sin_cos(&column::<N, G>(angles_rad));
    (per_joint(&sines), per_joint(&cosines))
}

/// Sines, then cosines.
#[inline(always)]
pub(crate) fn sin_cos<const G: usize>(angles_rad: &Column<G>) -> [Column<G>; 2] {
    let [mut sines, mut cosines] = [[Lanes::ZERO; G]; 2];
    let mut all_near = Lanes::splat(f64::from_bits(u64::MAX));
    for group in 0..G {
        let x = angles_rad[group];
        (sines[group], cosines[group]) = near(x);
        all_near &= x.abs().simd_le(Lanes::splat(MAX_ANGLE_RAD));
    }
    if !all_near.all() {
        replace_far(angles_rad, &mut sines, &mut cosines);
    }
    [sines, cosines]
}

#[cold]
fn replace_far(angles_rad: &[Lanes], sines: &mut [Lanes], cosines: &mut [Lanes]) {
    for ((angle, sine), cosine) in angles_rad.iter().zip(sines).zip(cosines) {
        let lanes = sine.as_mut_array().iter_mut().zip(cosine.as_mut_array());
        for (angle, (sine, cosine)) in angle.as_array().iter().zip(lanes) {
            if !(-MAX_ANGLE_RAD..=MAX_ANGLE_RAD).contains(angle) {
                (*sine, *cosine) = libm::sincos(*angle);
            }
        }
    }
}

/// Returns the sine and cosine of angles no greater than [`MAX_ANGLE_RAD`].
#[inline(always)]
fn near(x: Lanes) -> (Lanes, Lanes) {
    let shifted = Number::multiply_add(x, Lanes::splat(FRAC_2_PI), Lanes::splat(ROUND));
    let n = shifted - Lanes::splat(ROUND);
    let (r, tail) = if FUSED {
        let beyond = Lanes::splat(BEYOND_HALF_PI);
        let coarse = Number::multiply_add(-n, Lanes::splat(FRAC_PI_2), x);
        let r = Number::multiply_add(-n, beyond, coarse);
        (r, Number::multiply_add(-n, beyond, coarse - r))
    } else {
        let [a, b, c] = splat(HALF_PI);
        let first = x - n * a;
        let second = n * b;
        let coarse = first - second;
        let rest = n * c - ((first - coarse) - second);
        let r = coarse - rest;
        (r, (coarse - r) - rest)
    };

    let z = r * r;
    let sine = polynomial(z, &SINE);
    let cosine = polynomial(z, &COSINE);
    let half = Lanes::splat(0.5) * z;
    let one = Lanes::splat(1.0) - half;
    let sine = r + Number::multiply_add(z * r, sine, tail * one);
    let rounded = (Lanes::splat(1.0) - one) - half;
    let cosine = one + (rounded + Number::multiply_add(z * z, cosine, -(r * tail)));

    let quadrant: u64x4 = cast(shifted);
    let odd: Lanes = cast(u64x4::ZERO - (quadrant & u64x4::splat(1)));
    let sign = |quadrant: u64x4| cast::<_, Lanes>((quadrant << 62_u64) & u64x4::splat(SIGN));
    (
        odd.bitselect(cosine, sine) ^ sign(quadrant),
        odd.bitselect(sine, cosine) ^ sign(quadrant + u64x4::splat(1)),
    )
}

/// Evaluates even and odd powers separately, for instruction-level parallelism.
#[inline(always)]
fn polynomial(z: Lanes, coefficients: &[f64; 6]) -> Lanes {
    let c = splat(*coefficients);
    let w = z * z;
    let even = Number::multiply_add(w, Number::multiply_add(w, c[4], c[2]), c[0]);
    let odd = Number::multiply_add(w, Number::multiply_add(w, c[5], c[3]), c[1]);
    Number::multiply_add(z, odd, even)
}
