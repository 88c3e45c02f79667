//! Sines and cosines of all joints at once, without branches, so that the compiler takes several joints in
//! one instruction.
//!
//! `x = n pi/2 + r`: `pi/2` is subtracted in parts whose products with `n` are exact (Cody and Waite): two
//! where there is fused multiply-add, else three, of which two are short. `r` is kept in two words. On `|r| <= pi/4` sine and cosine are
//! polynomials in `r^2`, interpolated at Chebyshev points so that they are off by less than 0.06 units in
//! the last place; with rounding both results are within 1 unit (`tests/sincos.rs`). Beyond
//! [`GREATEST_RAD`], and for what is not finite, `libm` is asked.
#![allow(
    clippy::needless_range_loop,
    reason = "joints, groups and lanes are counted: each index goes into several arrays"
)]

use crate::lanes::{FUSED, Number};

/// Greatest angle that the polynomials are used for \[rad\]: a joint that has turned 159,000 times.
pub const GREATEST_RAD: f64 = 1e6;

const SIGN: u64 = 1 << 63;
/// Adding and subtracting it rounds to a whole number, whose lowest bits are then the sum's lowest bits.
const ROUND: f64 = 6_755_399_441_055_744.0;
/// The first 33 bits of pi/2, the next 33, and the rest.
const HALF_PI: [f64; 3] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_795_950_6e-21,
];
/// What pi/2 is more than its nearest `f64`.
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
#[inline(always)]
pub fn sin_cos_all<const N: usize>(angles_rad: &[f64; N]) -> ([f64; N], [f64; N]) {
    let (mut sines, mut cosines) = ([0.0; N], [0.0; N]);
    let mut greatest = 0.0;
    for i in 0..N {
        (sines[i], cosines[i]) = near(angles_rad[i]);
        let size = f64::from_bits(angles_rad[i].to_bits() & !SIGN);
        greatest = if size <= greatest { greatest } else { size };
    }
    if is_far(greatest) {
        replace_far(angles_rad, &mut sines, &mut cosines);
    }
    (sines, cosines)
}

#[inline]
fn is_far(angle_rad: f64) -> bool {
    !(-GREATEST_RAD..=GREATEST_RAD).contains(&angle_rad)
}

#[cold]
fn replace_far(angles_rad: &[f64], sines: &mut [f64], cosines: &mut [f64]) {
    for ((angle, sine), cosine) in angles_rad.iter().zip(sines).zip(cosines) {
        if is_far(*angle) {
            (*sine, *cosine) = libm::sincos(*angle);
        }
    }
}

/// Sine and cosine of an angle no greater than [`GREATEST_RAD`].
#[inline(always)]
fn near(x: f64) -> (f64, f64) {
    let shifted = x.times_plus(core::f64::consts::FRAC_2_PI, ROUND);
    let n = shifted - ROUND;
    let (r, tail) = if FUSED {
        let coarse = (-n).times_plus(core::f64::consts::FRAC_PI_2, x);
        let r = (-n).times_plus(BEYOND_HALF_PI, coarse);
        (r, (-n).times_plus(BEYOND_HALF_PI, coarse - r))
    } else {
        let first = x - n * HALF_PI[0];
        let second = n * HALF_PI[1];
        let coarse = first - second;
        let rest = n * HALF_PI[2] - ((first - coarse) - second);
        let r = coarse - rest;
        (r, (coarse - r) - rest)
    };

    let z = r * r;
    let sine = polynomial(z, &SINE);
    let cosine = polynomial(z, &COSINE);
    let half = 0.5 * z;
    let one = 1.0 - half;
    let sine = r + (z * r).times_plus(sine, tail * one);
    let cosine = one + (((1.0 - one) - half) + (z * z).times_plus(cosine, -(r * tail)));

    let quadrant = shifted.to_bits();
    let odd = quadrant & 1 != 0;
    let (s, c) = if odd { (cosine, sine) } else { (sine, cosine) };
    let sign_of_sine = (quadrant & 2) << 62;
    let sign_of_cosine = (quadrant.wrapping_add(1) & 2) << 62;
    (
        f64::from_bits(s.to_bits() ^ sign_of_sine),
        f64::from_bits(c.to_bits() ^ sign_of_cosine),
    )
}

/// Even and odd powers apart, so that they are added at the same time.
#[inline(always)]
fn polynomial(z: f64, c: &[f64; 6]) -> f64 {
    let w = z * z;
    let even = w.times_plus(w.times_plus(c[4], c[2]), c[0]);
    let odd = w.times_plus(w.times_plus(c[5], c[3]), c[1]);
    z.times_plus(odd, even)
}
