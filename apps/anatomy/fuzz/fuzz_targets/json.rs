#![no_main]

include!("check.rs");

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| check(json::read(bytes)));
