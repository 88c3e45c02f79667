#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| supple_fuzz::damiao::damiao_request(data));
