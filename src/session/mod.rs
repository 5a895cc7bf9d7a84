//! The state behind the window, and the only function that changes it.
