//! What all conditions share: words, quotes, comparisons.

/// How a number is compared with a limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Comparison {
    Less,
    LessOrEqual,
    Equal,
    GreaterOrEqual,
    Greater,
}

impl Comparison {
    /// Whether a number compares so with a limit.
    pub(crate) fn holds(self, value: f64, limit: f64) -> bool {
        match self {
            Self::Less => value < limit,
            Self::LessOrEqual => value <= limit,
            Self::Equal => value == limit,
            Self::GreaterOrEqual => value >= limit,
            Self::Greater => value > limit,
        }
    }
}

/// Name, comparison and limit of `iou<0.5`; `None` where the text is no comparison.
///
/// # Errors
/// Where what follows the sign is no number.
pub(crate) fn comparison(text: &str) -> Option<Result<(&str, Comparison, f64), String>> {
    let at = text.find(['<', '>', '=']).filter(|&at| at > 0 && !text[..at].contains(':'))?;
    let (key, rest) = text.split_at(at);
    let (comparison, digits) = [
        ("<=", Comparison::LessOrEqual),
        (">=", Comparison::GreaterOrEqual),
        ("==", Comparison::Equal),
        ("<", Comparison::Less),
        (">", Comparison::Greater),
        ("=", Comparison::Equal),
    ]
    .into_iter()
    .find_map(|(sign, comparison)| rest.strip_prefix(sign).map(|digits| (comparison, digits)))?;
    let limit =
        digits.parse().map_err(|_| format!("`{key}{rest}`: `{digits}` is not a number; expected for example 0.5"));
    Some(limit.map(|limit| (key, comparison, limit)))
}

/// Splits at spaces outside quotes.
///
/// # Errors
/// Where a quote is not closed.
pub(crate) fn split(text: &str) -> Result<Vec<String>, String> {
    let (mut parts, mut part, mut quoted) = (Vec::new(), String::new(), false);
    for c in text.chars() {
        match c {
            '"' => quoted = !quoted,
            c if c.is_whitespace() && !quoted => {
                if !part.is_empty() {
                    parts.push(std::mem::take(&mut part));
                }
            }
            c => part.push(c),
        }
    }
    if quoted {
        return Err("a quote is not closed".into());
    }
    if !part.is_empty() {
        parts.push(part);
    }
    Ok(parts)
}
