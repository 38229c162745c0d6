use super::*;
use crate::sparse::ScalarCsr;
use proptest::prelude::*;

fn matrix(text: &str) -> Result<Vec<(usize, usize, f64)>, String> {
    read_matrix(text.as_bytes()).map(|a| a.entries().collect()).map_err(|e| e.to_string())
}

fn vector(text: &str) -> Result<Vec<f64>, String> {
    read_vector(text.as_bytes()).map_err(|e| e.to_string())
}

const BANNER: &str = "%%MatrixMarket matrix coordinate real general\n";

#[test]
fn every_format_field_and_symmetry() {
    let read = |banner: &str, rest: &str| matrix(&format!("%%MatrixMarket matrix {banner}\n{rest}")).unwrap();
    assert_eq!(read("coordinate real general", "2 3 2\n2 3 -1.5\n1 1 .5\n"), [(0, 0, 0.5), (1, 2, -1.5)]);
    assert_eq!(read("coordinate integer general", "1 1 1\n1 1 -7\n"), [(0, 0, -7.0)]);
    assert_eq!(read("coordinate pattern symmetric", "2 2 1\n2 1\n"), [(0, 1, 1.0), (1, 0, 1.0)]);
    assert_eq!(
        read("coordinate real skew-symmetric", "2 2 2\n1 1 0\n2 1 3\n"),
        [(0, 0, 0.0), (0, 1, -3.0), (1, 0, 3.0)]
    );
    let columns = [(0, 0, 1.0), (0, 1, 3.0), (1, 0, 2.0), (1, 1, 4.0)];
    assert_eq!(read("array real general", "2 2\n1\n2\n3\n4\n"), columns);
    assert_eq!(read("array integer symmetric", "2 2\n1\n2\n4\n"), [(0, 0, 1.0), (0, 1, 2.0), (1, 0, 2.0), (1, 1, 4.0)]);
    let skew = [(0, 1, -1.0), (0, 2, -2.0), (1, 0, 1.0), (1, 2, -3.0), (2, 0, 2.0), (2, 1, 3.0)];
    assert_eq!(read("array real skew-symmetric", "3 3\n1\n2\n3\n"), skew);
    assert_eq!(read("array real general", "2 0\n"), []);
}

#[test]
fn what_writers_differ_in() {
    // Case, CRLF, comments, blank lines, indentation, no line end at the end.
    let text =
        "%%matrixmarket MATRIX Coordinate Double General\r\n%\r\n\r\n 2 2  2 \r\n\t1 1\t+1e0\r\n% so\r\n\r\n2 2 2E+1";
    assert_eq!(matrix(text).unwrap(), [(0, 0, 1.0), (1, 1, 20.0)]);
    // Entries of one place, and the upper half of a symmetric matrix.
    assert_eq!(matrix(&format!("{BANNER}1 1 2\n1 1 1\n1 1 2\n")).unwrap(), [(0, 0, 3.0)]);
    let upper = "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 2 5\n2 2 1\n";
    assert_eq!(matrix(upper).unwrap(), [(0, 1, 5.0), (1, 0, 5.0), (1, 1, 1.0)]);
    // Too small for a number of 64 bits is zero, as everywhere.
    assert_eq!(matrix(&format!("{BANNER}1 1 1\n1 1 1e-400\n")).unwrap(), [(0, 0, 0.0)]);
}

#[test]
fn vectors_dense_or_not() {
    assert_eq!(vector("%%MatrixMarket matrix array real general\n3 1\n1\n-0.0\n2.5\n").unwrap(), [1.0, 0.0, 2.5]);
    assert_eq!(vector(&format!("{BANNER}3 1 2\n3 1 4\n3 1 1\n")).unwrap(), [0.0, 0.0, 5.0]);
    assert_eq!(vector("%%MatrixMarket matrix array integer general\n0 1\n").unwrap(), []);
    let wide = vector(&format!("{BANNER}2 2 0\n")).unwrap_err();
    assert_eq!(wide, "line 2: expected a vector, that is a matrix with 1 column, found 2 columns");
    let sum = vector(&format!("{BANNER}1 1 2\n1 1 1e308\n1 1 1e308\n")).unwrap_err();
    assert_eq!(sum, "line 4: the entries at (1, 1) add up to inf, expected a finite number");
}

