//! Seeded mutations of inputs; the test on the stable compiler uses them instead of a fuzzer.

pub use supple_random::Random;

/// Byte values that often trigger bugs.
const BYTES: [u8; 12] = [
    0, 1, 2, 0x7f, 0x80, 0xfe, 0xff, b'-', b'9', b'e', b'<', b'\n',
];
/// Byte sequences that often trigger bugs: little-endian integers and floats, and texts.
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
/// Maximum size of a mutated input.
const MAX_INPUT_BYTES: usize = 1 << 16;

/// Returns one of the inputs with one to four changes.
pub fn mutated(random: &mut Random, inputs: &[Vec<u8>]) -> Vec<u8> {
    let mut input = inputs[random.index(inputs.len())].clone();
    for _ in 0..=random.index(4) {
        change(random, &mut input, inputs);
    }
    input.truncate(MAX_INPUT_BYTES);
    input
}

fn change(random: &mut Random, input: &mut Vec<u8>, inputs: &[Vec<u8>]) {
    let index = random.index(input.len() + 1);
    let rest = input.len() - index;
    match random.index(9) {
        0 if rest > 0 => input[index] ^= 1 << random.index(8),
        1 if rest > 0 => input[index] = BYTES[random.index(BYTES.len())],
        2 if rest > 0 => input[index] = random.bits() as u8,
        3 => {
            let run = RUNS[random.index(RUNS.len())];
            let covered = run.len().min(rest);
            input.splice(index..index + covered, run.iter().copied());
        }
        4 => {
            let run = RUNS[random.index(RUNS.len())];
            input.splice(index..index, run.iter().copied());
        }
        5 => input.truncate(index),
        6 => {
            let gone = random.index(rest.min(64) + 1);
            input.drain(index..index + gone);
        }
        7 => {
            // A part of any input is inserted here, or replaces bytes.
            let other = &inputs[random.index(inputs.len())];
            let from = random.index(other.len() + 1);
            let length = random.index((other.len() - from).min(512) + 1);
            let covered = random.index(rest.min(length) + 1);
            let part = other[from..from + length].iter().copied();
            input.splice(index..index + covered, part);
        }
        _ => {
            let length = random.index(rest.min(64) + 1);
            let part = input[index..index + length].repeat(1 + random.index(3));
            input.splice(index..index, part);
        }
    }
}
