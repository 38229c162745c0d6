//! Millimetres in files, metres in memory.

/// Decimal strings of DICOM have up to 16 characters.
const LONGEST: usize = 16;

/// Metres of a number of millimetres.
pub(crate) fn from_mm(mm: f64) -> f64 {
    mm / 1e3
}

/// Millimetres to the nanometre; of its reading by [`from_mm`] they are the same again.
pub(crate) fn to_mm(metres: f64) -> f64 {
    let mm = (metres * 1e9).round() / 1e6;
    // No negative zero in files.
    if mm == 0.0 { 0.0 } else { mm }
}

/// Millimetres as a decimal string: to the nanometre, or as far as 16 characters reach.
pub(crate) fn decimal(mm: f64) -> String {
    let exact = mm.to_string();
    if exact.len() <= LONGEST {
        return exact;
    }
    let rounded = (0..=6).rev().map(|digits| format!("{mm:.digits$}")).find(|text| text.len() <= LONGEST);
    rounded.unwrap_or_else(|| format!("{mm:.8e}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn pixels_are_short() {
        assert_eq!(decimal(to_mm(0.012_489)), "12.489");
        assert_eq!(decimal(to_mm(-1e-12)), "0");
        assert_eq!(decimal(-123_456_789.123_456), "-123456789.12346");
        assert_eq!(decimal(1.234e300), "1.23400000e300");
    }

    proptest! {
        #[test]
        fn what_was_read_once_stays(nanometres in -1_000_000_000_000_i64..1_000_000_000_000) {
            let metres = from_mm(nanometres as f64 / 1e6);
            prop_assert_eq!(from_mm(to_mm(metres)).to_bits(), metres.to_bits());
            let text = decimal(to_mm(metres));
            prop_assert!(text.len() <= LONGEST);
            prop_assert_eq!(from_mm(text.parse().unwrap()).to_bits(), metres.to_bits());
        }
    }
}
