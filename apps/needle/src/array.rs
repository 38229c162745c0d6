//! Arrays of generic length in state files: serde knows those of fixed lengths alone.
//!
//! For `#[serde(with = "crate::array")]`; the bytes are those of an array of a fixed length.

use serde::de::{Deserializer, Error, SeqAccess, Visitor};
use serde::ser::{SerializeTuple, Serializer};

pub(crate) fn serialize<S: Serializer, const K: usize>(array: &[f64; K], serializer: S) -> Result<S::Ok, S::Error> {
    let mut tuple = serializer.serialize_tuple(K)?;
    for x in array {
        tuple.serialize_element(x)?;
    }
    tuple.end()
}

pub(crate) fn deserialize<'de, D: Deserializer<'de>, const K: usize>(deserializer: D) -> Result<[f64; K], D::Error> {
    struct Numbers<const K: usize>;

    impl<'de, const K: usize> Visitor<'de> for Numbers<K> {
        type Value = [f64; K];

        fn expecting(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            write!(formatter, "{K} numbers")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<[f64; K], A::Error> {
            let mut array = [0.0; K];
            for (found, x) in array.iter_mut().enumerate() {
                *x = numbers.next_element()?.ok_or_else(|| A::Error::invalid_length(found, &self))?;
            }
            Ok(array)
        }
    }

    deserializer.deserialize_tuple(K, Numbers)
}
