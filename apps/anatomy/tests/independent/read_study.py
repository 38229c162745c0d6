#!/usr/bin/env python3
"""Reads the shipped DICOM file with pydicom, and compares it with the JSON file and with what the standard demands.

A script for developers, not part of `cargo test`:

    python3 -m venv .venv && .venv/bin/pip install pydicom
    .venv/bin/python apps/anatomy/tests/independent/read_study.py apps/anatomy/data

Compared are names, numbers of contours, and every coordinate exactly, as decimal numbers. Volumes are computed by
Cavalieri's rule, with areas by the shoelace formula, for comparison with those that the example prints. Ends with 1 if
anything differs.

Checked with pydicom 3.0.2; what it prints is in README.md beside this file.
"""

import json
import pathlib
import sys
from decimal import Decimal

import pydicom

# Type 1 and 2 attributes of the modules of the RT Structure Set IOD (PS3.3, A.19.3): present, type 1 not empty.
TYPE_1 = [
    "SOPClassUID", "SOPInstanceUID", "StudyInstanceUID", "SeriesInstanceUID", "Modality", "StructureSetLabel",
    "FrameOfReferenceUID", "StructureSetROISequence", "ROIContourSequence", "RTROIObservationsSequence",
]
TYPE_2 = [
    "PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyDate", "StudyTime", "AccessionNumber",
    "ReferringPhysicianName", "StudyID", "SeriesNumber", "OperatorsName", "Manufacturer", "PositionReferenceIndicator",
    "StructureSetDate", "StructureSetTime",
]
FAILURES = []


def expect(condition, message):
    if not condition:
        FAILURES.append(message)


def check_modules(data):
    expect(data.SOPClassUID == pydicom.uid.RTStructureSetStorage, f"SOP class {data.SOPClassUID}")
    expect(data.file_meta.MediaStorageSOPInstanceUID == data.SOPInstanceUID, "two instance UIDs")
    expect(data.Modality == "RTSTRUCT", f"modality {data.Modality}")
    for name in TYPE_1 + TYPE_2:
        expect(name in data, f"{name} is missing")
    for name in TYPE_1:
        expect(bool(getattr(data, name, None)), f"{name} is empty")
    for name in ("SOPInstanceUID", "StudyInstanceUID", "SeriesInstanceUID", "FrameOfReferenceUID"):
        expect(getattr(data, name).is_valid, f"{name} is no UID")
    numbers = [roi.ROINumber for roi in data.StructureSetROISequence]
    expect(numbers == [roi.ReferencedROINumber for roi in data.ROIContourSequence], "ROI numbers differ")
    expect(numbers == [roi.ReferencedROINumber for roi in data.RTROIObservationsSequence], "observations differ")


def area(points):
    pairs = zip(points, points[1:] + points[:1])
    return abs(sum(a[0] * b[1] - a[1] * b[0] for a, b in pairs)) / 2


def volume(contours):
    """Cavalieri's rule for equal distances, mL; contours side by side only."""
    heights = sorted({z for z, _ in contours})
    return float(heights[1] - heights[0]) * sum(float(area(points)) for _, points in contours) / 1e3


def contours_of(roi):
    """Heights and points, as the decimal numbers in the file."""
    for contour in roi.ContourSequence:
        data = [Decimal(str(x.original_string if hasattr(x, "original_string") else x)) for x in contour.ContourData]
        points = list(zip(data[0::3], data[1::3], data[2::3]))
        expect(contour.ContourGeometricType == "CLOSED_PLANAR", f"type {contour.ContourGeometricType}")
        expect(contour.NumberOfContourPoints == len(points), "number of points")
        expect(len({z for _, _, z in points}) == 1, "not in one plane")
        yield points[0][2], [(x, y) for x, y, _ in points]


def main():
    folder = pathlib.Path(sys.argv[1])
    data = pydicom.dcmread(folder / "synthetic.dcm")
    plain = json.loads((folder / "synthetic.json").read_text(), parse_float=Decimal)
    check_modules(data)
    names = [roi.ROIName for roi in data.StructureSetROISequence]
    expect(names == [organ["name"] for organ in plain["organs"]], f"names {names}")
    print("| organ | contours | points | volume, mL |\n|---|---|---|---|")
    for roi, organ in zip(data.ROIContourSequence, plain["organs"]):
        read = list(contours_of(roi))
        expected = [(c["z"], [tuple(p) for p in c["points"]]) for c in organ["contours"]]
        expect(read == expected, f"{organ['name']}: contours differ")
        points = sum(len(points) for _, points in read)
        print(f"| {organ['name']} | {len(read)} | {points} | {volume(read):.2f} |")
    for failure in FAILURES:
        print(f"FAILED: {failure}")
    print(f"pydicom {pydicom.__version__}: {'no differences' if not FAILURES else 'differences'}")
    return 1 if FAILURES else 0


if __name__ == "__main__":
    sys.exit(main())
