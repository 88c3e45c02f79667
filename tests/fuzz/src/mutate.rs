//! Seeded mutations of inputs: what the test on the stable compiler tries in the place of a fuzzer.

/// Bytes that programs go wrong on.
const BYTES: [u8; 12] = [
    0, 1, 2, 0x7f, 0x80, 0xfe, 0xff, b'-', b'9', b'e', b'<', b'\n',
];
/// The same, longer: whole numbers and floats, little-endian, and texts.
const RUNS: [&[u8]; 16] = [
    &u64::MAX.to_le_bytes(),
    &i64::MAX.to_le_bytes(),
    &u32::MAX.to_le_bytes(),
    &0_u64.to_le_bytes(),
    &f64::NAN.to_le_bytes(),
    &f64::INFINITY.to_le_bytes(),
    &f64::MAX.to_le_bytes(),
    &5e-324_f64.to_le_bytes(),
    &1e300_f64.to_le_bytes(),
    b"1e300",
    b"-1e-300",
    b"nan",
    b"18446744073709551616",
    b"\"",
    b"[[",
    "\u{1d4d0}".as_bytes(),
];
/// Longest input that is made.
const LONGEST: usize = 1 << 16;

/// Numbers without a pattern, the same ones for the same seed (splitmix64).
#[derive(Clone, Debug)]
pub struct Random(pub u64);

impl Random {
    /// The next one.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Below `end`, which is not zero.
    pub fn below(&mut self, end: usize) -> usize {
        (self.bits() % end.max(1) as u64) as usize
    }
}

/// One of the inputs, changed in one to four places.
pub fn mutated(random: &mut Random, inputs: &[Vec<u8>]) -> Vec<u8> {
    let mut input = inputs[random.below(inputs.len())].clone();
    for _ in 0..=random.below(4) {
        change(random, &mut input, inputs);
    }
    input.truncate(LONGEST);
    input
}

fn change(random: &mut Random, input: &mut Vec<u8>, inputs: &[Vec<u8>]) {
    let place = random.below(input.len() + 1);
    let rest = input.len() - place;
    match random.below(9) {
        0 if rest > 0 => input[place] ^= 1 << random.below(8),
        1 if rest > 0 => input[place] = BYTES[random.below(BYTES.len())],
        2 if rest > 0 => input[place] = random.bits() as u8,
        3 => {
            let run = RUNS[random.below(RUNS.len())];
            let covered = run.len().min(rest);
            input.splice(place..place + covered, run.iter().copied());
        }
        4 => {
            let run = RUNS[random.below(RUNS.len())];
            input.splice(place..place, run.iter().copied());
        }
        5 => input.truncate(place),
        6 => {
            let gone = random.below(rest.min(64) + 1);
            input.drain(place..place + gone);
        }
        7 => {
            // A part of any input, in the place of what is here or between.
            let other = &inputs[random.below(inputs.len())];
            let from = random.below(other.len() + 1);
            let length = random.below((other.len() - from).min(512) + 1);
            let covered = random.below(rest.min(length) + 1);
            let part = other[from..from + length].iter().copied();
            input.splice(place..place + covered, part);
        }
        _ => {
            let length = random.below(rest.min(64) + 1);
            let part = input[place..place + length].repeat(1 + random.below(3));
            input.splice(place..place, part);
        }
    }
}
