//! Base64 (RFC 4648), as VTK uses it: one unit may follow another, each with its own padding.

/// Decodes until at least `most` bytes are there, or the text or its sense ends; white space is skipped. Returns the
/// bytes, at most `most` of them, and the number of characters used.
pub(super) fn decode(text: &[u8], most: usize) -> (Vec<u8>, usize) {
    let mut bytes = Vec::new();
    let (mut group, mut n, mut padding) = (0_u32, 0, 0);
    for (at, &c) in text.iter().enumerate() {
        if c.is_ascii_whitespace() {
            continue;
        }
        if bytes.len() >= most && n == 0 {
            bytes.truncate(most);
            return (bytes, at);
        }
        let Some(value) = value(c).filter(|_| c == b'=' || padding == 0) else {
            return (bytes, at);
        };
        group = group << 6 | value;
        padding += u32::from(c == b'=');
        n += 1;
        if n == 4 {
            let decoded = group.to_be_bytes();
            let kept = 3_usize.saturating_sub(padding as usize);
            bytes.extend_from_slice(&decoded[1..1 + kept]);
            (group, n, padding) = (0, 0, 0);
        }
    }
    bytes.truncate(most);
    (bytes, text.len())
}

/// Appends the code of some bytes.
pub(super) fn encode(bytes: &[u8], text: &mut String) {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    text.reserve(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let group = chunk.iter().enumerate().fold(0, |group, (i, &b)| group | u32::from(b) << (16 - 8 * i));
        for i in 0..4 {
            let digit = (group >> (18 - 6 * i) & 63) as usize;
            text.push(if i <= chunk.len() { char::from(ALPHABET[digit]) } else { '=' });
        }
    }
}

fn value(c: u8) -> Option<u32> {
    Some(match c {
        b'A'..=b'Z' => u32::from(c - b'A'),
        b'a'..=b'z' => u32::from(c - b'a') + 26,
        b'0'..=b'9' => u32::from(c - b'0') + 52,
        b'+' => 62,
        b'/' => 63,
        b'=' => 0,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_examples_of_the_standard() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9v\n YmFy")] {
            assert_eq!(decode(coded.as_bytes(), 100).0, plain.as_bytes());
        }
        for plain in ["", "f", "fo", "foo", "foob", "fooba", "foobar \u{3b1}\u{7f}"] {
            let mut text = String::new();
            encode(plain.as_bytes(), &mut text);
            assert_eq!(decode(text.as_bytes(), 100), (plain.as_bytes().to_vec(), text.len()));
        }
        let mut text = String::new();
        encode(&[0xfb, 0xff, 0x3e], &mut text);
        assert_eq!(text, "+/8+");
        assert_eq!(decode(b"Zg==Zm8=Zm9v", 100).0, b"ffofoo", "units follow each other");
        assert_eq!(decode(b"Zg==Zm8=Zm9v", 1), (b"f".to_vec(), 4), "no more than asked for");
        assert_eq!(decode(b"Zm9v*Zm9v", 100), (b"foo".to_vec(), 4));
        assert_eq!(decode(b"Z=9v", 100).0, b"");
    }
}
