//! Reading a scene: parse, check every key in the order of the file, then enable stages and set keys.

use std::ops::Range;

use toml_edit::{Document, TableLike};

use crate::check::{Fault, fault, key_span, shown_part, value_of};
use crate::error::{NAME_LIMIT, Place, Problem, REASON_LIMIT, SceneError, VALUE_LIMIT, one_line};
use crate::nearest::nearest;
use crate::{Table, Value};

/// Whether a text is TOML with a table of this name at its top.
pub fn has_table(text: &str, name: &str) -> bool {
    Document::parse(text).is_ok_and(|document| document.as_table().contains_table(name))
}

/// Whether a text is TOML with an array of tables of this name at its top, such as `[[needle]]`.
pub fn has_rows(text: &str, name: &str) -> bool {
    let rows = |item: &toml_edit::Item| item.is_array_of_tables() || item.is_array();
    Document::parse(text).is_ok_and(|document| document.as_table().get(name).is_some_and(rows))
}

/// What a file says, checked but not yet stored.
#[derive(Default)]
struct Findings {
    tables: Vec<String>,
    values: Vec<Assignment>,
}

/// One key of the file.
struct Assignment {
    /// Position in [`Table::keys`].
    key: usize,
    value: Value,
    span: Option<Range<usize>>,
}

impl<S> Table<S> {
    /// Reads a TOML scene into `scene`, over what it holds.
    ///
    /// `name` is what messages call the text: a file name, or `built-in scene X`. The whole text is checked before the
    /// scene is touched. Stages are enabled, then keys set, in the order of the *declaration*, so that the order of the
    /// file does not matter.
    ///
    /// # Errors
    /// One line with the first problem in the order of the file: bad syntax, an unknown or repeated table or key, a
    /// value of the wrong type or out of range, a missing required table. Should a key's own setter refuse its value,
    /// the keys before it have been set.
    pub fn read(&self, name: &str, text: &str, scene: &mut S) -> Result<(), SceneError> {
        let at = |(problem, span): Fault| SceneError { place: place(name, text, span), problem };
        let document = Document::parse(text).map_err(|error| at(syntax(&error, text)))?;
        let mut found = Findings::default();
        self.walk(document.as_table(), "", text, &mut found).map_err(at)?;
        self.require_tables(&found).map_err(at)?;
        self.store(found, scene).map_err(at)
    }

    /// How many tables and keys of a text this table does not know; none of a text that is no TOML.
    pub fn count_unknown(&self, text: &str) -> usize {
        Document::parse(text).map_or(0, |document| self.count_unknown_in(document.as_table(), ""))
    }

    fn count_unknown_in(&self, table: &dyn TableLike, prefix: &str) -> usize {
        let unknown = |(part, item): (&str, &toml_edit::Item)| {
            let path = if prefix.is_empty() { shown_part(part) } else { format!("{prefix}.{}", shown_part(part)) };
            match (self.key_index(&path), item.as_table_like()) {
                // An array of tables and a table of one name are two things.
                (Some(at), _) => usize::from(matches!(self.keys[at].kind, crate::Kind::Rows(_)) && item.is_table()),
                (None, Some(inner)) if self.is_table(&path) => self.count_unknown_in(inner, &path),
                _ => 1,
            }
        };
        table.iter().map(unknown).sum()
    }

    /// Collects the keys of one TOML table, and of those within it.
    fn walk(&self, table: &dyn TableLike, prefix: &str, text: &str, found: &mut Findings) -> Result<(), Fault> {
        for (part, item) in table.iter() {
            let part_shown = shown_part(part);
            let path = if prefix.is_empty() { part_shown } else { format!("{prefix}.{part_shown}") };
            let span = key_span(table, part);
            if let Some(key) = self.key_index(&path) {
                let value = value_of(self.keys[key].kind, &path, item, text)?;
                found.values.push(Assignment { key, value, span: item.span().or(span) });
            } else if self.is_table(&path) {
                let inner =
                    item.as_table_like().ok_or_else(|| fault(&path, item, text, format!("a table [{path}]")))?;
                found.tables.push(path.clone());
                self.walk(inner, &path, text, found)?;
            } else if item.is_table_like() || item.is_array_of_tables() {
                return Err((self.unknown_table(path), span));
            } else {
                return Err((self.unknown_key(path), span));
            }
        }
        Ok(())
    }

