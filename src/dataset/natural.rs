//! The order of names: numbers in them count by value.

use std::cmp::Ordering;

/// Numbers inside names by value, the rest by character: `d9s1` before `d10s1`.
pub(crate) fn natural(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    while let (Some((&x, rest_x)), Some((&y, rest_y))) = (left.split_first(), right.split_first()) {
        let order = if x.is_ascii_digit() && y.is_ascii_digit() {
            let (number_x, after_x) = leading_number(left);
            let (number_y, after_y) = leading_number(right);
            (left, right) = (after_x, after_y);
            number_x.len().cmp(&number_y.len()).then(number_x.cmp(number_y))
        } else {
            (left, right) = (rest_x, rest_y);
            x.cmp(&y)
        };
        if order != Ordering::Equal {
            return order;
        }
    }
    left.len().cmp(&right.len()).then_with(|| a.cmp(b))
}

/// The digits at the start without leading zeros, and what follows them.
fn leading_number(text: &[u8]) -> (&[u8], &[u8]) {
    let end = text.iter().position(|b| !b.is_ascii_digit()).unwrap_or(text.len());
    let (digits, rest) = text.split_at(end);
    let zeros = digits.iter().position(|&b| b != b'0').unwrap_or(digits.len());
    (digits.get(zeros..).unwrap_or_default(), rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sorts_numbers_by_value() {
        let mut names = ["d10s1", "d9s2", "d9s10", "P1", "00010", "2", "x"].map(str::to_owned);
        names.sort_by(|a, b| natural(a, b));
        assert_eq!(names, ["2", "00010", "P1", "d9s2", "d9s10", "d10s1", "x"]);
    }
}
