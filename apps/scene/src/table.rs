//! The declaration of a scene: its stages and its keys.

use crate::{Kind, Value};

/// One key of a scene: where it stands, what it may hold, what it means, and which field it reaches.
pub struct Key<S: 'static> {
    /// Dotted path, such as `mesh.h_start`; all but the last part name a [`Stage`].
    pub path: &'static str,
    /// Type and range.
    pub kind: Kind,
    /// Unit, empty for a pure number.
    pub unit: &'static str,
    /// The default as the reference shows it: TOML text, or words such as `by stage`.
    pub default: &'static str,
    /// What it is, in a sentence.
    pub meaning: &'static str,
    /// Stores a value of this key's kind. An error is a short reason, shown behind the key.
    pub set: fn(&mut S, &Value) -> Result<(), String>,
    /// The value in a scene, `None` if the scene does not have it.
    pub get: fn(&S) -> Option<Value>,
}

/// One table of a scene file, which is one stage of the simulation.
pub struct Stage<S: 'static> {
    /// Name of the TOML table, such as `mesh`; dotted for a table within a table.
    pub name: &'static str,
    /// What the stage is, in a sentence.
    pub meaning: &'static str,
    /// Whether a file without this table is refused.
    pub required: bool,
    /// Makes the stage exist, with its defaults. It is called once more for a stage that is there already, which it
    /// must then leave as it is.
    pub enable: fn(&mut S),
}

impl<S> Stage<S> {
    /// A stage that a scene file may leave out.
    pub const fn optional(name: &'static str, meaning: &'static str, enable: fn(&mut S)) -> Self {
        Self { name, meaning, required: false, enable }
    }
}

/// All that a scene file of one application may say.
pub struct Table<S: 'static> {
    /// The tables, in the order in which they are documented, enabled and written.
    pub stages: &'static [Stage<S>],
    /// The keys, in the order in which they are documented, set and written.
    pub keys: &'static [Key<S>],
}

impl<S> Key<S> {
    /// The path of the table that this key stands in, empty for a key at the top of the file.
    pub(crate) fn stage(&self) -> &'static str {
        self.path.rsplit_once('.').map_or("", |(stage, _)| stage)
    }

    /// The last part of the path.
    pub(crate) fn name(&self) -> &'static str {
        self.path.rsplit_once('.').map_or(self.path, |(_, name)| name)
    }
}

impl<S> Table<S> {
    /// Position of the key with this path.
    pub(crate) fn key_index(&self, path: &str) -> Option<usize> {
        self.keys.iter().position(|key| key.path == path)
    }

    /// Whether this path is a declared table, or leads to one.
    pub(crate) fn is_table(&self, path: &str) -> bool {
        self.stages.iter().any(|stage| is_within(stage.name, path))
    }

    /// Enables a table and those around it, outermost first.
    pub(crate) fn enable(&self, path: &str, scene: &mut S) {
        let mut around: Vec<_> = self.stages.iter().filter(|stage| is_within(path, stage.name)).collect();
        around.sort_by_key(|stage| stage.name.len());
        for stage in around {
            (stage.enable)(scene);
        }
    }

    /// The first fault of the declaration itself: for a test of the application that wrote it.
    ///
    /// # Errors
    /// A sentence about a path that is not made of bare TOML keys, is declared twice, has no stage or hides one; an
    /// empty range; or an empty or repeated list of words or columns.
    pub fn check(&self) -> Result<(), String> {
        for (i, stage) in self.stages.iter().enumerate() {
            check_path("stage", stage.name)?;
            if self.stages[..i].iter().any(|other| other.name == stage.name) {
                return Err(format!("stage {} is declared twice", stage.name));
            }
        }
        for (i, key) in self.keys.iter().enumerate() {
            let path = key.path;
            check_path("key", path)?;
            if self.keys[..i].iter().any(|other| other.path == path) {
                return Err(format!("key {path} is declared twice"));
            }
            if !key.stage().is_empty() && !self.stages.iter().any(|stage| stage.name == key.stage()) {
                return Err(format!("key {path} has no stage {}", key.stage()));
            }
            if self.is_table(path) {
                return Err(format!("key {path} is a stage as well"));
            }
            check_kind(key.kind).map_err(|reason| format!("key {path}: {reason}"))?;
        }
        Ok(())
    }
}

/// Whether the dotted path `inner` is `outer` or stands within it.
fn is_within(inner: &str, outer: &str) -> bool {
    inner.strip_prefix(outer).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
}

fn check_path(what: &str, path: &str) -> Result<(), String> {
    if path.split('.').all(is_bare) { Ok(()) } else { Err(format!("{what} {path:?} is not made of bare TOML keys")) }
}

/// Whether TOML takes this key without quotes.
pub(crate) fn is_bare(part: &str) -> bool {
    !part.is_empty() && part.bytes().all(|b| b.is_ascii_alphanumeric() || b == b'_' || b == b'-')
}

fn check_kind(kind: Kind) -> Result<(), String> {
    match kind {
        Kind::Int { min, max } if min > max => Err(format!("no integer from {min} to {max}")),
        Kind::Choice(words) => check_names(words),
        Kind::Point { dim_min, dim_max } if dim_min > dim_max || dim_max == 0 => {
            Err(format!("no list of {dim_min} to {dim_max} numbers"))
        }
        Kind::Rows(columns) => {
            let names: Vec<_> = columns.iter().map(|column| column.name).collect();
            if let Some(name) = names.iter().find(|name| !is_bare(name)) {
                return Err(format!("column {name:?} is not a bare TOML key"));
            }
            check_names(&names)?;
            columns.iter().try_for_each(|column| {
                check_kind(column.kind).map_err(|reason| format!("column {}: {reason}", column.name))
            })
        }
        _ => Ok(()),
    }
}

fn check_names(names: &[&str]) -> Result<(), String> {
    if names.is_empty() {
        return Err("an empty list".into());
    }
    match (1..names.len()).find(|&i| names[..i].contains(&names[i])) {
        Some(i) => Err(format!("{} is listed twice", names[i])),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample;

    #[test]
    fn the_sample_declaration_is_sound() {
        assert_eq!(sample::TABLE.check(), Ok(()));
    }

    #[test]
    fn faults_of_a_declaration_are_found() {
        const NOTHING: fn(&mut ()) = |_| {};
        const fn key(path: &'static str, kind: Kind) -> Key<()> {
            Key { path, kind, unit: "", default: "", meaning: "", set: |_, _| Ok(()), get: |_| None }
        }
        const STAGES: &[Stage<()>] = &[Stage { name: "a", meaning: "", required: false, enable: NOTHING }];
        let fault = |keys: Vec<Key<()>>| Table { stages: STAGES, keys: keys.leak() }.check().unwrap_err();
        assert_eq!(fault(vec![key("a.x", Kind::Bool), key("a.x", Kind::Text)]), "key a.x is declared twice");
        assert_eq!(fault(vec![key("b.x", Kind::Bool)]), "key b.x has no stage b");
        assert_eq!(fault(vec![key("a", Kind::Bool)]), "key a is a stage as well");
        assert_eq!(fault(vec![key("a.x y", Kind::Bool)]), "key \"a.x y\" is not made of bare TOML keys");
        assert_eq!(fault(vec![key("a.x", Kind::Choice(&["p", "q", "p"]))]), "key a.x: p is listed twice");
        assert_eq!(fault(vec![key("a.x", Kind::Int { min: 1, max: 0 })]), "key a.x: no integer from 1 to 0");
    }
}
