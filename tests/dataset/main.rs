//! Data sets: every layout opened, read and written, what is damaged or hostile, and the threads that load.

mod bad_input;
mod calibration;
mod captures;
mod chain;
mod info;
mod layouts;
mod npz;
mod open;
mod simulate;
mod threads;
