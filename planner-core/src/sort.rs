//! Sorting of a few dozen values in little flash: the sorts of `core` take up to 8 KB a type.

/// Sorts by insertion, `is_before` the order; values that tie keep their places.
///
/// It takes some `n²/4` comparisons: 600 of the 50 terms of the longest prefilter.
pub(crate) fn sort_by<T>(values: &mut [T], mut is_before: impl FnMut(&T, &T) -> bool) {
    for end in 1..values.len() {
        for at in (1..=end).rev() {
            match values.get(at - 1..=at) {
                Some([one, other]) if is_before(other, one) => values.swap(at - 1, at),
                _ => break,
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use proptest::prelude::*;

    use super::sort_by;

    proptest! {
        #[test]
        fn it_sorts_as_the_stable_sort_of_the_library(keys in prop::collection::vec(0..20, 0..50)) {
            let mut values: Vec<_> = keys.into_iter().enumerate().collect();
            let mut oracle = values.clone();
            oracle.sort_by_key(|(_, key)| *key);
            sort_by(&mut values, |one, other| one.1 < other.1);
            prop_assert_eq!(values, oracle);
        }
    }
}
