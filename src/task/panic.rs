//! Panics as errors: a panic is a defect of this program, and one piece of work of thousands must not end the others.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs `work`; what it has changed is used again, so a panic must not leave it half done.
///
/// # Errors
/// The text of a panic.
pub(crate) fn catch_panic<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| text_of(panic.as_ref()))
}

/// Runs `work` whose errors are lines for a person.
///
/// # Errors
/// That of `work`, or one that tells of an internal error.
pub(crate) fn panic_as_error<T>(work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    catch_panic(work).unwrap_or_else(|text| Err(format!("internal error: {text}")))
}

fn text_of(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
    text.or_else(|| panic.downcast_ref::<String>().cloned()).unwrap_or_else(|| "a panic without text".into())
}

#[cfg(test)]
mod tests {
    #![expect(clippy::panic, reason = "what is caught here")]
    use super::*;

    #[test]
    fn a_panic_is_told_whatever_its_text_is_made_of() {
        assert_eq!(catch_panic(|| 3), Ok(3));
        assert_eq!(catch_panic::<()>(|| panic!("fixed")), Err("fixed".into()));
        assert_eq!(catch_panic::<()>(|| panic!("frame {}", 7)), Err("frame 7".into()));
        assert_eq!(catch_panic::<()>(|| std::panic::panic_any(7)), Err("a panic without text".into()));
        assert_eq!(panic_as_error::<()>(|| Err("no file".into())), Err("no file".into()));
        assert_eq!(panic_as_error::<()>(|| panic!("index 9")), Err("internal error: index 9".into()));
    }
}
