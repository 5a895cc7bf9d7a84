//! The joints of every tile: lists that keep their room.

use super::{ACROSS, ALONG, Joint, Lanes, STRONGEST, Simd, lanes, splat};

/// A joint in a tile that it matters to.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Pair {
    /// Place in the list of tiles that are summed.
    pub slot: u32,
    pub slice: u32,
    pub row: u32,
    pub column: u32,
    /// log₂ in the tile's middle relative to the view's scale, and its slopes.
    pub exponent: f32,
    pub slope: [f32; 2],
    /// e^{i…} in the middle.
    pub turn: [f32; 2],
    /// Middle minus joint, bins: across, along.
    pub delta: [f32; 2],
}

/// The pairs of one joint.
#[derive(Debug, Default)]
pub(super) struct Pairs {
    /// Those in use, then those of evaluations before: a place that is written to field by field costs no copy.
    all: Vec<Pair>,
    used: usize,
}

impl Pairs {
    /// Forgets them; `most` is the number of tiles that there are.
    pub(super) fn clear(&mut self, most: usize) {
        // Room to grow, for the number drifts while a fit moves. Memory that is not touched costs nothing.
        if self.all.capacity() < most.min(self.used + self.used / 2 + 16) {
            self.all.reserve_exact(most.min(4 * self.used + 1024).saturating_sub(self.all.len()));
        }
        self.used = 0;
    }

    pub(super) fn list(&self) -> &[Pair] {
        &self.all[..self.used]
    }

    pub(super) fn next(&mut self) -> &mut Pair {
        if self.used == self.all.len() {
            self.all.push(Pair::default());
        }
        self.used += 1;
        &mut self.all[self.used - 1]
    }
}

impl Pair {
    /// A K of some of the tile's cells and its unit phase (Re, Im; nothing where the sum is incoherent).
    #[inline(always)]
    pub(super) fn at<S: Simd, const COHERENT: bool>(&self, simd: S, joint: &Joint, part: usize) -> [Lanes<S>; 3] {
        let [across, along] = self.slope;
        let bent = lanes(simd, &joint.quadratic, part) + splat(simd, self.exponent);
        let mut exponent = lanes(simd, &ALONG, part).mul_add(splat(simd, along), bent);
        exponent = lanes(simd, &ACROSS, part).mul_add(splat(simd, across), exponent);
        if let Some(spectrum) = joint.along.cells.get(self.column as usize) {
            exponent += lanes(simd, spectrum, part);
        }
        if let Some(spectrum) = joint.across.cells.get(self.row as usize) {
            exponent += lanes(simd, spectrum, part);
        }
        let a = exponent.max(splat(simd, -126.0)).min(splat(simd, STRONGEST)).exp2();
        if !COHERENT {
            return [a, splat(simd, 0.0), splat(simd, 0.0)];
        }
        let (c, s) = (splat(simd, self.turn[0]), splat(simd, self.turn[1]));
        let (re, im) = (lanes(simd, &joint.turn[0], part), lanes(simd, &joint.turn[1], part));
        [a, c * re - s * im, c.mul_add(im, s * re)]
    }
}
