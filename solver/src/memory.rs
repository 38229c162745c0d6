//! How much memory a value holds.

/// Bytes of a vector, spare room included.
pub(crate) fn bytes_of<T>(vector: &Vec<T>) -> usize {
    vector.capacity() * size_of::<T>()
}

/// Bytes of several.
pub(crate) fn bytes_of_all<'a, T: 'a>(vectors: impl IntoIterator<Item = &'a Vec<T>>) -> usize {
    vectors.into_iter().map(bytes_of).sum()
}
