//! Arrays of VTK XML files: text, base64 or raw, inline or appended, plain or compressed.

use super::{base64, kind::Kind, xml};
use crate::io::{
    Problem, ReadError,
    cursor::{self, ByteOrder, parse},
};
use miniz_oxide::inflate;
use roxmltree::Node;

/// What the root element says of all arrays.
pub(super) struct Encoding<'a> {
    pub order: ByteOrder,
    /// Type of the byte counts before binary data.
    pub header: Kind,
    pub compressed: bool,
    pub appended: Option<Appended<'a>>,
}

/// The data behind all elements.
#[derive(Clone, Copy)]
pub(super) struct Appended<'a> {
    pub bytes: &'a [u8],
    pub is_base64: bool,
}

/// An array, decoded.
pub(super) struct Array {
    kind: Kind,
    order: ByteOrder,
    content: Content,
}

enum Content {
    Bytes(Vec<u8>),
    Reals(Vec<f64>),
    Integers(Vec<i64>),
}

impl Array {
    pub fn reals(&self) -> Vec<f64> {
        match &self.content {
            Content::Bytes(bytes) => self.numbers(bytes).map(|bytes| self.kind.real(self.order, bytes)).collect(),
            Content::Reals(values) => values.clone(),
            Content::Integers(values) => values.iter().map(|&x| x as f64).collect(),
        }
    }

    /// Whole numbers; -1 for any that are none.
    pub fn integers(&self) -> Vec<i64> {
        match &self.content {
            Content::Bytes(bytes) => self.numbers(bytes).map(|bytes| self.kind.integer(self.order, bytes)).collect(),
            Content::Reals(values) => vec![-1; values.len()],
            Content::Integers(values) => values.clone(),
        }
    }

    fn numbers<'b>(&self, bytes: &'b [u8]) -> std::slice::ChunksExact<'b, u8> {
        bytes.chunks_exact(self.kind.size())
    }

    fn len(&self) -> usize {
        match &self.content {
            Content::Bytes(bytes) => bytes.len() / self.kind.size(),
            Content::Reals(values) => values.len(),
            Content::Integers(values) => values.len(),
        }
    }
}

