//! Values whose changes count themselves, so that what is made from them knows when it is out of date.

use std::ops::Deref;

/// A value that can be changed through `change` alone, which counts.
#[derive(Debug, Default)]
pub struct Tracked<T> {
    value: T,
    revision: u64,
}

impl<T> Tracked<T> {
    /// Another number after every change.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// The value, to be changed.
    pub(super) fn change(&mut self) -> &mut T {
        self.revision += 1;
        &mut self.value
    }
}

impl<T: Default> Tracked<T> {
    /// The same, emptied, as a change like any other.
    pub(super) fn emptied(&self) -> Self {
        Self { value: T::default(), revision: self.revision + 1 }
    }
}

impl<T> Deref for Tracked<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.value
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_change_counts_and_emptying_is_one() {
        let mut list = Tracked::<Vec<u8>>::default();
        assert_eq!((list.len(), list.revision()), (0, 0));
        list.change().push(7);
        assert_eq!((list.as_slice(), list.revision()), (&[7][..], 1));
        assert_eq!((list.emptied().len(), list.emptied().revision()), (0, 2));
    }
}
