//! DICOM RT structure sets (PS3.3, A.19 and C.8.8.5 to C.8.8.8).
//!
//! Read are ROI numbers and names from Structure Set ROI Sequence (3006,0020), and for each ROI of ROI Contour Sequence
//! (3006,0039) its contours (3006,0040): type (3006,0042), number of points (3006,0046) and data (3006,0050), millimetres in
//! the patient's axes: x to the left, y to the back, z to the head. `CLOSED_PLANAR` and `CLOSEDPLANAR_XOR` contours are
//! closed, `OPEN_PLANAR` ones open (which the check of contours refuses), ROIs of points are left out with a note. Planes
//! are axial. The order of ROI Contour Sequence is the order of precedence.
//!
//! Files are Explicit or Implicit VR Little Endian. Every length is checked against the file before it is used.
//!
//! Written are files in Explicit VR Little Endian with all modules that the standard demands, but nothing of a patient, and
//! no date: the same contours make the same bytes.

mod lengths;
mod plane;
mod read;
mod write;

pub use read::read;
pub use write::write;

/// Whether bytes start like a DICOM file: a preamble of 128 bytes, then `DICM`.
pub fn is_dicom(bytes: &[u8]) -> bool {
    bytes.get(128..132) == Some(b"DICM")
}
