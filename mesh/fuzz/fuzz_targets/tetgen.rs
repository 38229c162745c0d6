#![no_main]

include!("check.rs");

use stylet_mesh::io::{TetgenFiles, read_tetgen};

// The files one after the other, with a line of "%" between them.
libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut files = bytes.split(|&b| b == b'%');
    let node = files.next().unwrap_or_default();
    let files = TetgenFiles { node, ele: files.next(), face: files.next(), edge: files.next() };
    check(Format::Tetgen, read_tetgen(&files));
    let _ = read_bytes(Format::Tetgen, bytes);
});