    /// The problem of a key that is not declared.
    pub(crate) fn unknown_key(&self, key: String) -> Problem {
        let nearest = nearest(&key, self.keys.iter().map(|known| known.path)).into();
        Problem::UnknownKey { key, nearest }
    }

    fn unknown_table(&self, table: String) -> Problem {
        // An array of tables is a key here, and a table to whoever misspelt it.
        let arrays = self.keys.iter().filter(|key| matches!(key.kind, crate::Kind::Rows(_))).map(|key| key.path);
        let known = self.stages.iter().map(|stage| stage.name).chain(arrays);
        let nearest = nearest(&table, known).into();
        Problem::UnknownTable { table, nearest }
    }

    fn require_tables(&self, found: &Findings) -> Result<(), Fault> {
        let missing = self.stages.iter().find(|stage| stage.required && !found.tables.iter().any(|t| t == stage.name));
        match missing {
            Some(stage) => Err((Problem::MissingTable { table: stage.name, meaning: stage.meaning }, None)),
            None => Ok(()),
        }
    }

    fn store(&self, mut found: Findings, scene: &mut S) -> Result<(), Fault> {
        for stage in self.stages {
            if found.tables.iter().any(|table| table == stage.name) {
                self.enable(stage.name, scene);
            }
        }
        found.values.sort_by_key(|assignment| assignment.key);
        for Assignment { key, value, span } in found.values {
            let key = &self.keys[key];
            (key.set)(scene, &value).map_err(|reason| {
                let reason = one_line(&reason, REASON_LIMIT);
                (Problem::Rejected { key: key.path.into(), reason }, span)
            })?;
        }
        Ok(())
    }
}

/// The parser's message, with the piece of text that it is about.
fn syntax(error: &toml_edit::TomlError, text: &str) -> Fault {
    let message = one_line(error.message(), REASON_LIMIT);
    let piece = error.span().and_then(|span| text.get(span)).map(|piece| one_line(piece, VALUE_LIMIT));
    let problem = match piece {
        Some(piece) if !piece.is_empty() => Problem::Syntax(format!("{message}, found `{piece}`")),
        _ => Problem::Syntax(message),
    };
    (problem, error.span())
}

/// The file, with the line of the first byte of `span` if there is one.
fn place(name: &str, text: &str, span: Option<Range<usize>>) -> Place {
    let name = one_line(name, NAME_LIMIT);
    match span {
        Some(span) => {
            let before = &text.as_bytes()[..span.start.min(text.len())];
            Place::Line(name, 1 + before.iter().filter(|&&byte| byte == b'\n').count())
        }
        None => Place::File(name),
    }
}

#[cfg(test)]
mod tests {
    use crate::Row;
    use crate::sample::{Needle, Scene, TABLE};

    fn read(text: &str) -> Result<Scene, String> {
        let mut scene = Scene::default();
        TABLE.read("slab.toml", text, &mut scene).map(|()| scene).map_err(|error| error.to_string())
    }

    fn error(text: &str) -> String {
        read(text).expect_err(text)
    }

