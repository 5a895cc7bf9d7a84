//! Data sets: every layout opened, read and written, what is damaged or hostile, and the threads that load.

mod bad_input;
mod calibration;
mod captures;
mod chain;
mod hiber;
mod hupr_raw;
mod info;
mod layouts;
mod npz;
mod open;
mod raw_sets;
mod rt_pose;
mod simulate;
mod threads;
