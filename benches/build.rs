//! Records what a bench report names: the revision, the compiler, the versions of the libraries it is compared with.

use std::process::Command;

fn main() {
    let revision = output_of("git", &["rev-parse", "--short=12", "HEAD"]);
    let rustc = output_of(&std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned()), &["--version"]);
    println!("cargo:rustc-env=STYLET_REVISION={revision}");
    println!("cargo:rustc-env=STYLET_RUSTC={rustc}");
    println!("cargo:rustc-env=STYLET_PEERS={}", versions(&["faer", "sprs"]));
    println!("cargo:rerun-if-changed=../.git/HEAD");
    println!("cargo:rerun-if-changed=../.git/refs/heads");
    println!("cargo:rerun-if-changed=../Cargo.lock");
}

/// What a program prints, or `unknown`.
fn output_of(program: &str, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output().ok().filter(|output| output.status.success());
    let text = output.and_then(|output| String::from_utf8(output.stdout).ok());
    text.map_or_else(|| "unknown".to_owned(), |text| text.trim().to_owned())
}

/// Names and versions of packages, as the lock file has them.
fn versions(packages: &[&str]) -> String {
    let lock = std::fs::read_to_string("../Cargo.lock").unwrap_or_default();
    let version = |package: &&str| {
        let (_, after) = lock.split_once(&format!("name = \"{package}\"\nversion = \""))?;
        Some(format!("{package} {}", after.split('"').next()?))
    };
    packages.iter().filter_map(version).collect::<Vec<_>>().join(", ")
}