#[test]
fn malformed_files_are_refused_by_line() {
    let with = |rest: &str| matrix(&format!("{BANNER}{rest}")).unwrap_err();
    for (rest, expected) in [
        ("", "line 1: expected three whole numbers: rows, columns, entries, found `the end of the file`"),
        ("2 2\n", "line 2: expected three whole numbers: rows, columns, entries, found the end of the line"),
        ("2 2 1 1\n", "line 2: expected the end of the line, found `1`"),
        ("2 -2 1\n", "line 2: expected three whole numbers: rows, columns, entries, found `-2`"),
        ("2 2 1.0\n", "line 2: expected three whole numbers: rows, columns, entries, found `1.0`"),
        ("4294967296 1 0\n", "line 2: 4294967296 rows, expected at most 4294967295"),
        (
            "1 99999999999999999999 0\n",
            "line 2: expected three whole numbers: rows, columns, entries, found `99999999999999999999`",
        ),
        (
            "4294967295 1 1\n1 1 1\n",
            "line 3: 4294967295 rows but only 1 entries, expected at most 16777216 rows in so empty a file",
        ),
        (
            "1 16777217 1\n1 1 1\n",
            "line 3: 16777217 columns but only 1 entries, expected at most 16777216 columns in so empty a file",
        ),
        ("2 2 1\n%\n0 1 1\n", "line 4: row 0, expected row 1 to 2"),
        ("2 2 1\n1 3 1\n", "line 3: column 3, expected column 1 to 2"),
        ("2 2 1\n-1 1 1\n", "line 3: expected a row, column and value; the row from 1, found `-1`"),
        ("2 2 1\n1\n", "line 3: expected a row, column and value; the column from 1, found the end of the line"),
        ("2 2 1\n1 1\n", "line 3: expected a number, found the end of the line"),
        ("2 2 1\n1 1 x\n", "line 3: expected a number, found `x`"),
        ("2 2 1\n1 1 1 1\n", "line 3: expected the end of the line, found `1`"),
        ("2 2 1\n1 1 nan\n", "line 3: `nan` is not a finite 64-bit number"),
        ("2 2 1\n1 1 -inf\n", "line 3: `-inf` is not a finite 64-bit number"),
        ("2 2 1\n1 1 1e400\n", "line 3: `1e400` is not a finite 64-bit number"),
        ("2 2 2\n1 1 1\n\n", "line 4: the file ends after 1 of 2 entries"),
        ("2 2 18446744073709551615\n1 1 1\n", "line 3: the file ends after 1 of 18446744073709551615 entries"),
        ("2 2 1\n1 1 1\n2 2 3\n", "line 4: expected nothing after the 1 entries of the size line, found `2 2 3`"),
        ("2 2 2\n1 2 1e308\n1 2 1e308\n", "line 4: the entries at (1, 2) add up to inf, expected a finite number"),
    ] {
        assert_eq!(with(rest), expected, "{rest:?}");
    }
}

