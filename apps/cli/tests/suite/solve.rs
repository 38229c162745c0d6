//! `stylet solve`.

use crate::support::{Folder, json, refuses, stderr};
use serde_json::Value;
use std::path::Path;

/// The files that SciPy wrote: a 4 x 4 grid, a load and two constraints.
fn samples() -> Folder {
    let folder = Folder::new();
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../solver/tests/data/matrix_market");
    for (from, to) in [("poisson-4x4.mtx", "A.mtx"), ("load.mtx", "b.mtx"), ("constraints.mtx", "C.mtx")] {
        std::fs::copy(data.join(from), folder.path().join(to)).unwrap();
    }
    folder.file("d.mtx", "%%MatrixMarket matrix array real general\n2 1\n0.5\n-0.25\n");
    folder
}

/// Entries of a coordinate or an array file, rows and columns from 0, symmetric ones mirrored.
fn entries(text: &str) -> (usize, Vec<(usize, usize, f64)>) {
    let mut lines = text.lines();
    let banner = lines.next().unwrap();
    let mut numbers = lines
        .filter(|line| !line.starts_with('%'))
        .map(|line| line.split_whitespace().map(|word| word.parse().unwrap()).collect::<Vec<f64>>());
    let n = numbers.next().unwrap()[0] as usize;
    let mut found = Vec::new();
    for (row, line) in numbers.enumerate() {
        let (i, j, value) =
            if line.len() == 1 { (row, 0, line[0]) } else { (line[0] as usize - 1, line[1] as usize - 1, line[2]) };
        found.push((i, j, value));
        if banner.contains("symmetric") && i != j {
            found.push((j, i, value));
        }
    }
    (n, found)
}

fn vector(folder: &Folder, name: &str) -> Vec<f64> {
    entries(&folder.read(name)).1.into_iter().map(|(_, _, value)| value).collect()
}

