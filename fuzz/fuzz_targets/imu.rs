#![no_main]

libfuzzer_sys::fuzz_target!(|input: &[u8]| nemoral_fuzz_targets::imu(input));
