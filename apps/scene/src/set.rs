//! `--set key=value`: one key of a scene from the command line.

use toml_edit::{Item, Value as Toml};

use crate::check::{shown_part, value_of};
use crate::error::{Place, Problem, REASON_LIMIT, SceneError, VALUE_LIMIT, one_line};
use crate::{Kind, Table};

impl<S> Table<S> {
    /// Sets one key from `key=value`, enabling its stage. The value is in TOML syntax; where that fails, and for keys
    /// that hold words, a bare word is taken as a string: `solver.method=cg`.
    ///
    /// # Errors
    /// One line that starts with `--set`: no `=`, an unknown key, a value of the wrong type or out of range.
    pub fn set(&self, scene: &mut S, assignment: &str) -> Result<(), SceneError> {
        self.assign(scene, assignment).map_err(|problem| SceneError { place: Place::Set, problem })
    }

    fn assign(&self, scene: &mut S, assignment: &str) -> Result<(), Problem> {
        let (path, raw) = assignment
            .split_once('=')
            .map(|(path, raw)| (path.trim(), raw.trim()))
            .filter(|(path, _)| !path.is_empty())
            .ok_or_else(|| Problem::Assignment(format!("`{}`", one_line(assignment, VALUE_LIMIT))))?;
        let Some(index) = self.key_index(path) else {
            let shown: Vec<_> = path.split('.').map(shown_part).collect();
            return Err(self.unknown_key(one_line(&shown.join("."), 2 * VALUE_LIMIT)));
        };
        let key = &self.keys[index];
        let item = Item::Value(parse(key.kind, raw).map_err(|message| Problem::Value {
            key: path.into(),
            found: format!("`{}` ({message})", one_line(raw, VALUE_LIMIT)),
            expected: key.kind.expected(),
        })?);
        let value = value_of(key.kind, path, &item, raw).map_err(|(problem, _)| problem)?;
        self.enable(key.stage(), scene);
        (key.set)(scene, &value)
            .map_err(|reason| Problem::Rejected { key: path.into(), reason: one_line(&reason, REASON_LIMIT) })
    }
}

/// The value in TOML syntax, or the text itself where that is what was meant. The error is the parser's message.
fn parse(kind: Kind, raw: &str) -> Result<Toml, String> {
    let quoted = raw.starts_with(['"', '\'']);
    // `output.name=2026` is a name, whatever it looks like.
    if matches!(kind, Kind::Choice(_) | Kind::Text) && !quoted && !raw.is_empty() {
        return Ok(raw.into());
    }
    match raw.parse::<Toml>() {
        Ok(value) => Ok(value),
        Err(_) if !raw.is_empty() && !quoted && !raw.starts_with(['[', '{']) => Ok(raw.into()),
        Err(error) => Err(one_line(error.message(), VALUE_LIMIT)),
    }
}

#[cfg(test)]
mod tests {
    use crate::sample::{Needle, Scene, TABLE};

    fn set(assignment: &str) -> Result<Scene, String> {
        let mut scene = Scene::default();
        TABLE.set(&mut scene, assignment).map(|()| scene).map_err(|error| error.to_string())
    }

    #[test]
    fn values_are_toml_or_bare_words() {
        assert_eq!(set("mesh.h_start=3").unwrap().mesh.h_start, 3);
        assert_eq!(set(" mesh.poisson = 0.3 ").unwrap().mesh.poisson, 0.3);
        assert!(set("mesh.smooth=true").unwrap().mesh.smooth);
        assert_eq!(set("mesh.corner=[1, 2]").unwrap().mesh.corner, [1.0, 2.0]);
        let motion = set("needle.motion=[{t=0, insert=1}]").unwrap().needle.unwrap().motion;
        assert_eq!(motion[0].get("insert"), Some(1.0));
        for (text, title) in
            [("a = b", "a = b"), ("2026", "2026"), ("'true'", "true"), ("\"x\\ty\"", "x\ty"), ("''", "")]
        {
            assert_eq!(set(&format!("title={text}")).unwrap().title, title);
        }
        assert_eq!(set("needle.method=direct").unwrap().needle.unwrap().method, "direct");
    }

    #[test]
    fn setting_a_key_enables_its_stage_and_keeps_the_rest() {
        let mut scene = set("needle.force=2").unwrap();
        TABLE.set(&mut scene, "needle.rod.stiffness=5").unwrap();
        TABLE.set(&mut scene, "needle.method=cg").unwrap();
        assert_eq!(scene.needle, Some(Needle { force: Some(2.0), rod: Some(5.0), ..Needle::default() }));
    }

    #[test]
    fn errors_start_with_the_option() {
        for (assignment, message) in [
            ("mesh.h_start", "found `mesh.h_start`, expected key=value"),
            ("=3", "found `=3`, expected key=value"),
            ("", "found ``, expected key=value"),
            ("mesh.h_strat=3", "mesh.h_strat: unknown key; nearest known key is mesh.h_start"),
            ("mesh.h_start=two", "mesh.h_start: found the string \"two\", expected an integer from 0 to 12"),
            (
                "mesh.h_start=3\nmesh.smooth=true",
                "mesh.h_start: found the string \"3 mesh.smooth=true\", expected an integer from 0 to 12",
            ),
            ("mesh.poisson=inf", "mesh.poisson: found inf, expected a number >= 0 and < 0.5"),
            ("mesh.corner=[-1]", "mesh.corner: the corner must not be at -1"),
            ("needle.motion=[{insert=1}]", "needle.motion.t (row 1): missing, expected a number >= 0"),
            (
                "needle.method=cgg",
                "needle.method: found the string \"cgg\", expected one of \"cg\", \"newton\", \"direct\"; nearest is \"cg\"",
            ),
        ] {
            assert_eq!(set(assignment).expect_err(assignment), format!("--set: {message}"));
        }
        assert!(set("mesh.corner=[1,").unwrap_err().starts_with("--set: mesh.corner: found `[1,` ("));
        assert!(set("mesh.h_start=").unwrap_err().starts_with("--set: mesh.h_start: found `` ("));
    }
}
