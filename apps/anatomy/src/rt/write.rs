//! Contours as a structure set.

use crate::{
    error::WriteError,
    length::{decimal, to_mm},
};
use dicom_core::{DataElement, Length, PrimitiveValue, Tag, VR, value::DataSetSequence};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{FileMetaTableBuilder, InMemDicomObject};
use stylet_mesh::generate::contours::{Drawing, PlanarContour};

/// Names of type LO have at most this many characters.
const LONGEST_NAME: usize = 64;
/// Display colours by turns.
const COLOURS: [&str; 6] = ["255\\0\\0", "255\\255\\0", "139\\69\\19", "240\\240\\220", "0\\128\\255", "0\\160\\0"];
/// This program, wherever it writes.
const IMPLEMENTATION: &str = "2.25.173914627086214937528470915632280164935";

/// The bytes of a DICOM RT structure set with these organs, `label`led so. UIDs are made of the content.
///
/// # Errors
/// [`WriteError`] for names that DICOM cannot hold and coordinates that are not finite.
pub fn write(drawings: &[Drawing], label: &str) -> Result<Vec<u8>, WriteError> {
    drawings.iter().map(|drawing| drawing.name.as_str()).chain([label]).try_for_each(check_name)?;
    let rois = roi_contours(drawings)?;
    let uid = Uids::new(drawings, label);
    let mut set = InMemDicomObject::new_empty();
    for (tag, vr, text) in [
        (tags::SPECIFIC_CHARACTER_SET, VR::CS, "ISO_IR 192"),
        (tags::SOP_CLASS_UID, VR::UI, uids::RT_STRUCTURE_SET_STORAGE),
        (tags::SOP_INSTANCE_UID, VR::UI, &uid.of("instance")),
        (tags::STUDY_DATE, VR::DA, ""),
        (tags::STUDY_TIME, VR::TM, ""),
        (tags::ACCESSION_NUMBER, VR::SH, ""),
        (tags::MODALITY, VR::CS, "RTSTRUCT"),
        (tags::MANUFACTURER, VR::LO, "Stylet"),
        (tags::REFERRING_PHYSICIAN_NAME, VR::PN, ""),
        (tags::OPERATORS_NAME, VR::PN, ""),
        (tags::PATIENT_NAME, VR::PN, ""),
        (tags::PATIENT_ID, VR::LO, ""),
        (tags::PATIENT_BIRTH_DATE, VR::DA, ""),
        (tags::PATIENT_SEX, VR::CS, ""),
        (tags::STUDY_INSTANCE_UID, VR::UI, &uid.of("study")),
        (tags::SERIES_INSTANCE_UID, VR::UI, &uid.of("series")),
        (tags::STUDY_ID, VR::SH, ""),
        (tags::SERIES_NUMBER, VR::IS, "1"),
        (tags::FRAME_OF_REFERENCE_UID, VR::UI, &uid.of("frame")),
        (tags::POSITION_REFERENCE_INDICATOR, VR::LO, ""),
        (tags::STRUCTURE_SET_LABEL, VR::SH, &label.chars().take(16).collect::<String>()),
        (tags::STRUCTURE_SET_NAME, VR::LO, label),
        (tags::STRUCTURE_SET_DATE, VR::DA, ""),
        (tags::STRUCTURE_SET_TIME, VR::TM, ""),
    ] {
        put(&mut set, tag, vr, text);
    }
    put_items(&mut set, tags::REFERENCED_FRAME_OF_REFERENCE_SEQUENCE, vec![frame(&uid)]);
    put_items(&mut set, tags::STRUCTURE_SET_ROI_SEQUENCE, roi_list(drawings, &uid));
    put_items(&mut set, tags::ROI_CONTOUR_SEQUENCE, rois);
    put_items(&mut set, tags::RTROI_OBSERVATIONS_SEQUENCE, observations(drawings));
    encode(set)
}

fn check_name(name: &str) -> Result<(), WriteError> {
    let fits = (1..=LONGEST_NAME).contains(&name.chars().count());
    // Readers take spaces at the ends for padding.
    let plain = !name.contains('\\') && !name.chars().any(char::is_control) && name.trim_matches(' ') == name;
    if fits && plain { Ok(()) } else { Err(WriteError::Name { name: name.into() }) }
}

fn frame(uid: &Uids) -> InMemDicomObject {
    let mut frame = InMemDicomObject::new_empty();
    put(&mut frame, tags::FRAME_OF_REFERENCE_UID, VR::UI, &uid.of("frame"));
    frame
}

/// Numbers and names.
fn roi_list(drawings: &[Drawing], uid: &Uids) -> Vec<InMemDicomObject> {
    let entry = |(i, drawing): (usize, &Drawing)| {
        let mut roi = InMemDicomObject::new_empty();
        put(&mut roi, tags::ROI_NUMBER, VR::IS, &(i + 1).to_string());
        put(&mut roi, tags::REFERENCED_FRAME_OF_REFERENCE_UID, VR::UI, &uid.of("frame"));
        put(&mut roi, tags::ROI_NAME, VR::LO, &drawing.name);
        put(&mut roi, tags::ROI_GENERATION_ALGORITHM, VR::CS, "MANUAL");
        roi
    };
    drawings.iter().enumerate().map(entry).collect()
}

