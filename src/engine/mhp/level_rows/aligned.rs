//! Numbers that lie as the widest registers want them.

use super::LANES;
use bytemuck::{Pod, Zeroable};
use std::ops::{Deref, DerefMut};

/// Whole registers of f32, none of them across two lines of the cache: there each load and store would count twice.
#[derive(Debug, Clone, Default)]
pub(super) struct AlignedF32s(Vec<Register>);

#[derive(Debug, Clone, Copy, Pod, Zeroable)]
#[repr(C, align(64))]
struct Register([f32; LANES]);

impl AlignedF32s {
    /// So many zeros, up to whole registers.
    pub(super) fn zeros(len: usize) -> Self {
        Self(vec![Register::zeroed(); len.div_ceil(LANES)])
    }

    /// As many, all of them zero.
    pub(super) fn reset(&mut self, len: usize) {
        self.0.clear();
        self.hold(len);
    }

    /// As many; those that it had before stay.
    pub(super) fn hold(&mut self, len: usize) {
        self.0.resize(len.div_ceil(LANES), Register::zeroed());
    }
}

impl Deref for AlignedF32s {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        bytemuck::cast_slice(&self.0)
    }
}

impl DerefMut for AlignedF32s {
    fn deref_mut(&mut self) -> &mut [f32] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}
