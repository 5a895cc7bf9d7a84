//! The thread that runs a fit, and its protocol.
