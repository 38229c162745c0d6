//! What readers of fields share: names that are free, and memory that the file has paid for.

use super::{DataField, Problem};

/// Numbers in fields that a file may ask for, per byte of it. Formats with sparse fields could otherwise ask for the
/// points times the fields, which grows with the square of the file.
const VALUES_PER_BYTE: u64 = 4;
/// So that no small file is refused.
const FREE_VALUES: u64 = 1 << 16;

/// Numbers that may still be allocated for fields.
pub(super) struct Budget {
    limit: u64,
    taken: u64,
}

impl Budget {
    /// The budget of a mesh in these files.
    pub fn of<'a>(files: impl Iterator<Item = &'a [u8]>) -> Self {
        let bytes: u64 = files.map(|bytes| bytes.len() as u64).sum();
        Self { limit: FREE_VALUES.saturating_add(VALUES_PER_BYTE.saturating_mul(bytes)), taken: 0 }
    }

    /// Pays for `entries` of so many components each.
    pub fn take(&mut self, entries: u64, components: u64) -> Result<(), Problem> {
        self.taken = self.taken.saturating_add(entries.saturating_mul(components));
        if self.taken > self.limit {
            let what = "numbers in fields for a file of this size".into();
            return Err(Problem::Limit { what, found: self.taken, limit: self.limit });
        }
        Ok(())
    }
}

/// Fields of one kind that are read: names are compared each with each.
const MOST_FIELDS: usize = 4096;

/// Adds a field; one whose name is taken (files have several of one name for time steps) gets a number behind it, and
/// one without a name is called `unnamed`.
pub(super) fn add(fields: &mut Vec<DataField>, mut field: DataField) -> Result<(), Problem> {
    if fields.len() >= MOST_FIELDS {
        let (found, limit) = (fields.len() as u64 + 1, MOST_FIELDS as u64);
        return Err(Problem::Limit { what: "fields".into(), found, limit });
    }
    if field.name.is_empty() {
        field.name = "unnamed".to_owned();
    }
    let is_taken = |name: &str| fields.iter().any(|other| other.name == name);
    if is_taken(&field.name) {
        let like = format!("{} #", field.name);
        let mut number = 2 + fields.iter().filter(|other| other.name.starts_with(&like)).count();
        // Ends: there are more numbers than fields.
        while is_taken(&format!("{like}{number}")) {
            number += 1;
        }
        field.name = format!("{like}{number}");
    }
    fields.push(field);
    Ok(())
}

/// The names that fields are written under: with `_` for what the format has no way to write, and with a number behind
/// where that, or a name that the format keeps for itself, would make two alike. Each change is noted.
pub(super) fn written_names(
    fields: &[DataField],
    reserved: &[&str],
    is_legal: fn(char) -> bool,
    notes: &mut Vec<String>,
) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(fields.len());
    for field in fields {
        let plain: String = field.name.chars().map(|c| if is_legal(c) { c } else { '_' }).collect();
        let is_taken = |name: &str| reserved.contains(&name) || names.iter().any(|other| other == name);
        let mut name = plain.clone();
        let mut number = 2;
        // Ends: there are more numbers than names.
        while is_taken(&name) {
            name = format!("{plain} #{number}");
            number += 1;
        }
        if name != field.name {
            notes.push(format!("the name of field {:?}, written as {name:?}", field.name));
        }
        names.push(name);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_unique() {
        let mut fields = Vec::new();
        for name in ["u", "", "u", "v", "u", "", "u #2"] {
            add(&mut fields, DataField { name: name.to_owned(), components: 1, values: Vec::new() }).unwrap();
        }
        let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["u", "unnamed", "u #2", "v", "u #3", "unnamed #2", "u #2 #2"]);
    }

    #[test]
    fn fields_are_limited() {
        let mut fields = Vec::new();
        let mut added =
            (0..=MOST_FIELDS).map(|_| add(&mut fields, DataField { components: 1, ..DataField::default() }));
        assert!(added.by_ref().take(MOST_FIELDS).all(|result| result.is_ok()));
        assert!(matches!(added.next(), Some(Err(Problem::Limit { .. }))));
    }

    #[test]
    fn a_budget_ends() {
        let mut budget = Budget::of([&[0_u8; 100][..]].into_iter());
        assert!(budget.take(1 << 16, 1).is_ok());
        assert!(budget.take(400, 1).is_ok());
        assert!(budget.take(1, 1).is_err());
        assert!(Budget::of(std::iter::empty()).take(u64::MAX, u64::MAX).is_err());
    }

    #[test]
    fn names_for_writing_are_legal_and_unique() {
        let named = |name: &str| DataField { name: name.to_owned(), components: 1, values: Vec::new() };
        let fields = ["u", "a\"b", "a_b", "region"].map(named);
        let mut notes = Vec::new();
        let names = written_names(&fields, &["region"], |c| c != '"', &mut notes);
        assert_eq!(names, ["u", "a_b", "a_b #2", "region #2"]);
        assert_eq!(notes.len(), 3);
    }
}
