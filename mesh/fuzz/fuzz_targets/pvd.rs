#![no_main]

use stylet_mesh::io::Collection;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| match Collection::from_bytes(bytes) {
    Ok(collection) => assert!(collection.frames().iter().all(|(time, _)| time.is_finite())),
    Err(error) => assert!(!error.to_string().is_empty()),
});