fn roi_contours(drawings: &[Drawing]) -> Result<Vec<InMemDicomObject>, WriteError> {
    let entry = |(i, drawing): (usize, &Drawing)| {
        let mut roi = InMemDicomObject::new_empty();
        put(&mut roi, tags::ROI_DISPLAY_COLOR, VR::IS, COLOURS[i % COLOURS.len()]);
        let contours = drawing.contours.iter().enumerate().map(|(k, c)| contour(&drawing.name, k, c));
        put_items(&mut roi, tags::CONTOUR_SEQUENCE, contours.collect::<Result<_, _>>()?);
        put(&mut roi, tags::REFERENCED_ROI_NUMBER, VR::IS, &(i + 1).to_string());
        Ok(roi)
    };
    drawings.iter().enumerate().map(entry).collect()
}

fn contour(name: &str, number: usize, drawn: &PlanarContour) -> Result<InMemDicomObject, WriteError> {
    let mm: Vec<f64> = drawn.points.iter().flatten().map(|x| to_mm(*x)).collect();
    if !mm.iter().all(|x| x.is_finite()) {
        return Err(WriteError::Coordinate { name: name.into(), contour: number });
    }
    let mut contour = InMemDicomObject::new_empty();
    let kind = if drawn.open { "OPEN_PLANAR" } else { "CLOSED_PLANAR" };
    put(&mut contour, tags::CONTOUR_GEOMETRIC_TYPE, VR::CS, kind);
    put(&mut contour, tags::NUMBER_OF_CONTOUR_POINTS, VR::IS, &drawn.points.len().to_string());
    put(&mut contour, tags::CONTOUR_NUMBER, VR::IS, &(number + 1).to_string());
    let data = PrimitiveValue::Strs(mm.into_iter().map(decimal).collect());
    contour.put(DataElement::new(tags::CONTOUR_DATA, VR::DS, data));
    Ok(contour)
}

fn observations(drawings: &[Drawing]) -> Vec<InMemDicomObject> {
    let entry = |i: usize| {
        let mut observation = InMemDicomObject::new_empty();
        put(&mut observation, tags::OBSERVATION_NUMBER, VR::IS, &i.to_string());
        put(&mut observation, tags::REFERENCED_ROI_NUMBER, VR::IS, &i.to_string());
        put(&mut observation, tags::RTROI_INTERPRETED_TYPE, VR::CS, "ORGAN");
        put(&mut observation, tags::ROI_INTERPRETER, VR::PN, "");
        observation
    };
    (1..=drawings.len()).map(entry).collect()
}

fn put(object: &mut InMemDicomObject, tag: Tag, vr: VR, text: &str) {
    let value = if text.is_empty() { PrimitiveValue::Empty } else { PrimitiveValue::from(text) };
    object.put(DataElement::new(tag, vr, value));
}

fn put_items(object: &mut InMemDicomObject, tag: Tag, items: Vec<InMemDicomObject>) {
    object.put(DataElement::new(tag, VR::SQ, DataSetSequence::new(items, Length::UNDEFINED)));
}

fn encode(set: InMemDicomObject) -> Result<Vec<u8>, WriteError> {
    let refused = |error: &dyn std::error::Error| WriteError::Dicom(error.to_string());
    let meta = FileMetaTableBuilder::new()
        .transfer_syntax(uids::EXPLICIT_VR_LITTLE_ENDIAN)
        .implementation_class_uid(IMPLEMENTATION)
        .implementation_version_name("STYLET");
    let file = set.with_meta(meta).map_err(|error| refused(&error))?;
    let mut bytes = Vec::new();
    file.write_all(&mut bytes).map_err(|error| refused(&error))?;
    Ok(bytes)
}

/// UIDs made of the content: the same contours have the same, others other ones.
struct Uids(u128);

impl Uids {
    fn new(drawings: &[Drawing], label: &str) -> Self {
        let mut hash = Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d);
        hash.add(label.as_bytes());
        for drawing in drawings {
            hash.add(drawing.name.as_bytes());
            let numbers = drawing.contours.iter().flat_map(|c| c.points.iter().flatten());
            numbers.for_each(|x| hash.add(&to_mm(*x).to_le_bytes()));
        }
        hash
    }

    /// FNV-1a of 128 bits (Fowler, Noll & Vo).
    fn add(&mut self, bytes: &[u8]) {
        for byte in bytes {
            self.0 = (self.0 ^ u128::from(*byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }

    /// A UID under the root for UUIDs (PS3.5, B.2), with the version bits of a name-based one (RFC 9562, version 8).
    fn of(&self, role: &str) -> String {
        let mut own = Self(self.0);
        own.add(role.as_bytes());
        let uuid = own.0 & !(0xf << 76) & !(0x3 << 62) | (0x8 << 76) | (0x2 << 62);
        format!("2.25.{uuid}")
    }
}
