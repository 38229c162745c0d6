//! The short form of a key's declaration.

/// One [`Key`](crate::Key) of a field: by an accessor of [`Value`](crate::Value), or by [`Words`](crate::Words).
///
/// `key!(path, kind, unit, default, meaning, accessor: |s| field, |s| value)`, or
/// `key!(path, words, default, meaning, Type: |s| field, |s| value)` for a field whose type has words.
#[macro_export]
macro_rules! key {
    ($path:literal, $kind:expr, $unit:literal, $default:literal, $meaning:literal,
     $read:ident: |$s:ident| $place:expr, |$g:ident| $get:expr) => {
        $crate::Key {
            path: $path,
            kind: $kind,
            unit: $unit,
            default: $default,
            meaning: $meaning,
            set: |$s, value| {
                $place = value.$read()?.to_owned().into();
                Ok(())
            },
            get: |$g| $get,
        }
    };
    ($path:literal, $words:expr, $default:literal, $meaning:literal,
     $type:ty: |$s:ident| $place:expr, |$g:ident| $get:expr) => {
        $crate::Key {
            path: $path,
            kind: $crate::Kind::Choice($words),
            unit: "",
            default: $default,
            meaning: $meaning,
            set: |$s, value| {
                $place = <$type as $crate::Words>::read(value)?.into();
                Ok(())
            },
            get: |$g| $get,
        }
    };
}

/// One [`Key`](crate::Key) of an array of tables, whose rows are checked one by one.
///
/// `rows!(path, columns, meaning, field, check)`: a refused row is named by its number, with `check, name` by what `name` calls
/// it too.
#[macro_export]
macro_rules! rows {
    ($path:literal, $columns:expr, $meaning:literal, $field:ident, $check:expr $(, $name:expr)?) => {
        $crate::Key {
            path: $path,
            kind: $crate::Kind::Rows($columns),
            unit: "",
            default: "none",
            meaning: $meaning,
            set: |s, value| {
                for (index, row) in value.rows()?.iter().enumerate() {
                    let check: fn(&$crate::Row) -> Result<(), String> = $check;
                    check(row).map_err(|reason| {
                        let place = format!("row {}", index + 1);
                        $(let place = format!("{place} ({})", $name(row));)?
                        format!("{place}: {reason}")
                    })?;
                }
                s.$field = value.rows()?.to_vec();
                Ok(())
            },
            get: |s| (!s.$field.is_empty()).then(|| $crate::Value::Rows(s.$field.clone())),
        }
    };
}
