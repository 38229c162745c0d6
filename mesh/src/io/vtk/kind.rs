//! Types of the numbers in VTK arrays.

use crate::io::cursor::ByteOrder;

/// The type of a number.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Kind {
    /// By its name in XML files.
    pub fn of_xml(name: &str) -> Option<Self> {
        Some(match name {
            "Int8" => Self::I8,
            "UInt8" => Self::U8,
            "Int16" => Self::I16,
            "UInt16" => Self::U16,
            "Int32" => Self::I32,
            "UInt32" => Self::U32,
            "Int64" => Self::I64,
            "UInt64" => Self::U64,
            "Float32" => Self::F32,
            "Float64" => Self::F64,
            _ => return None,
        })
    }

    /// By its name in legacy files, in whatever case. `long` has 64 bits, as on the machines that write such files today.
    pub fn of_legacy(name: &[u8]) -> Option<Self> {
        Some(match name.to_ascii_lowercase().as_slice() {
            b"char" | b"signed_char" | b"vtktypeint8" => Self::I8,
            b"unsigned_char" | b"vtktypeuint8" => Self::U8,
            b"short" | b"vtktypeint16" => Self::I16,
            b"unsigned_short" | b"vtktypeuint16" => Self::U16,
            // Ids have 32 bits in files, whatever they have in memory.
            b"int" | b"vtkidtype" | b"vtktypeint32" => Self::I32,
            b"unsigned_int" | b"vtktypeuint32" => Self::U32,
            b"long" | b"long_long" | b"vtktypeint64" => Self::I64,
            b"unsigned_long" | b"unsigned_long_long" | b"vtktypeuint64" => Self::U64,
            b"float" => Self::F32,
            b"double" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes of a number.
    pub fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    pub fn is_real(self) -> bool {
        matches!(self, Self::F32 | Self::F64)
    }

    /// A number from as many bytes as it has. Integers beyond 2^53 are rounded.
    pub fn real(self, order: ByteOrder, bytes: &[u8]) -> f64 {
        match self {
            Self::F32 => f64::from(f32::from_ne_bytes(order.native(bytes))),
            Self::F64 => order.f64(bytes),
            Self::U64 => order.u64(bytes) as f64,
            _ => self.integer(order, bytes) as f64,
        }
    }

    /// An integer from as many bytes as it has; -1 for a real number, or for one beyond 63 bits: nothing that counts or
    /// names anything is either.
    pub fn integer(self, order: ByteOrder, bytes: &[u8]) -> i64 {
        match self {
            Self::I8 => i64::from(bytes[0] as i8),
            Self::U8 => i64::from(bytes[0]),
            Self::I16 => i64::from(i16::from_ne_bytes(order.native(bytes))),
            Self::U16 => i64::from(u16::from_ne_bytes(order.native(bytes))),
            Self::I32 => i64::from(order.i32(bytes)),
            Self::U32 => i64::from(order.i32(bytes) as u32),
            Self::I64 => order.u64(bytes) as i64,
            Self::U64 => i64::try_from(order.u64(bytes)).unwrap_or(-1),
            Self::F32 | Self::F64 => -1,
        }
    }
}
