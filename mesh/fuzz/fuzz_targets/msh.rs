#![no_main]

include!("check.rs");

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| check(Format::Msh41, read_bytes(Format::Msh41, bytes)));
