//! The published values: tables of chapter 6 of Nienhuys, *Cutting in deformable objects* (PhD thesis, Utrecht, 2003).

/// Table 6.1: tolerance, mean and maximal error (mm) on the uniform h7 mesh.
pub const TABLE_6_1: [(f64, f64, f64); 6] = [
    (0.3, 0.74, 2.98),
    (0.1, 0.061, 0.18),
    (0.03, 0.034, 0.083),
    (0.01, 0.011, 0.022),
    (0.003, 0.0038, 0.0096),
    (0.001, 0.0008, 0.0021),
];

/// Table 6.2: iterations by h_start (1 to 6) and h_ref (3 to 7); `None` where h_ref is coarser than h_start.
pub const TABLE_6_2: [[Option<f64>; 5]; 6] = [
    [Some(22.), Some(34.), Some(45.), Some(62.), Some(84.)],
    [Some(27.), Some(36.), Some(46.), Some(64.), Some(84.)],
    [Some(46.), Some(49.), Some(58.), Some(73.), Some(93.)],
    [None, Some(81.), Some(86.), Some(96.), Some(115.)],
    [None, None, Some(204.), Some(208.), Some(194.)],
    [None, None, None, Some(278.), Some(285.)],
];

/// Table 6.3, mean error (mm), laid out as [`TABLE_6_2`].
pub const TABLE_6_3_MEAN: [[Option<f64>; 5]; 6] = [
    [Some(0.34), Some(0.33), Some(0.33), Some(0.30), Some(0.28)],
    [Some(0.26), Some(0.24), Some(0.24), Some(0.21), Some(0.20)],
    [Some(0.15), Some(0.13), Some(0.13), Some(0.10), Some(0.08)],
    [None, Some(0.09), Some(0.08), Some(0.04), Some(0.03)],
    [None, None, Some(0.07), Some(0.03), Some(0.00)],
    [None, None, None, Some(0.02), Some(0.00)],
];

/// Table 6.3, maximal error (mm).
pub const TABLE_6_3_MAX: [[Option<f64>; 5]; 6] = [
    [Some(1.01), Some(0.88), Some(0.88), Some(0.87), Some(0.87)],
    [Some(0.91), Some(0.68), Some(0.61), Some(0.54), Some(0.53)],
    [Some(0.66), Some(0.54), Some(0.51), Some(0.29), Some(0.27)],
    [None, Some(0.45), Some(0.43), Some(0.19), Some(0.14)],
    [None, None, Some(0.41), Some(0.17), Some(0.06)],
    [None, None, None, Some(0.16), Some(0.03)],
];

/// Table 6.4 (h3/h6): speed, mean and maximal error (mm) against speed 0.005.
pub const TABLE_6_4: [(f64, f64, f64); 6] = [
    (3.0, 0.62, 1.60),
    (1.0, 0.68, 1.96),
    (0.3, 0.15, 0.34),
    (0.1, 0.18, 0.68),
    (0.03, 0.36, 1.08),
    (0.01, 0.07, 0.27),
];

/// One line of Table 6.5.
pub struct Timing {
    /// Advance per rearrangement, in h_ref.
    pub speed: f64,
    /// Seconds on a Pentium III at 1 GHz.
    pub seconds: f64,
    /// Rearrangements.
    pub cycles: f64,
    /// Mean iterations.
    pub mean: f64,
    /// Most iterations.
    pub most: f64,
}

const fn timing(speed: f64, seconds: f64, cycles: f64, mean: f64, most: f64) -> Timing {
    Timing { speed, seconds, cycles, mean, most }
}

/// Table 6.5: h_ref and its lines, h_start = h3.
pub const TABLE_6_5: [(i64, [Timing; 6]); 2] = [
    (
        6,
        [
            timing(3.0, 0.80, 157., 11.81, 41.),
            timing(1.0, 0.90, 232., 11.52, 62.),
            timing(0.3, 0.94, 308., 10.87, 70.),
            timing(0.1, 1.07, 504., 8.14, 61.),
            timing(0.03, 2.24, 1478., 5.31, 57.),
            timing(0.01, 5.77, 4187., 3.87, 51.),
        ],
    ),
    (
        7,
        [
            timing(3.0, 2.46, 243., 12.67, 57.),
            timing(1.0, 2.80, 401., 10.88, 82.),
            timing(0.3, 3.15, 561., 10.03, 66.),
            timing(0.1, 3.48, 1000., 6.63, 67.),
            timing(0.03, 6.34, 2966., 4.18, 53.),
            timing(0.01, 15.68, 8505., 3.15, 48.),
        ],
    ),
];

/// Table 6.6: relocated against not relocated, mean and maximal difference (mm).
pub const TABLE_6_6_DIFFERENCE: (f64, f64) = (0.019, 0.23);
/// Table 6.6: discretisation error with relocation.
pub const TABLE_6_6_WITH: (f64, f64) = (0.094, 0.43);
/// Table 6.6: discretisation error without relocation.
pub const TABLE_6_6_WITHOUT: (f64, f64) = (0.095, 0.37);

/// Figure 6.12: difference of the tip's reference position between linear and neo-Hookean, mm ("approximately 8 mm").
pub const FIGURE_6_12_TIP_MM: f64 = 8.0;
/// Figure 6.12: triangles at the end of the neo-Hookean insertion.
pub const FIGURE_6_12_TRIANGLES: f64 = 625.0;
