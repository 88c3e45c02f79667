#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| supple_fuzz::messages::torque_command(data));