impl Encoding<'_> {
    /// The array of an element, of `expected` numbers; `None` leaves its length open.
    pub fn array(&self, node: Node<'_, '_>, expected: Option<u64>) -> Result<Array, ReadError> {
        let fail = |problem| xml::error(node, problem);
        let name = xml::attribute(node, "type")?;
        let kind = Kind::of_xml(name).ok_or_else(|| {
            let expected = "a type of numbers, such as \"Float64\"".into();
            fail(Problem::Syntax { expected, found: cursor::shown(name.as_bytes()) })
        })?;
        let content = match node.attribute("format").unwrap_or("ascii") {
            "ascii" => text(node, kind)?,
            "binary" => {
                let text: String = node.children().filter_map(|child| child.text()).collect();
                Content::Bytes(self.decode(text.as_bytes(), true).map_err(fail)?)
            }
            "appended" => {
                let offset = xml::number(node, "offset")?;
                let missing = || fail(Problem::Missing("element AppendedData".into()));
                let appended = self.appended.ok_or_else(missing)?;
                let start = usize::try_from(offset).ok().and_then(|offset| appended.bytes.get(offset..));
                let start = start.ok_or_else(|| {
                    let range = format!("{} bytes of appended data", appended.bytes.len());
                    fail(Problem::Index { what: "offset", found: offset.into(), range })
                })?;
                Content::Bytes(self.decode(start, appended.is_base64).map_err(fail)?)
            }
            other => {
                let expected = "format \"ascii\", \"binary\" or \"appended\"".into();
                return Err(fail(Problem::Syntax { expected, found: cursor::shown(other.as_bytes()) }));
            }
        };
        let array = Array { kind, order: self.order, content };
        match expected {
            Some(expected) if expected != array.len() as u64 => {
                let what = format!("array {}", cursor::shown(node.attribute("Name").unwrap_or_default().as_bytes()));
                Err(fail(Problem::Length { what, found: array.len() as u64, expected }))
            }
            _ => Ok(array),
        }
    }

    /// The data that begin with their byte count at the start of `coded`.
    fn decode(&self, coded: &[u8], is_base64: bool) -> Result<Vec<u8>, Problem> {
        let word = self.header.size();
        let get = |n: usize| -> Result<(Vec<u8>, usize), Problem> {
            let (bytes, used) = if is_base64 {
                base64::decode(coded, n)
            } else {
                let n = n.min(coded.len());
                (coded[..n].to_vec(), n)
            };
            if bytes.len() < n {
                let expected = format!("{n} bytes of an array, {} of them there", bytes.len()).into();
                return Err(Problem::Truncated { expected });
            }
            Ok((bytes, used))
        };
        // An array without numbers may be without a count as well.
        if coded.trim_ascii().is_empty() {
            return Ok(Vec::new());
        }
        // Checked before it is asked for, so that no sum overflows.
        let bounded = |n: u64, what: &'static str| {
            let (needed, left) = (n, coded.len() as u64);
            let count = || Problem::Count { what: what.into(), found: n, needed, left };
            if n > left { Err(count()) } else { Ok(n as usize) }
        };
        let (first, _) = get(word)?;
        let n = self.header_word(&first, 0);
        if !self.compressed {
            let n = bounded(n, "bytes of an array")?;
            return Ok(get(word + n)?.0.split_off(word));
        }
        let n_blocks = bounded(n, "compressed blocks")?;
        let header_size = n_blocks.saturating_add(3).saturating_mul(word);
        let (header, used) = get(header_size)?;
        let entry = |i: usize| self.header_word(&header, i);
        let (full, last) = (entry(1), entry(2));
        let mut blocks = &coded[used..];
        let decoded;
        if is_base64 {
            let total = (0..n_blocks).fold(0, |sum: u64, block| sum.saturating_add(entry(3 + block)));
            decoded = base64::decode(blocks, bounded(total, "bytes of compressed blocks")?).0;
            blocks = &decoded;
        }
        let mut data = Vec::new();
        for block in 0..n_blocks {
            let size = bounded(entry(3 + block), "bytes of a compressed block")?;
            let truncated = || Problem::Truncated { expected: format!("{size} bytes of a compressed block").into() };
            let (block_bytes, rest) = blocks.split_at_checked(size).ok_or_else(truncated)?;
            blocks = rest;
            let plain = if block + 1 == n_blocks && last > 0 { last } else { full };
            inflate_block(block_bytes, plain, &mut data)?;
        }
        Ok(data)
    }

    fn header_word(&self, bytes: &[u8], i: usize) -> u64 {
        let at = &bytes[i * self.header.size()..];
        // Negative, that is beyond 63 bits, for no file.
        self.header.integer(self.order, at) as u64
    }
}

/// Unpacks a zlib block of `plain` bytes.
fn inflate_block(block: &[u8], plain: u64, data: &mut Vec<u8>) -> Result<(), Problem> {
    let expected = || format!("a zlib block of {plain} bytes").into();
    // Deflate packs at most 1032 bytes into one.
    let most = (block.len() as u64).saturating_mul(1032);
    if plain > most {
        return Err(Problem::Count {
            what: "bytes".into(),
            found: plain,
            needed: plain / 1032,
            left: block.len() as u64,
        });
    }
    let unpacked = inflate::decompress_to_vec_zlib_with_limit(block, plain as usize)
        .map_err(|error| Problem::Syntax { expected: expected(), found: error.to_string() })?;
    if unpacked.len() as u64 != plain {
        return Err(Problem::Syntax { expected: expected(), found: format!("one of {} bytes", unpacked.len()) });
    }
    data.extend_from_slice(&unpacked);
    Ok(())
}

