//! A walk over the lengths in a DICOM file, before anything is read by them.
//!
//! The library that reads elements makes room for as many bytes as an element claims, up to 4 GB each, before it looks how
//! many there are; it follows sequences within sequences as deep as they go; and it takes the end of the file for the end of
//! the sequences that are open there. A file of a kilobyte could so use up memory or stack, and one cut short look whole.

use crate::error::Problem;
use dicom_core::{
    DataDictionary, Tag, VR,
    dictionary::{DataDictionaryEntry, VirtualVr},
};
use dicom_dictionary_std::{StandardDataDictionary, tags, uids};

/// Sequences and items within each other; a structure set has a dozen.
const DEEPEST: usize = 64;
/// A length that is told by a delimiter instead.
const UNDEFINED: u32 = u32::MAX;
/// Group of items and delimiters, which have no VR.
const ITEMS: u16 = 0xfffe;
const ITEM: Tag = Tag(ITEMS, 0xe000);
const ITEM_END: Tag = Tag(ITEMS, 0xe00d);
const SEQUENCE_END: Tag = Tag(ITEMS, 0xe0dd);

/// Checks that every length fits into what is left of the file or of what it stands in, and the kind of encoding.
pub(super) fn check(bytes: &[u8]) -> Result<(), Problem> {
    let mut walk = Walk { bytes, at: 132, explicit: true, open: Vec::new() };
    let syntax = walk.meta()?;
    walk.explicit = match syntax.as_str() {
        uids::EXPLICIT_VR_LITTLE_ENDIAN => true,
        uids::IMPLICIT_VR_LITTLE_ENDIAN => false,
        _ => {
            let expected = "Explicit or Implicit VR Little Endian (1.2.840.10008.1.2.1 or 1.2.840.10008.1.2)";
            return Err(Problem::Dicom(format!("transfer syntax {syntax:?}, expected {expected}")));
        }
    };
    while walk.close()? {
        walk.step()?;
    }
    Ok(())
}

struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    explicit: bool,
    /// Where the sequences and items around end; `None` at a delimiter.
    open: Vec<Option<usize>>,
}

struct Header {
    tag: Tag,
    length: u32,
    is_sequence: bool,
}

impl Walk<'_> {
    /// Steps over the file meta information and returns the transfer syntax that it names.
    fn meta(&mut self) -> Result<String, Problem> {
        let first = self.header()?;
        if first.tag != tags::FILE_META_INFORMATION_GROUP_LENGTH || first.length != 4 {
            return Err(self.wrong(first.tag, "expected File Meta Information Group Length (0002,0000) of 4 bytes"));
        }
        let length = u32::from_le_bytes(self.take(first.tag)?);
        let end = self.end(first.tag, length)?;
        let mut syntax = String::new();
        while self.at < end {
            let header = self.header()?;
            let value = self.at..self.end(header.tag, header.length)?;
            if header.tag.group() != 2 || value.end > end {
                return Err(self.wrong(header.tag, "expected File Meta Information of the length that it tells"));
            }
            if header.tag == tags::TRANSFER_SYNTAX_UID {
                let text = String::from_utf8_lossy(&self.bytes[value.clone()]);
                syntax = text.trim_end_matches(['\0', ' ']).to_owned();
            }
            self.at = value.end;
        }
        Ok(syntax)
    }

    /// Steps over a value, or into a sequence or an item, or out of one.
    fn step(&mut self) -> Result<(), Problem> {
        let header = self.header()?;
        match header.tag {
            ITEM_END | SEQUENCE_END => match self.open.pop() {
                Some(None) => Ok(()),
                _ => Err(self.wrong(header.tag, "a delimiter that ends nothing")),
            },
            tag if tag == ITEM || header.is_sequence || header.length == UNDEFINED => {
                if self.open.len() >= DEEPEST {
                    return Err(self.wrong(tag, "expected at most 32 sequences within each other"));
                }
                let end = if header.length == UNDEFINED { None } else { Some(self.end(tag, header.length)?) };
                self.open.push(end);
                Ok(())
            }
            tag => {
                self.at = self.end(tag, header.length)?;
                Ok(())
            }
        }
    }

    /// Leaves what ends here, and tells whether there is more.
    fn close(&mut self) -> Result<bool, Problem> {
        while self.open.last().is_some_and(|end| *end == Some(self.at)) {
            self.open.pop();
        }
        if self.at < self.bytes.len() {
            return Ok(true);
        }
        match self.open.len() {
            0 => Ok(false),
            n => Err(Problem::Dicom(format!("the file ends within {n} open sequences and items: it was cut short"))),
        }
    }

    fn header(&mut self) -> Result<Header, Problem> {
        let unknown = Tag(0, 0);
        let [a, b, c, d] = self.take(unknown)?;
        let tag = Tag(u16::from_le_bytes([a, b]), u16::from_le_bytes([c, d]));
        if tag.group() == ITEMS || !self.explicit {
            let length = u32::from_le_bytes(self.take(tag)?);
            let is_sequence = tag.group() != ITEMS && is_sequence(tag);
            return Ok(Header { tag, length, is_sequence });
        }
        let vr = VR::from_binary(self.take(tag)?).unwrap_or(VR::UN);
        let length = if has_short_length(vr) {
            u32::from(u16::from_le_bytes(self.take(tag)?))
        } else {
            let _reserved: [u8; 2] = self.take(tag)?;
            u32::from_le_bytes(self.take(tag)?)
        };
        Ok(Header { tag, length, is_sequence: vr == VR::SQ })
    }

    fn take<const N: usize>(&mut self, tag: Tag) -> Result<[u8; N], Problem> {
        let found = self.bytes.get(self.at..self.at + N).and_then(|bytes| bytes.try_into().ok());
        let found = found.ok_or_else(|| self.wrong(tag, "the file ends within its header"))?;
        self.at += N;
        Ok(found)
    }

    /// Where a value of this length ends: not beyond what it stands in.
    fn end(&self, tag: Tag, length: u32) -> Result<usize, Problem> {
        let limit = self.open.iter().rev().find_map(|end| *end).unwrap_or(self.bytes.len());
        let left = limit.saturating_sub(self.at);
        if length as usize <= left {
            return Ok(self.at + length as usize);
        }
        Err(self.wrong(tag, &format!("claims {length} bytes, {left} are left")))
    }

    fn wrong(&self, tag: Tag, what: &str) -> Problem {
        Problem::Dicom(format!("element {tag} before byte {}: {what}", self.at))
    }
}

/// VRs whose lengths have two bytes where they are explicit (PS3.5, 7.1.2).
fn has_short_length(vr: VR) -> bool {
    use VR::{AE, AS, AT, CS, DA, DS, DT, FD, FL, IS, LO, LT, PN, SH, SL, SS, ST, TM, UI, UL, US};
    matches!(vr, AE | AS | AT | CS | DA | DS | DT | FD | FL | IS | LO | LT | PN | SH | SL | SS | ST | TM | UI | UL | US)
}

/// Whether the standard has a sequence of this tag: what an implicit VR is.
fn is_sequence(tag: Tag) -> bool {
    StandardDataDictionary.by_tag(tag).is_some_and(|entry| entry.vr() == VirtualVr::Exact(VR::SQ))
}
