//! A needle from a row of `[[needle]]`.

use std::f64::consts::FRAC_PI_4;
use stylet_physics::insertion::{NaturalBend, NeedleSettings};
use stylet_physics::rod::RodStiffness;
use stylet_scene::Row;

/// What the engine is told of a needle.
///
/// # Errors
/// The column, what was found and what was expected.
pub fn settings(row: &Row) -> Result<NeedleSettings, String> {
    let number = |name: &str, otherwise: f64| row.get(name).unwrap_or(otherwise);
    let vector = |name: &str| row.value(name).map(|value| value.point::<3>()).transpose();
    let required = |name: &str| vector(name)?.ok_or_else(|| format!("{name}: missing"));
    let (outer, inner) = (number("diameter", 0.83e-3), number("inner_diameter", 0.0));
    if inner >= outer {
        return Err(format!("inner_diameter: found {inner} m, expected less than diameter = {outer} m"));
    }
    let direction = unit("direction", required("direction")?)?;
    let along_z = direction[2].abs() >= 0.9;
    let bevel_direction = vector("bevel_direction")?.unwrap_or(if along_z { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] });
    let bevel_direction = unit("bevel_direction", bevel_direction)?;
    let along: f64 = (0..3).map(|k| direction[k] * bevel_direction[k]).sum();
    if along.abs() > 0.999 {
        return Err("bevel_direction: found one along the needle, expected one across it".into());
    }
    let of_material = RodStiffness::tube(number("young", 60e9), number("poisson", 0.33), outer, inner)
        .map_err(|error| error.to_string())?;
    let stiffness = RodStiffness {
        bending: number("bending", of_material.bending),
        twisting: number("twisting", of_material.twisting),
        stretching: number("stretching", of_material.stretching),
    };
    let section = FRAC_PI_4 * (outer * outer - inner * inner);
    let (length, edge) = (number("length", 0.02), number("edge", 0.005));
    if edge > length {
        return Err(format!("edge: found {edge} m, expected at most length = {length} m"));
    }
    Ok(NeedleSettings {
        stiffness,
        linear_density: number("linear_density", number("density", 6450.0) * section),
        base: required("base")?,
        direction,
        bevel_direction,
        length,
        edge,
        bevel: number("bevel", 0.0),
        friction_ratio: number("friction_ratio", 1.0),
        damping: number("damping", 0.0),
        bend: bend(row)?,
        friction_factors: factors(row)?,
    })
}

/// The natural bend, of all of the needle where no length is given: more than any needle has.
fn bend(row: &Row) -> Result<Option<NaturalBend>, String> {
    const ALL: f64 = 1e3;
    match (row.get("curvature"), row.get("curved_length")) {
        (None | Some(0.0), Some(length)) => {
            Err(format!("curved_length: found {length} m of a straight needle, expected curvature to be set"))
        }
        (None | Some(0.0), None) => Ok(None),
        (Some(curvature), length) => Ok(Some(NaturalBend { curvature, length: length.unwrap_or(ALL) })),
    }
}

/// Depths at which seeds are left, m.
///
/// # Errors
/// A depth that is not positive.
pub fn release(row: &Row) -> Result<Vec<f64>, String> {
    let depths = row.value("release").map_or(Ok(&[][..]), |value| value.floats())?;
    match depths.iter().find(|depth| **depth <= 0.0) {
        Some(depth) => Err(format!("release: found {depth} m, expected depths above 0 m")),
        None => Ok(depths.to_vec()),
    }
}

fn factors(row: &Row) -> Result<Vec<(f64, f64)>, String> {
    let rows = row.value("friction_factor").map_or(Ok(&[][..]), |value| value.rows())?;
    let factors: Vec<(f64, f64)> =
        rows.iter().map(|row| (row.get("from").unwrap_or(0.0), row.get("factor").unwrap_or(1.0))).collect();
    match factors.windows(2).find(|pair| pair[1].0 <= pair[0].0) {
        Some(pair) => Err(format!(
            "friction_factor: from: found {} m after {} m, expected ascending distances",
            pair[1].0, pair[0].0
        )),
        None => Ok(factors),
    }
}

fn unit(name: &str, v: [f64; 3]) -> Result<[f64; 3], String> {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    if length > 1e-9 && length.is_finite() {
        return Ok(v.map(|x| x / length));
    }
    Err(format!("{name}: found {v:?}, expected a vector that is not zero"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use stylet_scene::Value;

    fn row(cells: &[(&'static str, Value)]) -> Row {
        let mut row: Row = [("base", Value::Floats(vec![0.0; 3])), ("direction", Value::Floats(vec![2.0, 0.0, 0.0]))]
            .into_iter()
            .collect();
        cells.iter().for_each(|(name, value)| row.set(name, value.clone()));
        row
    }

    #[test]
    fn stiffness_follows_from_the_material_or_is_given() {
        // EI of a nitinol wire of 0.83 mm at 60 GPa, and of an 18 G tube of steel.
        let wire = settings(&row(&[])).unwrap();
        assert!((wire.stiffness.bending / 1.398e-3 - 1.0).abs() < 1e-3, "{}", wire.stiffness.bending);
        assert!((wire.linear_density / 3.49e-3 - 1.0).abs() < 1e-2);
        let tube = [("young", 200e9), ("diameter", 1.27e-3), ("inner_diameter", 0.838e-3), ("density", 7900.0)];
        let tube: Vec<_> = tube.into_iter().map(|(name, x)| (name, Value::Float(x))).collect();
        let steel = settings(&row(&tube)).unwrap();
        assert!((steel.stiffness.bending / 0.0207 - 1.0).abs() < 5e-3, "{}", steel.stiffness.bending);
        assert!((steel.linear_density / 5.6e-3 - 1.0).abs() < 2e-2);
        assert_eq!(settings(&row(&[("bending", Value::Float(0.5))])).unwrap().stiffness.bending, 0.5);
        assert_eq!(wire.direction, [1.0, 0.0, 0.0]);
    }

    #[test]
    fn what_makes_no_sense_is_named() {
        let refusal = |name, value| settings(&row(&[(name, value)])).unwrap_err();
        assert!(refusal("direction", Value::Floats(vec![0.0; 3])).contains("not zero"));
        assert!(refusal("bevel_direction", Value::Floats(vec![1.0, 0.0, 0.0])).contains("across"));
        assert!(refusal("inner_diameter", Value::Float(1e-3)).contains("less than diameter"));
        assert!(refusal("edge", Value::Float(0.03)).contains("at most length"));
        assert!(release(&row(&[("release", Value::Floats(vec![-0.1]))])).unwrap_err().contains("above 0"));
    }
}