    #[test]
    fn every_kind_of_key_is_read() {
        let scene = read(
            "title = 'a slab'\n[mesh]\nh_start = 3\npoisson = 0\nsmooth = true\ncorner = [1, -2.5]\n[needle]\nforce = 2\n\
             method = \"newton\"\n[[needle.motion]]\nt = 0\n[[needle.motion]]\ninsert = -0.01\nt = 1.5\n",
        )
        .unwrap();
        assert_eq!((scene.title.as_str(), scene.mesh.h_start, scene.mesh.smooth), ("a slab", 3, true));
        assert_eq!(scene.mesh.corner, [1.0, -2.5]);
        let needle = scene.needle.unwrap();
        assert_eq!((needle.method.as_str(), needle.force, needle.rod), ("newton", Some(2.0), None));
        let rows: [Row; 2] =
            [[("t", 0.0)].into_iter().collect(), [("t", 1.5), ("insert", -0.01)].into_iter().collect()];
        assert_eq!(needle.motion, rows);
    }

    #[test]
    fn all_notations_of_toml_mean_the_same() {
        let tables = read("[mesh]\nh_start = 2\n[needle]\n[[needle.motion]]\nt = 1\n[needle.rod]\nstiffness = 3\n");
        let inline = read("mesh = { h_start = 2 }\nneedle.motion = [{ t = 1 }]\nneedle.rod = { stiffness = 3.0 }\n");
        let reordered = read("[needle.rod]\nstiffness = 3\n[needle]\nmotion = [{t=1e0}]\n[mesh]\nh_start = 0x2\n");
        assert!(tables.is_ok());
        assert_eq!(tables, inline);
        assert_eq!(tables, reordered);
    }

    #[test]
    fn an_empty_table_is_a_stage_and_a_missing_one_is_not() {
        assert_eq!(read("[mesh]\n").unwrap().needle, None);
        assert_eq!(read("[mesh]\n[needle]\n").unwrap().needle, Some(Needle::default()));
        // A table within a stage brings the stage with it.
        let with_rod = Needle { rod: Some(1.0), ..Needle::default() };
        assert_eq!(read("[mesh]\n[needle.rod]\n").unwrap().needle, Some(with_rod));
        assert_eq!(error("[needle]\n"), "slab.toml: table [mesh] is missing: the tissue");
    }

    #[test]
    fn unknown_names_are_answered_with_the_nearest() {
        for (text, message) in [
            ("[mesh]\nh_strat = 3", "2: mesh.h_strat: unknown key; nearest known key is mesh.h_start"),
            ("[mesh]\nforce = 3", "2: mesh.force: unknown key; nearest known key is needle.force"),
            ("[mehs]\nh_start = 3", "1: [mehs]: unknown table; nearest known table is [mesh]"),
            (
                "[mesh]\n[[needle.motoin]]\nt = 0",
                "2: [needle.motoin]: unknown table; nearest known table is [needle.motion]",
            ),
            ("titel = 'x'", "1: titel: unknown key; nearest known key is title"),
            ("\"mesh.h_start\" = 3", "1: \"mesh.h_start\": unknown key; nearest known key is mesh.h_start"),
            (
                "[mesh]\n[[needle.motion]]\nt = 0\ninsrt = 1",
                "4: needle.motion.insrt (row 1): unknown key; nearest known key is needle.motion.insert",
            ),
        ] {
            assert_eq!(error(text), format!("slab.toml:{message}"));
        }
    }

