//! A structure set's contours.

use super::{is_dicom, lengths, plane::other_than_axial};
use crate::{
    error::{Place, Problem},
    length::from_mm,
    study::Study,
};
use dicom_core::{Tag, header::HasLength};
use dicom_dictionary_std::{tags, uids};
use dicom_object::{InMemDicomObject, OpenFileOptions, file::ReadPreamble, mem::InMemElement};
use stylet_mesh::generate::contours::{Drawing, PlanarContour};

const ROI_LIST: &str = "Structure Set ROI Sequence (3006,0020)";
const ROI_NUMBER: &str = "ROI Number (3006,0022)";
const ROI_NAME: &str = "ROI Name (3006,0026)";
const ROI_CONTOURS: &str = "ROI Contour Sequence (3006,0039)";
const REFERENCED: &str = "Referenced ROI Number (3006,0084)";
const CONTOURS: &str = "Contour Sequence (3006,0040)";
const KIND: &str = "Contour Geometric Type (3006,0042)";
const COUNT: &str = "Number of Contour Points (3006,0046)";
const DATA: &str = "Contour Data (3006,0050)";

/// The organs of a DICOM RT structure set.
///
/// # Errors
/// [`Problem`], with the ROI and the contour where there is one.
pub fn read(bytes: &[u8]) -> Result<Study, Problem> {
    if !is_dicom(bytes) {
        return Err(Problem::Dicom("expected \"DICM\" after 128 bytes".into()));
    }
    lengths::check(bytes)?;
    // What follows the contours' group is of no interest.
    let options = OpenFileOptions::new().read_preamble(ReadPreamble::Always).read_until(Tag(0x3008, 0));
    let file = options.from_reader(bytes).map_err(|error| Problem::Dicom(in_full(&error)))?;
    check_class(&file)?;
    let names = roi_names(&file)?;
    let mut study = Study::default();
    for (item, roi) in items(&file, tags::ROI_CONTOUR_SEQUENCE).unwrap_or_default().iter().enumerate() {
        let place = Place { item: Some(item), ..Place::default() };
        let number = integer(roi, tags::REFERENCED_ROI_NUMBER, REFERENCED, &place)?;
        let mut named = names.iter().filter(|(n, _)| *n == number);
        let (Some((_, name)), 0) = (named.next(), named.count()) else {
            let found = names.iter().filter(|(n, _)| *n == number).count();
            return Err(Problem::RoiNumber { number, found });
        };
        read_roi(roi, number, name, &mut study)?;
    }
    if study.drawings.is_empty() {
        return Err(match file.get(tags::ROI_CONTOUR_SEQUENCE) {
            None => Problem::Missing { place: Place::default(), element: ROI_CONTOURS },
            Some(_) => Problem::NoContour { rois: names.len() },
        });
    }
    Ok(study)
}

fn check_class(file: &InMemDicomObject) -> Result<(), Problem> {
    let found = file.get(tags::SOP_CLASS_UID).and_then(|element| element.to_str().ok());
    let found = found.map_or_else(String::new, |uid| uid.trim_end_matches(['\0', ' ']).to_owned());
    if found == uids::RT_STRUCTURE_SET_STORAGE {
        return Ok(());
    }
    let found = if found.is_empty() { "(0008,0016) is missing".into() } else { found };
    Err(Problem::SopClass { found, expected: uids::RT_STRUCTURE_SET_STORAGE })
}

/// Numbers and names of the ROIs.
fn roi_names(file: &InMemDicomObject) -> Result<Vec<(i64, String)>, Problem> {
    let Some(list) = items(file, tags::STRUCTURE_SET_ROI_SEQUENCE) else {
        return Err(Problem::Missing { place: Place::default(), element: ROI_LIST });
    };
    let entry = |(item, roi): (usize, &InMemDicomObject)| {
        let place = Place { item: Some(item), ..Place::default() };
        let number = integer(roi, tags::ROI_NUMBER, ROI_NUMBER, &place)?;
        let place = Place { roi: Some(number), ..Place::default() };
        Ok((number, text(roi, tags::ROI_NAME, ROI_NAME, &place)?))
    };
    list.iter().enumerate().map(entry).collect()
}

