//! What holds for every picture: no panic, well-formed XML, finite coordinates, the same bytes each time.

use proptest::prelude::*;

use crate::{
    Bars, Chart, Colour, ColourMap, Cut, HistogramPanel, Marker, MeshPanel, MeshPicture, Picture, PlotError, Polyline,
    Series, SideBySide, SolidPicture, SpaceLine, Style, outline_of,
};

/// Numbers of every size, the special ones often.
fn number() -> impl Strategy<Value = f64> {
    let special = [0.0, -0.0, 1.0, -1.0, f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN, 5e-324];
    prop_oneof![
        4 => -2.0..2.0f64,
        1 => prop::sample::select(special.to_vec()),
        1 => any::<u64>().prop_map(f64::from_bits),
    ]
}

/// Follows every tag of a document; the first fault as an error.
fn well_formed(svg: &str) -> Result<(), String> {
    let mut open = Vec::new();
    let mut rest = svg;
    while let Some(start) = rest.find('<') {
        let end = start + rest[start..].find('>').ok_or("a tag without end")?;
        let tag = &rest[start + 1..end];
        if tag.contains('<') || !tag.matches('"').count().is_multiple_of(2) {
            return Err(format!("a broken tag: {tag}"));
        }
        let name = tag.trim_start_matches('/').split([' ', '/']).next().unwrap_or("");
        if tag.starts_with('/') {
            if open.pop() != Some(name) {
                return Err(format!("{name} closed but not open"));
            }
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        rest = &rest[end + 1..];
    }
    if open.is_empty() { Ok(()) } else { Err(format!("left open: {open:?}")) }
}

fn check(first: Result<String, PlotError>, second: Result<String, PlotError>) -> Result<(), TestCaseError> {
    match (first, second) {
        (Ok(svg), Ok(again)) => {
            prop_assert!(svg == again, "two runs differ");
            well_formed(&svg).map_err(TestCaseError::fail)?;
            let drawn: String =
                svg.lines().filter(|line| !line.starts_with("<text") && !line.starts_with("<title")).collect();
            prop_assert!(!drawn.contains("NaN") && !drawn.contains("inf"), "{}", drawn);
        }
        (Err(error), Err(again)) => {
            prop_assert_eq!(error.to_string(), again.to_string());
            prop_assert!(!error.to_string().contains('\n'));
        }
        _ => prop_assert!(false, "one run succeeds, the other fails"),
    }
    Ok(())
}

fn series() -> impl Strategy<Value = Series> {
    let style = prop::sample::select(vec![Style::Line, Style::Points, Style::LinePoints, Style::Steps, Style::Boxes]);
    let points = prop::collection::vec((number(), number()), 0..30);
    (any::<String>(), points, style, any::<bool>(), prop::option::of(any::<usize>()))
        .prop_map(|(name, points, style, dashed, colour)| Series { name, points, style, dashed, colour })
}

fn range() -> impl Strategy<Value = Option<(f64, f64)>> {
    prop::option::weighted(0.3, (number(), number()))
}

proptest! {
    #[test]
    fn any_chart_is_drawn_or_refused(
        text in any::<[String; 4]>(),
        log in any::<[bool; 2]>(),
        series in prop::collection::vec(series(), 0..4),
        levels in prop::collection::vec((number(), any::<String>()), 0..3),
        ranges in [range(), range()],
        size in [number(), number()],
    ) {
        let [title, x_label, y_label, note] = text;
        let ([log_x, log_y], [x_range, y_range]) = (log, ranges);
        // Marks at the same heights as levels, and true to scale by turns.
        let (marks, equal) = (levels.clone(), log_x != log_y);
        let chart =
            Chart { title, x_label, y_label, log_x, log_y, series, levels, marks, equal, x_range, y_range, note, size };
        check(chart.to_svg(), chart.to_svg())?;
    }

    #[test]
    fn any_mesh_is_drawn_or_refused(
        points in prop::collection::vec([number(), number()], 0..12),
        mut values in prop::collection::vec(number(), 12),
        triangles in prop::collection::vec(prop::array::uniform3(0u32..12), 0..12),
        line in prop::collection::vec([number(), number()], 0..5),
        at in [number(), number()],
        levels in any::<usize>(),
        range in range(),
        view in prop::option::weighted(0.2, [[number(), number()], [number(), number()]]),
        signed in any::<bool>(),
        label in any::<String>(),
    ) {
        values.truncate(points.len());
        let colours = if signed { ColourMap::Diverging } else { ColourMap::Sequential };
        let picture = MeshPicture {
            points: &points, triangles: &triangles, values: &values, title: label.clone(), colour_label: label.clone(),
            lines: vec![Polyline { points: line, width: at[0], tip: true, label: label.clone(), ..Polyline::default() }],
            markers: vec![Marker { at, colour: Colour(1, 2, 3), label }],
            outline: outline_of(&points, &triangles), edges: true, levels, range, colours, view,
            ..MeshPicture::default()
        };
        check(picture.to_svg(), picture.to_svg())?;
        let panel = MeshPanel { pictures: vec![picture.clone(), picture], columns: levels % 4, ..MeshPanel::default() };
        check(panel.to_svg(), panel.to_svg())?;
    }
}

proptest! {
    #[test]
    fn any_mesh_in_space_is_drawn_or_refused(
        points in prop::collection::vec([number(), number(), number()], 0..12),
        tetrahedra in prop::collection::vec(prop::array::uniform4(0u32..12), 0..12),
        triangles in prop::collection::vec(prop::array::uniform3(0u32..12), 0..6),
        mut values in prop::collection::vec(number(), 20),
        line in prop::collection::vec([number(), number(), number()], 0..5),
        cut in prop::option::of(([number(), number(), number()], number())),
        towards in [number(), number(), number()],
        range in range(),
        flags in any::<[bool; 3]>(),
        levels in any::<usize>(),
        size in [number(), number()],
        text in any::<[String; 2]>(),
    ) {
        values.truncate(tetrahedra.len() + triangles.len());
        let [title, label] = text;
        let picture = SolidPicture {
            points: &points, tetrahedra: &tetrahedra, triangles: &triangles, values: &values, title,
            colour_label: label.clone(), by_region: flags[0], levels, range,
            region_names: if flags[1] { vec!["a < b & \"c\"".into(), label.clone()] } else { Vec::new() },
            colours: if flags[1] { ColourMap::Diverging } else { ColourMap::Sequential },
            cut: cut.map(|(normal, offset)| Cut { normal, offset }), towards,
            lines: vec![SpaceLine { points: line, width: size[0], label, tip: true, ..SpaceLine::default() }],
            edges: flags[2], size, ..SolidPicture::default()
        };
        check(picture.to_svg(), picture.to_svg())?;
    }

    #[test]
    fn any_histogram_is_drawn_or_refused(
        counts in prop::collection::vec(prop_oneof![3 => 0..50usize, 1 => any::<usize>()], 0..8),
        ends in [number(), number()],
        beyond in any::<[usize; 2]>(),
        marks in prop::collection::vec(number(), 0..3),
        text in any::<[String; 3]>(),
        columns in 0..4usize,
    ) {
        let [title, label, note] = text;
        let bars = Bars { label, low: ends[0], high: ends[1], counts, below: beyond[0], above: beyond[1], marks, note };
        let panel = HistogramPanel { title: title.clone(), histograms: vec![bars; 3], columns };
        check(panel.to_svg(), panel.to_svg())?;
        let pictures = vec![Picture::Histograms(panel.clone()), Picture::Histograms(panel)];
        let both = SideBySide { title, pictures, ..SideBySide::default() };
        check(both.to_svg(), both.to_svg())?;
    }
}

/// The corners of a unit cube, and its six tetrahedra along the diagonal.
fn cube() -> (Vec<[f64; 3]>, Vec<[u32; 4]>) {
    let points = (0..8_u32).map(|i| [0, 1, 2].map(|k| f64::from(i >> k & 1))).collect();
    let paths = [[1, 2, 4], [1, 4, 2], [2, 1, 4], [2, 4, 1], [4, 1, 2], [4, 2, 1]];
    (points, paths.map(|[a, b, c]: [u32; 3]| [0, a, a + b, a + b + c]).to_vec())
}

fn n_faces(picture: &SolidPicture<'_>) -> usize {
    picture.to_svg().unwrap().matches("<path d=").count()
}

#[test]
fn of_a_cube_three_sides_are_seen_and_a_cut_opens_it() {
    let (points, tetrahedra) = cube();
    let values = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
    let whole = SolidPicture { points: &points, tetrahedra: &tetrahedra, values: &values, ..SolidPicture::default() };
    assert_eq!(n_faces(&whole), 6);
    // Cells on the viewer's side of the diagonal plane x = y are taken away, and one side more comes to light.
    let cut = SolidPicture { cut: Some(Cut { normal: [1.0, -1.0, 0.0], offset: 0.0 }), ..whole.clone() };
    let view = SolidPicture { towards: [1.0, -1.0, 0.1], ..cut.clone() };
    // Two triangles of the cut, one of the top.
    assert_eq!(n_faces(&view), 3);
    let beyond = SolidPicture { cut: Some(Cut { normal: [0.0, 0.0, 1.0], offset: -1.0 }), ..whole.clone() };
    assert!(beyond.to_svg().unwrap_err().to_string().starts_with("nothing to draw in \"\": 6 data points"));
    let regions = SolidPicture { by_region: true, ..whole };
    assert!(regions.to_svg().unwrap().contains(">region 5</text>"));
}

#[test]
fn large_meshes_give_files_of_bounded_size() {
    // A plate of 2 x 250 x 250 thin triangles, each smaller than a sample.
    let n = 700_u32;
    let points: Vec<[f64; 3]> = (0..=n).flat_map(|j| (0..=n).map(move |i| [f64::from(i), 0.0, f64::from(j)])).collect();
    let triangles: Vec<[u32; 3]> = (0..n)
        .flat_map(|j| (0..n).map(move |i| j * (n + 1) + i))
        .flat_map(|a| [[a, a + 1, a + n + 2], [a, a + n + 2, a + n + 1]])
        .collect();
    let values: Vec<f64> = triangles.iter().map(|t| f64::from(t[0] % 97)).collect();
    let svg = SolidPicture { points: &points, triangles: &triangles, values: &values, ..SolidPicture::default() }
        .to_svg()
        .unwrap();
    assert!(svg.len() < 3_000_000, "{} bytes", svg.len());
    assert!(svg.matches("<path d=").count() > 10_000);
}

#[test]
fn triangles_with_values_of_their_own_have_one_colour_each() {
    let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let picture = MeshPicture {
        points: &points,
        triangles: &[[0, 1, 2], [1, 3, 2]],
        cell_values: Some(&[3.0, 7.0]),
        levels: 2,
        ..MeshPicture::default()
    };
    let svg = picture.to_svg().unwrap();
    for band in [ColourMap::Sequential.at(0.0), ColourMap::Sequential.at(1.0)] {
        assert_eq!(svg.matches(&format!("<path fill=\"{band}\"")).count(), 1);
    }
    let short = MeshPicture { cell_values: Some(&[1.0]), ..picture };
    assert!(short.to_svg().unwrap_err().to_string().contains("2 points and 1 values"));
}

#[test]
fn malformed_meshes_are_named() {
    let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]];
    let picture = |triangles, values| MeshPicture {
        points: &points,
        triangles,
        values,
        title: "m".into(),
        ..MeshPicture::default()
    };
    let message = |picture: MeshPicture<'_>| picture.to_svg().unwrap_err().to_string();
    assert_eq!(message(picture(&[[0, 1, 2]], &[0.0])), "mesh picture \"m\" has 3 points and 1 values");
    assert_eq!(
        message(picture(&[[0, 1, 2], [0, 1, 3]], &[0.0; 3])),
        "mesh picture \"m\": triangle 1 names point 3 of 3"
    );
    assert!(message(picture(&[], &[0.0; 3])).starts_with("nothing to draw in \"m\": 0 data points"));
    assert!(MeshPanel::default().to_svg().is_err());
}

#[test]
fn what_cannot_be_shown_is_counted() {
    let points = vec![(1.0, 1.0), (2.0, -1.0), (f64::NAN, 1.0), (3.0, 10.0)];
    let chart = Chart { log_y: true, series: vec![Series { points, ..Series::default() }], ..Chart::default() };
    assert!(chart.to_svg().unwrap().contains("2 points left out: not finite, or not positive on a logarithmic axis."));
    let empty = Chart { log_y: true, series: vec![Series { points: vec![(1.0, 0.0)], ..Series::default() }], ..chart };
    assert!(empty.to_svg().unwrap_err().to_string().starts_with("nothing to draw in \"\": 1 data points"));
}

/// A constant field is one colour; a triangle without a value is grey and in the legend.
#[test]
fn missing_values_are_grey() {
    let points = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
    let triangles = [[0, 1, 2], [1, 3, 2]];
    let values = [2.0, 2.0, 2.0, f64::NAN];
    let svg = MeshPicture { points: &points, triangles: &triangles, values: &values, ..MeshPicture::default() }
        .to_svg()
        .unwrap();
    assert_eq!(svg.matches(&format!("<path fill=\"{}\"", Colour::NO_DATA)).count(), 1);
    assert!(svg.contains(">no value</text>"));
}