    #[test]
    fn wrong_values_are_shown_with_what_was_expected() {
        for (text, message) in [
            ("[mesh]\n\npoisson = 0.5", "3: mesh.poisson: found 0.5, expected a number >= 0 and < 0.5"),
            ("[mesh]\npoisson = nan", "2: mesh.poisson: found nan, expected a number >= 0 and < 0.5"),
            ("[mesh]\npoisson = '0.2'", "2: mesh.poisson: found the string '0.2', expected a number >= 0 and < 0.5"),
            ("[needle]\nforce = inf", "2: needle.force: found inf, expected a number > 0"),
            ("[needle]\nforce = 0", "2: needle.force: found 0, expected a number > 0"),
            ("[mesh]\nh_start = 3.0", "2: mesh.h_start: found 3.0, expected an integer from 0 to 12"),
            ("[mesh]\nh_start = 13", "2: mesh.h_start: found 13, expected an integer from 0 to 12"),
            ("[mesh]\nsmooth = 1", "2: mesh.smooth: found 1, expected true or false"),
            (
                "[mesh]\nsmooth = 2026-11-01",
                "2: mesh.smooth: found the date or time 2026-11-01, expected true or false",
            ),
            ("title = [1,\n 2]", "1: title: found a list of 2 ([1, 2]), expected a string"),
            ("[mesh.h_start]", "1: mesh.h_start: found a table, expected an integer from 0 to 12"),
            ("mesh = 3", "1: mesh: found 3, expected a table [mesh]"),
            ("[[mesh]]", "1: mesh: found an array of tables, expected a table [mesh]"),
            (
                "[mesh]\ncorner = [1, 2, 3, 4]",
                "2: mesh.corner: found a list of 4 ([1, 2, 3, 4]), expected a list of 0 to 3 numbers",
            ),
            (
                "[mesh]\ncorner = [1, nan]",
                "2: mesh.corner: found a list of 2 ([1, nan]), expected a list of 0 to 3 numbers",
            ),
            (
                "[needle.motion]\nt = 0",
                "1: needle.motion: found a table, expected an array of tables [[needle.motion]]",
            ),
            ("[needle]\nmotion = 3", "2: needle.motion: found 3, expected an array of tables [[needle.motion]]"),
            (
                "[needle]\nmethod = 'Newton'",
                "2: needle.method: found the string 'Newton', expected one of \"cg\", \"newton\", \"direct\"; nearest \
                 is \"newton\"",
            ),
            (
                "[[needle.motion]]\nt = 0\n[[needle.motion]]\ninsert = 1",
                "3: needle.motion.t (row 2): missing, expected a number >= 0",
            ),
            ("[[needle.motion]]\nt = -1", "2: needle.motion.t (row 1): found -1, expected a number >= 0"),
        ] {
            assert_eq!(error(text), format!("slab.toml:{message}"));
        }
    }

    #[test]
    fn syntax_errors_name_the_line() {
        for (text, line) in [
            ("[mesh]\nh_start = 3\nh_start = 4\n", 3),
            ("[mesh]\n[needle]\n[mesh]\n", 3),
            ("[mesh]\nh_start = \n", 2),
            ("[mesh\nh_start = 3", 1),
            ("[mesh]\npoisson = 0,3\n", 2),
            ("[mesh]\ntitle = \"open\n", 2),
            ("[mesh]\nh_start = 99999999999999999999\n", 2),
            ("\n\n\u{1}", 3),
        ] {
            let message = error(text);
            assert!(message.starts_with(&format!("slab.toml:{line}: not valid TOML: ")), "{text:?}: {message}");
            assert!(!message.contains('\n'), "{message:?}");
        }
    }

    #[test]
    fn the_first_problem_of_the_file_is_told_and_the_scene_is_untouched() {
        let mut scene = Scene { title: "kept".into(), ..Scene::default() };
        let before = scene.clone();
        let text = "title = 'new'\n[mesh]\nsmooth = true\npoisson = 9\nh_start = 99\n";
        let error = TABLE.read("built-in scene slab", text, &mut scene).unwrap_err().to_string();
        assert_eq!(error, "built-in scene slab:4: mesh.poisson: found 9, expected a number >= 0 and < 0.5");
        assert_eq!(scene, before);
    }

    #[test]
    fn a_setter_that_refuses_is_one_line_too() {
        assert_eq!(error("[mesh]\ncorner = [-1]"), "slab.toml:2: mesh.corner: the corner must not be at -1");
    }

    #[test]
    fn hostile_values_are_shortened() {
        let message = error(&format!("[mesh]\nsmooth = '{}'", "x".repeat(1_000_000)));
        assert!(message.len() < 150, "{message}");
        let message = error(&format!("[mesh]\n\"{}\" = 1", "\\u0007é".repeat(100_000)));
        assert!(message.chars().count() < 800 && !message.contains('\u{7}'), "{message}");
    }
}
