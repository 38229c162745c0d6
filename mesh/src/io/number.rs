//! Numbers in text.

use std::fmt;

/// A number in the shortest form that reads back as the same one, in the spelling of C for those that are not finite.
pub(super) struct Real(pub f64);

impl fmt::Display for Real {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            x if x.is_nan() => f.write_str("nan"),
            x if x.fract() == 0.0 && x.abs() < 1e15 => write!(f, "{x}"),
            x => write!(f, "{x:?}"),
        }
    }
}

/// A value as a whole number of 32 bits, if it is one.
pub(super) fn whole(x: f64) -> Option<i32> {
    (x.fract() == 0.0 && (f64::from(i32::MIN)..=f64::from(i32::MAX)).contains(&x)).then_some(x as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_reads_back() {
        for x in [0.0, -0.0, 0.1, 1.0, -3.0, 1e15, 1e22, 5e-324, f64::MAX, f64::INFINITY, -f64::INFINITY] {
            let back: f64 = Real(x).to_string().parse().unwrap();
            assert_eq!(back.to_bits(), x.to_bits(), "{x}");
        }
        assert_eq!(Real(f64::NAN).to_string(), "nan");
        assert_eq!((whole(-1.0), whole(0.5), whole(3e9), whole(f64::NAN)), (Some(-1), None, None, None));
    }
}
