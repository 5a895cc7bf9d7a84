//! An iteration in single precision allocates nothing once its buffers have grown.
#![expect(clippy::unwrap_used, reason = "a test stops where its material is missing")]

use cap::Cap;
use std::alloc::System;

#[path = "common/cases.rs"]
mod cases;
mod common;
#[path = "common/reading.rs"]
mod reading;

use cases::Case;
use mhp_inspector::config::Parameterization;
use mhp_inspector::mhp::{Fitter, Precision};
use reading::case_folders;
use std::sync::Arc;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, usize::MAX);

/// One test, for the counter is the whole process's.
#[test]
fn steady_iterations_allocate_nothing() {
    for folder in case_folders() {
        for parameterization in [Parameterization::default(), Parameterization::Bones] {
            let Case { problem, mut config, params } = Case::open(&folder);
            config.parameterization = parameterization;
            let mut fitter = Fitter::new(Arc::new(problem), config, Precision::F32, params).unwrap();
            for _ in 0..20 {
                fitter.step().unwrap();
            }
            let before = ALLOCATOR.total_allocated();
            for _ in 0..50 {
                fitter.step().unwrap();
            }
            let bytes = ALLOCATOR.total_allocated() - before;
            assert_eq!(bytes, 0, "{}: {parameterization:?}", folder.display());
        }
    }
}
