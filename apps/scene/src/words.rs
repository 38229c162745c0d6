//! Words of a scene file that stand for the values of an enumeration.

use crate::Value;

/// A word for each value.
pub trait Words: Copy + PartialEq + 'static {
    /// The words, and what each stands for.
    const WORDS: &'static [(&'static str, Self)];

    /// The value that a word stands for.
    ///
    /// # Errors
    /// What was found instead of one of the words.
    fn read(value: &Value) -> Result<Self, String> {
        let word = value.text()?;
        let found = Self::WORDS.iter().find(|(name, _)| *name == word);
        found.map(|(_, value)| *value).ok_or_else(|| format!("found {word}"))
    }

    /// The word of a value, if it has one.
    fn write(self) -> Option<Value> {
        Self::WORDS.iter().find(|(_, value)| *value == self).map(|(name, _)| Value::Text((*name).into()))
    }
}
