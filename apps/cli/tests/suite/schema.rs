//! The reference of all keys in the documentation is what the program prints.

use crate::support::Folder;
use std::path::PathBuf;

/// What precedes the keys in the file.
const HEAD: &str = "# Keys of a scene file\n\nWhat `stylet scenes --schema` prints; a test keeps it so.\n\n";

/// To regenerate the file after a change of keys: `UPDATE_DOCS=1 cargo test -p stylet-cli --test schema`.
#[test]
fn the_documented_keys_are_those_of_the_program() {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../docs/keys.md");
    let expected = HEAD.to_owned() + &Folder::new().succeed("scenes --schema");
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, &expected).unwrap();
    }
    let found = std::fs::read_to_string(&path).unwrap_or_default();
    let differs = expected.lines().zip(found.lines()).position(|(a, b)| a != b);
    let at = 1 + differs.unwrap_or_else(|| expected.lines().count().min(found.lines().count()));
    assert!(
        found == expected,
        "docs/keys.md differs from `stylet scenes --schema` at line {at}: found\n{}\nexpected\n{}\n\
         To regenerate it: UPDATE_DOCS=1 cargo test -p stylet-cli --test schema",
        found.lines().nth(at - 1).unwrap_or("(its end)"),
        expected.lines().nth(at - 1).unwrap_or("(its end)"),
    );
}