/// Adds the ROI's drawing, or a note why it has none.
fn read_roi(roi: &InMemDicomObject, number: i64, name: &str, study: &mut Study) -> Result<(), Problem> {
    let place = |item| Place { roi: Some(number), name: Some(name.into()), item };
    let contours = items(roi, tags::CONTOUR_SEQUENCE).unwrap_or_default();
    let (mut drawn, mut points) = (Vec::new(), 0);
    for (i, contour) in contours.iter().enumerate() {
        match read_contour(contour, &place(Some(i)))? {
            Some(contour) => drawn.push(contour),
            None => points += 1,
        }
    }
    if points > 0 {
        study.notes.push(format!("{}: left out {points} items of type POINT", place(None)));
    }
    if drawn.is_empty() {
        study.notes.push(format!("{}: no contour in {CONTOURS}, left out", place(None)));
    } else {
        study.drawings.push(Drawing { name: name.into(), contours: drawn });
    }
    Ok(())
}

/// One contour; `None` for a single point.
fn read_contour(contour: &InMemDicomObject, place: &Place) -> Result<Option<PlanarContour>, Problem> {
    let kind = text(contour, tags::CONTOUR_GEOMETRIC_TYPE, KIND, place)?;
    let open = match kind.as_str() {
        "CLOSED_PLANAR" | "CLOSEDPLANAR_XOR" => false,
        "OPEN_PLANAR" => true,
        "POINT" => return Ok(None),
        _ => return Err(wrong(place, KIND, format!("{kind:?}"), "CLOSED_PLANAR")),
    };
    let points = points(contour, place)?;
    if let Some(plane) = other_than_axial(&points) {
        return Err(Problem::NotAxial { place: place.clone(), plane });
    }
    Ok(Some(PlanarContour { points: points.iter().map(|p| p.map(from_mm)).collect(), open }))
}

/// The points of a contour, mm, as many as it says.
fn points(contour: &InMemDicomObject, place: &Place) -> Result<Vec<[f64; 3]>, Problem> {
    let Some(data) = present(contour, tags::CONTOUR_DATA) else {
        return Err(Problem::Missing { place: place.clone(), element: DATA });
    };
    let numbers = data.to_multi_float64().map_err(|error| wrong(place, DATA, in_full(&error), "decimal numbers"))?;
    let (triples, rest) = numbers.as_chunks::<3>();
    if !rest.is_empty() {
        return Err(wrong(place, DATA, format!("{} numbers", numbers.len()), "three for each point"));
    }
    if let Some(value) = numbers.iter().find(|x| !x.is_finite()) {
        return Err(wrong(place, DATA, value.to_string(), "finite numbers"));
    }
    // The count is mandatory in the standard, and often missing.
    if present(contour, tags::NUMBER_OF_CONTOUR_POINTS).is_some() {
        let count = integer(contour, tags::NUMBER_OF_CONTOUR_POINTS, COUNT, place)?;
        if count != triples.len() as i64 {
            return Err(wrong(place, COUNT, count.to_string(), &format!("{}, the points in {DATA}", triples.len())));
        }
    }
    Ok(triples.to_vec())
}

fn items(object: &InMemDicomObject, tag: Tag) -> Option<&[InMemDicomObject]> {
    object.get(tag)?.items()
}

/// The element, if it is there and not empty.
fn present(object: &InMemDicomObject, tag: Tag) -> Option<&InMemElement> {
    object.get(tag).filter(|element| !element.is_empty())
}

fn text(object: &InMemDicomObject, tag: Tag, element: &'static str, place: &Place) -> Result<String, Problem> {
    let missing = || Problem::Missing { place: place.clone(), element };
    let found = present(object, tag).ok_or_else(missing)?.to_str();
    let found = found.map_err(|error| wrong(place, element, in_full(&error), "text"))?;
    match found.trim_matches([' ', '\0']) {
        "" => Err(missing()),
        text => Ok(text.to_owned()),
    }
}

fn integer(object: &InMemDicomObject, tag: Tag, element: &'static str, place: &Place) -> Result<i64, Problem> {
    let found = text(object, tag, element, place)?;
    found.parse().map_err(|_| wrong(place, element, format!("{found:?}"), "a whole number"))
}

fn wrong(place: &Place, element: &'static str, found: String, expected: &str) -> Problem {
    Problem::Value { place: place.clone(), element, found, expected: expected.into() }
}

/// An error with all its causes.
fn in_full(error: &dyn std::error::Error) -> String {
    let mut text = error.to_string();
    let mut cause = error.source();
    while let Some(next) = cause {
        let more = next.to_string();
        if !text.contains(&more) {
            text = format!("{text}: {more}");
        }
        cause = next.source();
    }
    text
}