/// The numbers in the text of an element.
fn text(node: Node<'_, '_>, kind: Kind) -> Result<Content, ReadError> {
    let words = node.children().filter_map(|child| child.text()).flat_map(str::split_ascii_whitespace);
    let fail = |word: &str, expected: &'static str| {
        xml::error(node, Problem::Syntax { expected: expected.into(), found: cursor::shown(word.as_bytes()) })
    };
    if kind.is_real() {
        let values = words.map(|word| parse(word.as_bytes()).ok_or_else(|| fail(word, "a number")));
        return Ok(Content::Reals(values.collect::<Result<_, _>>()?));
    }
    let values = words.map(|word| parse(word.as_bytes()).ok_or_else(|| fail(word, "an integer")));
    Ok(Content::Integers(values.collect::<Result<_, _>>()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoding(order: ByteOrder, header: Kind, compressed: bool) -> Encoding<'static> {
        Encoding { order, header, compressed, appended: None }
    }

    /// Numbers of the header's type in an order of bytes.
    fn words(order: ByteOrder, header: Kind, words: &[u64]) -> Vec<u8> {
        let word = |&x: &u64| {
            let bytes = if header == Kind::U64 { x.to_le_bytes().to_vec() } else { (x as u32).to_le_bytes().to_vec() };
            if order == ByteOrder::Big { bytes.into_iter().rev().collect() } else { bytes }
        };
        words.iter().flat_map(word).collect()
    }

    fn base64(units: &[&[u8]]) -> Vec<u8> {
        let mut text = String::new();
        units.iter().for_each(|unit| base64::encode(unit, &mut text));
        text.into_bytes()
    }

    #[test]
    fn plain_data_with_either_header_and_order() {
        for order in [ByteOrder::Little, ByteOrder::Big] {
            for header in [Kind::U32, Kind::U64] {
                let encoding = encoding(order, header, false);
                let mut raw = words(order, header, &[5]);
                raw.extend(b"hello and more");
                assert_eq!(encoding.decode(&raw, false).unwrap(), b"hello");
                assert_eq!(encoding.decode(&base64(&[&raw[..header.size() + 5]]), true).unwrap(), b"hello");
                // The count may be a unit of its own.
                let (count, data) = raw.split_at(header.size());
                assert_eq!(encoding.decode(&base64(&[count, &data[..5]]), true).unwrap(), b"hello");
                assert_eq!(encoding.decode(b" ", false).unwrap(), b"");
            }
        }
    }

    #[test]
    fn compressed_data_in_several_blocks() {
        let plain: Vec<u8> = (0..250).collect();
        let blocks: Vec<Vec<u8>> =
            plain.chunks(100).map(|b| miniz_oxide::deflate::compress_to_vec_zlib(b, 6)).collect();
        let sizes = blocks.iter().map(|block| block.len() as u64);
        for order in [ByteOrder::Little, ByteOrder::Big] {
            for header in [Kind::U32, Kind::U64] {
                let encoding = encoding(order, header, true);
                let head = words(order, header, &[3, 100, 50].into_iter().chain(sizes.clone()).collect::<Vec<_>>());
                let data = blocks.concat();
                assert_eq!(encoding.decode(&[head.clone(), data.clone()].concat(), false).unwrap(), plain);
                assert_eq!(encoding.decode(&base64(&[&head, &data]), true).unwrap(), plain);
                assert!(encoding.decode(&head, false).is_err(), "the blocks are missing");
            }
        }
        assert_eq!(encoding(ByteOrder::Little, Kind::U32, true).decode(&[0; 12], false).unwrap(), b"", "no blocks");
    }

    #[test]
    fn sizes_are_held_against_what_is_there() {
        let order = ByteOrder::Little;
        let huge = words(order, Kind::U64, &[u64::MAX, 1, 1]);
        for compressed in [false, true] {
            let problem = encoding(order, Kind::U64, compressed).decode(&huge, false).unwrap_err();
            assert!(matches!(problem, Problem::Count { .. }), "{problem}");
        }
        // One block of a byte that says it unpacks to 2^40.
        let bomb = words(order, Kind::U64, &[1, 1 << 40, 0, 1, 0]);
        let problem = encoding(order, Kind::U64, true).decode(&bomb, false).unwrap_err();
        assert!(matches!(problem, Problem::Count { .. }), "{problem}");
    }
}