fn product(folder: &Folder, name: &str, x: &[f64]) -> Vec<f64> {
    let (n, entries) = entries(&folder.read(name));
    let mut y = vec![0.0; n];
    entries.into_iter().for_each(|(i, j, value)| y[i] += value * x[j]);
    y
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

const PRECONDITIONERS: [&str; 8] =
    ["none", "jacobi", "block-jacobi", "ssor", "ic0", "chebyshev", "two-level", "smoothed-aggregation"];

#[test]
fn every_method_with_every_preconditioner_solves_a_file_of_scipy() {
    let folder = samples();
    let mut runs =
        vec!["--method cholesky".to_owned(), "--method ldlt".to_owned(), "--method lblt".to_owned(), String::new()];
    for method in ["cholesky", "ldlt", "lblt"] {
        runs.push(format!("--method {method} --precision mixed"));
    }
    for precond in ["none", "block-jacobi"] {
        runs.push(format!("--precond {precond} --precision mixed --block 2"));
    }
    for precond in PRECONDITIONERS {
        for method in ["cg", "minres"] {
            for block in [1, 2] {
                runs.push(format!("--method {method} --precond {precond} --block {block}"));
            }
        }
    }
    let b = vector(&folder, "b.mtx");
    for run in runs {
        let report = json(&folder.succeed(&format!("solve A.mtx b.mtx {run} --tol 1e-10 --out x.mtx --json --quiet")));
        assert_eq!(
            (&report["converged"], &report["rows"], &report["nonzeros"]),
            (&Value::Bool(true), &16.into(), &64.into())
        );
        let x = vector(&folder, "x.mtx");
        let error = distance(&product(&folder, "A.mtx", &x), &b) / distance(&b, &[0.0; 16]);
        assert!(error <= 1.1e-10, "{run}: {error:e}");
        let reported = report["relative_residual"].as_f64().unwrap();
        assert!((reported - error).abs() <= 1e-14, "{run}: {reported:e} reported, {error:e} found");
    }
}

#[test]
fn every_constrained_method_finds_the_same_minimum() {
    let folder = samples();
    let mut runs: Vec<String> = [
        "",
        "--method null-space",
        "--method ldlt",
        "--method lblt",
        "--method lblt --precision mixed",
        "--method kkt-cg",
    ]
    .map(str::to_owned)
    .to_vec();
    for precond in PRECONDITIONERS {
        runs.push(format!("--method minres --precond {precond}"));
        runs.push(format!("--method kkt-cg --precond {precond} --block 2"));
    }
    let d = vector(&folder, "d.mtx");
    let mut first: Option<Vec<f64>> = None;
    for run in runs {
        let command = format!(
            "solve A.mtx b.mtx --constraints C.mtx --constraint-rhs d.mtx {run} --tol 1e-11 --out x.mtx --json --quiet"
        );
        let report = json(&folder.succeed(&command));
        assert_eq!((&report["converged"], &report["constraints"]), (&Value::Bool(true), &2.into()), "{run}");
        assert!(report["constraint_residual"].as_f64().unwrap() <= 1.02e-11, "{run}");
        let x = vector(&folder, "x.mtx");
        assert!(distance(&product(&folder, "C.mtx", &x), &d) <= 1e-10, "{run}");
        let first = first.get_or_insert_with(|| x.clone());
        assert!(distance(&x, first) <= 1e-9, "{run}: {:e}", distance(&x, first));
    }
    // And it is the minimum: the residual is a combination of the rows of C, which have entries in columns 0, 5 and 15.
    let x = first.unwrap();
    let b = vector(&folder, "b.mtx");
    let r: Vec<f64> = product(&folder, "A.mtx", &x).iter().zip(&b).map(|(ax, b)| b - ax).collect();
    assert!((r[0] + r[5]).abs() <= 1e-9 && r[0].abs() > 1e-3);
    assert!((0..16).filter(|i| ![0, 5, 15].contains(i)).all(|i| r[i].abs() <= 1e-9), "{r:?}");
}

#[test]
fn prescribed_displacements_alone_are_a_load() {
    let folder = samples();
    folder.file("zero.mtx", "%%MatrixMarket matrix coordinate real general\n16 1 0\n");
    for method in ["projected-cg", "null-space", "minres", "lblt"] {
        let command = format!(
            "solve A.mtx zero.mtx --constraints C.mtx --constraint-rhs d.mtx --method {method} --json --quiet --out x.mtx"
        );
        let report = json(&folder.succeed(&command));
        assert_eq!(report["converged"], true, "{method}");
        assert!((vector(&folder, "x.mtx")[15] + 2.5).abs() < 1e-6);
    }
}

/// A plate of 4 x 3 nodes in the plane: springs along edges and diagonals, held by springs to the ground.
fn plate(folder: &Folder) {
    let (nx, ny) = (4usize, 3usize);
    let mut a = vec![vec![0.0; 2 * nx * ny]; 2 * nx * ny];
    let mut coordinates = "# x y\n".to_owned();
    for v in 0..nx * ny {
        let (x, y) = (v % nx, v / nx);
        coordinates += &format!("{x}.0, {y}.5\n");
        (0..2).for_each(|k| a[2 * v + k][2 * v + k] += if x == 0 { 10.0 } else { 0.0 });
        for (dx, dy) in [(1i32, 0i32), (0, 1), (1, 1), (1, -1)] {
            let (i, j) = (x as i32 + dx, y as i32 + dy);
            if i < nx as i32 && (0..ny as i32).contains(&j) {
                let w = (j as usize) * nx + i as usize;
                let direction = [f64::from(dx), f64::from(dy)];
                for k in 0..2 {
                    for l in 0..2 {
                        let s = direction[k] * direction[l];
                        a[2 * v + k][2 * v + l] += s;
                        a[2 * w + k][2 * w + l] += s;
                        a[2 * v + k][2 * w + l] -= s;
                        a[2 * w + k][2 * v + l] -= s;
                    }
                }
            }
        }
    }
    let stored: Vec<String> = (0..a.len())
        .flat_map(|i| (0..=i).map(move |j| (i, j)))
        .filter(|&(i, j)| a[i][j] != 0.0)
        .map(|(i, j)| format!("{} {} {}", i + 1, j + 1, a[i][j]))
        .collect();
    let n = a.len();
    folder.file(
        "K.mtx",
        format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {}\n{}\n", stored.len(), stored.join("\n")),
    );
    folder.file("nodes.txt", coordinates);
}

#[test]
fn coordinates_give_the_block_size_and_rigid_moves() {
    let folder = Folder::new();
    plate(&folder);
    for precond in ["two-level", "smoothed-aggregation", "block-jacobi"] {
        let report =
            json(&folder.succeed(&format!("solve K.mtx --coords nodes.txt --precond {precond} --json --quiet")));
        assert_eq!(
            (&report["block"], &report["converged"], &report["precond"]),
            (&2.into(), &true.into(), &precond.into())
        );
    }
    refuses(
        &folder,
        "solve K.mtx --coords nodes.txt --block 3",
        &["--block: found 3", "2 numbers a line", "expected 2"],
    );
    folder.file("few.txt", "0 0\n1 0\n");
    refuses(&folder, "solve K.mtx --coords few.txt", &["few.txt: 2 nodes, expected 12", "K.mtx has 24 rows"]);
    for (text, parts) in [
        ("0 0\n1 0 0\n", &["bad.txt, line 2: 3 numbers, expected 2"][..]),
        ("0\n", &["bad.txt, line 1: 1 numbers, expected 2 or 3"]),
        ("% c\n\n0 nan\n", &["bad.txt, line 3: found nan, expected a finite number"]),
        ("# nothing\n", &["bad.txt: no coordinates"]),
    ] {
        folder.file("bad.txt", text);
        refuses(&folder, "solve K.mtx --coords bad.txt", parts);
    }
    folder.file("bytes.txt", b"0 0\n\xff\n");
    refuses(&folder, "solve K.mtx --coords bytes.txt", &["bytes.txt, line 2"]);
}

#[test]
fn json_is_one_object_with_all_keys() {
    let folder = samples();
    let output = folder.run("solve A.mtx --json --repeat 3 --threads 2");
    let report = json(std::str::from_utf8(&output.stdout).unwrap());
    for key in ["setup_s", "solve_s", "relative_residual", "product_gb_s"] {
        assert!(report[key].as_f64().is_some_and(|x| x >= 0.0), "{key}: {}", report[key]);
    }
    for key in ["iterations", "rows", "nonzeros", "matrix_bytes"] {
        assert!(report[key].as_u64().is_some_and(|n| n > 0), "{key}: {}", report[key]);
    }
    assert_eq!((&report["converged"], &report["repeats"], &report["threads"]), (&true.into(), &3.into(), &2.into()));
    assert_eq!(
        (&report["method"], &report["precond"], &report["reason"]),
        (&"cg".into(), &"block-jacobi".into(), &Value::Null)
    );
    assert!(folder.succeed("solve A.mtx b.mtx --quiet").contains("cg with block-jacobi"));
    // The same bits on any number of threads.
    let x = |threads| {
        folder.succeed(&format!("solve A.mtx b.mtx --precond ssor --threads {threads} --quiet --out x.mtx"));
        folder.read("x.mtx")
    };
    assert_eq!(x(1), x(8));
}

fn fails(folder: &Folder, arguments: &str, parts: &[&str]) -> Value {
    let output = folder.run(&format!("{arguments} --json --quiet"));
    let line = stderr(&output);
    assert_eq!(output.status.code(), Some(3), "stylet {arguments}: {line}");
    assert!(line.lines().count() == 1 && parts.iter().all(|part| line.contains(part)), "stylet {arguments}: {line}");
    let report = json(std::str::from_utf8(&output.stdout).unwrap());
    assert_eq!(report["converged"], false);
    assert!(line.trim_end().ends_with(report["reason"].as_str().unwrap()), "{line}{report}");
    report
}

#[test]
fn what_is_not_solved_is_exit_code_3_and_leaves_the_best_iterate() {
    let folder = samples();
    let report = fails(
        &folder,
        "solve A.mtx b.mtx --max-iterations 2 --out x.mtx",
        &["A.mtx: not converged after 2 iterations"],
    );
    let left = report["relative_residual"].as_f64().unwrap();
    assert!(left > 1e-8 && left < 1.0 && report["iterations"] == 2);
    assert_eq!(vector(&folder, "x.mtx").len(), 16);
    let file = |name: &str, entries: &str| {
        let n = entries.lines().count();
        folder.file(name, format!("%%MatrixMarket matrix coordinate real symmetric\n2 2 {n}\n{entries}"));
    };
    file("indefinite.mtx", "1 1 1\n2 1 3\n2 2 1\n");
    // Not an eigenvector: conjugate gradients would never see the negative eigenvalue.
    folder.file("uneven.mtx", "%%MatrixMarket matrix array real general\n2 1\n1\n2\n");
    for method in ["cg --precond none", "cg", "cholesky"] {
        fails(&folder, &format!("solve indefinite.mtx uneven.mtx --method {method}"), &["not positive definite"]);
    }
    for precond in ["ic0", "ssor", "smoothed-aggregation", "two-level", "chebyshev"] {
        fails(&folder, &format!("solve indefinite.mtx uneven.mtx --precond {precond}"), &["positive"]);
    }
    for method in ["minres", "ldlt", "lblt"] {
        folder.succeed(&format!("solve indefinite.mtx --method {method} --quiet"));
    }
    file("negative.mtx", "1 1 1\n2 2 -4\n");
    fails(&folder, "solve negative.mtx", &["row 2: diagonal entry -4.0: not positive definite"]);
    file("singular.mtx", "1 1 1\n2 1 1\n2 2 1\n");
    fails(&folder, "solve singular.mtx uneven.mtx --method minres", &["not converged"]);
    for method in ["cholesky", "ldlt", "lblt"] {
        fails(&folder, &format!("solve singular.mtx uneven.mtx --method {method}"), &["singular.mtx"]);
    }
    file("huge.mtx", "1 1 1e308\n2 1 1e308\n2 2 1e308\n");
    fails(&folder, "solve huge.mtx --method minres", &["huge.mtx"]);
}

#[test]
fn files_that_are_none() {
    let folder = samples();
    std::fs::create_dir(folder.path().join("folder")).unwrap();
    let matrix = |name: &str, header: &str, rest: &str| {
        folder.file(name, format!("%%MatrixMarket matrix coordinate real {header}\n{rest}"));
    };
    folder.file("empty-file.mtx", "");
    matrix("empty.mtx", "general", "0 0 0\n");
    matrix("wide.mtx", "general", "2 3 0\n");
    matrix("three.mtx", "general", "3 3 3\n1 1 1\n2 2 1\n3 3 1\n");
    matrix("unsymmetric.mtx", "general", "2 2 3\n1 1 1\n1 2 0.5\n2 2 1\n");
    matrix("zero.mtx", "symmetric", "2 2 2\n1 1 1\n2 1 0.5\n");
    matrix("nan.mtx", "general", "1 1 1\n1 1 nan\n");
    matrix("short.mtx", "general", "1 1 2\n1 1 1\n");
    for (arguments, parts) in [
        ("solve", &["<A.mtx>: found none"][..]),
        ("solve no.mtx", &["no.mtx: no such file"]),
        ("solve folder", &["folder: this is a folder"]),
        ("solve empty-file.mtx", &["empty-file.mtx, line 1: expected `%%MatrixMarket"]),
        ("solve empty.mtx", &["empty.mtx: 0 x 0, expected a matrix that is not empty"]),
        ("solve wide.mtx", &["wide.mtx: 2 x 3, expected a square matrix"]),
        ("solve three.mtx --block 2", &["three.mtx: 3 rows, expected a multiple of the 2 rows of a node"]),
        (
            "solve unsymmetric.mtx",
            &["unsymmetric.mtx: entry (2, 1) is 0.0, entry (1, 2) is 0.5, expected a symmetric matrix"],
        ),
        ("solve zero.mtx", &["zero.mtx: row 2: diagonal entry 0, expected a positive one for --method cg"]),
        ("solve zero.mtx --method cholesky", &["row 2: diagonal entry 0"]),
        ("solve zero.mtx --method minres --precond jacobi", &["row 2", "--precond jacobi"]),
        ("solve nan.mtx", &["nan.mtx, line 3: `nan` is not a finite"]),
        ("solve short.mtx", &["short.mtx, line 3: the file ends after 1 of 2 entries"]),
        ("solve A.mtx d.mtx", &["d.mtx: 2 entries, expected 16, one for each row of A.mtx"]),
        ("solve A.mtx A.mtx", &["A.mtx, line 3: expected a vector", "16 columns"]),
        ("solve A.mtx b.mtx --out no/x.mtx --quiet", &["no/x.mtx"]),
    ] {
        refuses(&folder, arguments, parts);
    }
    // Without a preconditioner MINRES has no use for the diagonal.
    folder.succeed("solve zero.mtx --method minres --quiet");
}

#[test]
fn constraints_that_cannot_be() {
    let folder = samples();
    let constraints = |name: &str, rows: usize, rest: &str| {
        let n = rest.lines().count();
        folder.file(name, format!("%%MatrixMarket matrix coordinate real general\n{rows} 16 {n}\n{rest}"));
    };
    constraints("twice.mtx", 3, "1 1 1\n1 2 1\n2 5 1\n3 1 2\n3 2 2\n");
    constraints("zero-row.mtx", 2, "1 1 1\n2 2 0\n");
    constraints("none.mtx", 0, "");
    folder.file("agrees.mtx", "%%MatrixMarket matrix array real general\n3 1\n1\n0\n2\n");
    folder.file("contradicts.mtx", "%%MatrixMarket matrix array real general\n3 1\n1\n0\n3\n");
    folder.file("square.mtx", "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 1\n");
    for (arguments, parts) in [
        (
            "--constraints twice.mtx --constraint-rhs agrees.mtx",
            &["twice.mtx: row 3: a combination of other constraints"][..],
        ),
        (
            "--constraints twice.mtx --constraint-rhs contradicts.mtx",
            &["twice.mtx: row 3: its left side", "its right side is"],
        ),
        ("--constraints zero-row.mtx", &["zero-row.mtx: row 2: no entry other than zero"]),
        ("--constraints none.mtx", &["none.mtx: no rows"]),
        ("--constraints square.mtx", &["square.mtx: 2 columns, expected 16, one for each row of A.mtx"]),
        (
            "--constraints C.mtx --constraint-rhs b.mtx",
            &["b.mtx: 16 entries, expected 2, one for each constraint of C.mtx"],
        ),
        ("--constraints C.mtx --method cg", &["--method: found cg together with --constraints, expected kkt-cg"]),
        ("--constraints C.mtx --method cholesky", &["--method: found cholesky"]),
        ("--constraints C.mtx --precond jacobi", &["--precond: found jacobi together with --method projected-cg"]),
        ("--method projected-cg", &["--method: found projected-cg, expected it together with --constraints"]),
        ("--method null-space", &["--method: found null-space"]),
        ("--method kkt-cg", &["--method: found kkt-cg"]),
        ("--constraint-rhs d.mtx", &["--constraints"]),
    ] {
        refuses(&folder, &format!("solve A.mtx {arguments}"), parts);
    }
}

#[test]
fn options_that_cannot_be() {
    let folder = samples();
    for (arguments, parts) in [
        ("--method gauss", &["--method: found gauss, expected one of cg, minres, cholesky"][..]),
        ("--precond ilu", &["--precond: found ilu, expected one of none, jacobi"]),
        ("--precision f16", &["--precision: found f16, expected one of f64, mixed"]),
        ("--precision mixed --method minres", &["--precision: found mixed together with --method minres"]),
        (
            "--precision mixed --precond ic0",
            &["--precond: found ic0 together with --precision mixed, expected none or"],
        ),
        ("--method cholesky --precond ic0", &["--precond: found ic0 together with --method cholesky"]),
        ("--block 4", &["--block: found 4, expected 1, 2 or 3"]),
        ("--block 0", &["--block: found 0"]),
        ("--tol 0", &["--tol: found 0, expected a number above 0 and below 1"]),
        ("--tol -1", &["--tol: found -1"]),
        ("--tol nan", &["--tol: found nan"]),
        ("--max-iterations 0", &["--max-iterations: found 0"]),
        ("--repeat 0", &["--repeat: found 0"]),
        ("--threads 0", &["--threads: found 0"]),
    ] {
        refuses(&folder, &format!("solve A.mtx {arguments}"), parts);
    }
    assert!(!folder.has("x.mtx"));
}

#[cfg(unix)]
#[test]
fn ctrl_c_stops_a_solve_with_130() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let folder = Folder::new();
    let n = 4000;
    let chain: Vec<String> =
        (1..=n).map(|i| if i < n { format!("{i} {i} 2\n{} {i} -1", i + 1) } else { format!("{i} {i} 2") }).collect();
    folder.file(
        "A.mtx",
        format!("%%MatrixMarket matrix coordinate real symmetric\n{n} {n} {}\n{}\n", 2 * n - 1, chain.join("\n")),
    );
    let arguments = "solve A.mtx --precond none --tol 1e-8 --repeat 1000000 --out x.mtx";
    let mut command = folder.command(arguments);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(700));
    let since = Instant::now();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    assert!(since.elapsed() < Duration::from_secs(20));
    assert_eq!(output.status.code(), Some(130), "{}", stderr(&output));
    assert!(output.stdout.is_empty() && !folder.has("x.mtx"));
    let line = stderr(&output);
    assert!(line.lines().last().unwrap().contains("A.mtx: stopped by Ctrl-C"), "{line}");
}
