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