#[test]
fn headers_that_are_none() {
    for (text, expected) in [
        ("", "line 1: expected `%%MatrixMarket matrix ...`, found `an empty file`"),
        ("1 1 1\n", "line 1: expected `%%MatrixMarket`, found `1`"),
        ("\n", "line 1: expected `%%MatrixMarket`, found the end of the line"),
        ("%%MatrixMarket vector coordinate real\n", "line 1: expected `matrix`, found `vector`"),
        (
            "%%MatrixMarket matrix coordinate complex general\n1 1 1\n",
            "line 1: complex matrices are not read, expected `real`, `integer` or `pattern`",
        ),
        (
            "%%MatrixMarket matrix coordinate real hermitian\n1 1 1\n",
            "line 1: hermitian matrices are not read, expected `general`, `symmetric` or `skew-symmetric`",
        ),
        (
            "%%MatrixMarket matrix array pattern general\n1 1\n",
            "line 1: dense pattern matrices are not read, expected `real` or `integer` with `array`",
        ),
        (
            "%%MatrixMarket matrix coordinate real\n1 1 1\n",
            "line 1: expected `general`, `symmetric` or `skew-symmetric`, found the end of the line",
        ),
        (
            "%%MatrixMarket matrix array real symmetric\n2 3\n",
            "line 2: 2 x 3, expected a symmetric matrix to be square",
        ),
        (
            "%%MatrixMarket matrix coordinate integer general\n1 1 1\n1 1 1.5\n",
            "line 3: expected a whole number of 64 bits, found `1.5`",
        ),
        (
            "%%MatrixMarket matrix coordinate integer general\n1 1 1\n1 1 9007199254740993\n",
            "line 3: expected a whole number that 64-bit reals can hold, found `9007199254740993`",
        ),
        (
            "%%MatrixMarket matrix coordinate real symmetric\n3 3 2\n2 1 1\n1 3 1\n",
            "line 4: entry (1, 3) lies on the other side of the diagonal than an earlier one, expected one half of a symmetric matrix",
        ),
        (
            "%%MatrixMarket matrix coordinate real skew-symmetric\n3 3 1\n2 2 1\n",
            "line 3: entry (2, 2) is 1, expected 0 on the diagonal of a skew-symmetric matrix",
        ),
    ] {
        assert_eq!(matrix(text).unwrap_err(), expected, "{text:?}");
    }
}

#[test]
fn bytes_that_are_no_text_and_lines_without_end() {
    let error = |bytes: &[u8]| read_matrix(bytes).unwrap_err().to_string();
    let text = [BANNER.as_bytes(), b"1 1 1\n1 1 \xff\xfe\n"].concat();
    assert_eq!(error(&text), "line 3: expected a number, found `\u{fffd}\u{fffd}`");
    assert_eq!(error(b"\x1b[2J\0\n"), "line 1: expected `%%MatrixMarket`, found `\\u{1b}[2J\\0`");
    let endless = [BANNER.as_bytes(), &vec![b'7'; 1 << 20]].concat();
    assert_eq!(error(&endless), "line 2: a line of more than 65536 bytes");
    let long = [BANNER.as_bytes(), &vec![b'7'; 60_000], b"\n"].concat();
    assert!(error(&long).len() < 200);
}

/// A reader that fails after its first bytes.
struct Broken<'a>(&'a [u8]);

impl std::io::Read for Broken<'_> {
    fn read(&mut self, out: &mut [u8]) -> std::io::Result<usize> {
        match std::io::Read::read(&mut self.0, out)? {
            0 => Err(std::io::Error::other("the disk is gone")),
            n => Ok(n),
        }
    }
}

#[test]
fn a_disk_that_fails_is_an_error_with_its_line() {
    let text = format!("{BANNER}2 2 2\n1 1 1\n");
    let error = read_matrix(std::io::BufReader::new(Broken(text.as_bytes()))).unwrap_err();
    assert_eq!(error.to_string(), "line 4: the disk is gone");
    assert!(std::error::Error::source(&error).is_some());
}

#[test]
fn a_symmetric_matrix_is_written_as_its_lower_half() {
    let text = |triplets: &[(u32, u32, f64)]| {
        let mut bytes = Vec::new();
        write_matrix(&mut bytes, &ScalarCsr::from_triplets(2, 2, triplets).unwrap()).unwrap();
        String::from_utf8(bytes).unwrap()
    };
    let symmetric = text(&[(0, 0, 2.0), (0, 1, 0.1), (1, 0, 0.1)]);
    assert_eq!(symmetric, "%%MatrixMarket matrix coordinate real symmetric\n2 2 2\n1 1 2.0\n2 1 0.1\n");
    // A zero that is not stored on the other side, or that has another sign, would not come back.
    for triplets in [&[(0, 1, 0.0)][..], &[(0, 1, 0.0), (1, 0, -0.0)]] {
        assert!(text(triplets).contains("general"));
    }
    let mut bytes = Vec::new();
    let error = write_vector(&mut bytes, &[1.0, f64::NAN]).unwrap_err();
    assert!(bytes.is_empty() && error.to_string() == "entry 2 is NaN, expected a finite number");
}

#[test]
fn ten_megabytes_take_a_fraction_of_a_second() {
    let triplets: Vec<_> = (0..400_000u32).map(|k| (k % 10_000, k / 10_000 * 7, f64::from(k).sin())).collect();
    let a = ScalarCsr::from_triplets(10_000, 10_000, &triplets).unwrap();
    let mut bytes = Vec::new();
    write_matrix(&mut bytes, &a).unwrap();
    assert!(bytes.len() > 10_000_000, "{}", bytes.len());
    let since = std::time::Instant::now();
    let back = read_matrix(&bytes[..]).unwrap();
    let seconds = since.elapsed().as_secs_f64();
    assert_eq!(back, a);
    println!("{:.1} MB in {seconds:.3} s", bytes.len() as f64 / 1e6);
    assert!(seconds < 1.0, "{seconds} s");
}

/// Finite numbers of any exponent, zeros of both signs.
fn number() -> impl Strategy<Value = f64> {
    use proptest::num::f64::{NEGATIVE, NORMAL, POSITIVE, SUBNORMAL, ZERO};
    NORMAL | SUBNORMAL | ZERO | POSITIVE | NEGATIVE
}

fn any_matrix() -> impl Strategy<Value = ScalarCsr> {
    (1u32..9, 1u32..9, any::<bool>()).prop_flat_map(|(m, n, symmetric)| {
        let n = if symmetric { m } else { n };
        let places = proptest::collection::btree_map((0..m, 0..n), number(), 0..20);
        places.prop_map(move |places| {
            let mut triplets: Vec<_> = places.into_iter().map(|((i, j), v)| (i, j, v)).collect();
            if symmetric {
                triplets.retain(|&(i, j, _)| j <= i);
                let mirrored: Vec<_> = triplets.iter().filter(|(i, j, _)| i != j).map(|&(i, j, v)| (j, i, v)).collect();
                triplets.extend(mirrored);
            }
            ScalarCsr::from_triplets(m as usize, n as usize, &triplets).unwrap()
        })
    })
}

fn bits(values: impl Iterator<Item = f64>) -> Vec<u64> {
    values.map(f64::to_bits).collect()
}

proptest! {
    #[test]
    fn what_is_written_is_read_with_the_same_bits(a in any_matrix()) {
        let mut bytes = Vec::new();
        write_matrix(&mut bytes, &a).unwrap();
        let back = read_matrix(&bytes[..]).unwrap();
        prop_assert_eq!(&back, &a);
        prop_assert_eq!(bits(back.entries().map(|e| e.2)), bits(a.entries().map(|e| e.2)));
    }

    #[test]
    fn vectors_too(v in proptest::collection::vec(number(), 0..20)) {
        let mut bytes = Vec::new();
        write_vector(&mut bytes, &v).unwrap();
        prop_assert_eq!(bits(read_vector(&bytes[..]).unwrap().into_iter()), bits(v.into_iter()));
    }

    #[test]
    fn arbitrary_bytes_are_answered(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        let body = [BANNER.as_bytes(), &bytes].concat();
        for bytes in [&bytes, &body] {
            let (a, b) = (read_matrix(&bytes[..]), read_vector(&bytes[..]));
            prop_assert!(a.is_ok() || !a.unwrap_err().to_string().is_empty());
            prop_assert!(b.is_ok() || b.unwrap_err().line >= 1);
        }
    }

    #[test]
    fn damaged_files_are_answered(
        a in any_matrix(),
        damage in proptest::collection::vec((any::<prop::sample::Index>(), prop::sample::select(b"0149 -.eE\n%nx\xff".to_vec())), 1..6),
    ) {
        let mut bytes = Vec::new();
        write_matrix(&mut bytes, &a).unwrap();
        for (at, byte) in damage {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        match read_matrix(&bytes[..]) {
            Ok(read) => prop_assert!(read.entries().all(|(i, j, v)| i < read.n_rows() && j < read.n_cols() && v.is_finite())),
            Err(error) => prop_assert!(error.line >= 1 && error.to_string().len() < 300),
        }
    }
}
